"""Keep-out zones and Cartesian speed, judged on the whole way and not only at its end."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np
from scara_config import KeepOut

from twin_controller.core.events import Joints
from twin_controller.core.safety.points import FloatArray, WatchedPoint, positions

STEPS = 64


class Way(msgspec.Struct, frozen=True):
    """A joint move as the watched points see it.

    Attributes:
        target: Where it ends, SI.
        violation: The zone it would enter, in words; empty if none.
        peak_speed: Largest speed of a watched point at 100 % program speed [m/s].
    """

    target: Joints = ()
    violation: str = ""
    peak_speed: float = 0.0


def judge_way(
    points: Sequence[WatchedPoint], zones: Sequence[KeepOut], start: Joints, end: Joints, velocity: Joints, steps: int = STEPS
) -> Way:
    r"""Judge the straight joint-space way from ``start`` to ``end``.

    All joints start and end together, so at full program speed the slowest one sets the pace and a point moves at most
    :math:`\max_s |\partial p / \partial s| \, / \, \max_i (|\Delta q_i| / \dot q_{i,max})`.

    Args:
        points: What is watched.
        zones: Where it may not be.
        start: Joint positions, SI.
        end: Joint positions, SI.
        velocity: Largest joint speeds, SI.
        steps: How many parts the way is cut into.
    """
    first, last = np.array(start), np.array(end)
    share = np.linspace(0.0, 1.0, steps + 1)
    rows = first + share[:, None] * (last - first)
    duration = float(np.max(np.abs(last - first) / np.array(velocity)))
    peak, violation = 0.0, ""
    for point in points:
        path = positions(point, rows)
        if duration > 0.0:
            step = float(np.max(np.linalg.norm(np.diff(path, axis=0), axis=1)))
            peak = max(peak, step * steps / duration)
        violation = violation or entered(point.name, path, zones)
    return Way(end, violation, peak)


def entered(name: str, path: FloatArray, zones: Sequence[KeepOut]) -> str:
    """Return in words where a path (m, 3) [m] enters a zone that its start is not in already; empty if nowhere.

    A point that is in a zone already may leave it, but enter no other.
    """
    for zone in zones:
        inside = np.all((path >= np.array(zone.lower_mm) * 1e-3) & (path <= np.array(zone.upper_mm) * 1e-3), axis=1)
        hits = np.flatnonzero(inside & ~np.logical_and.accumulate(inside))
        if hits.size:
            x, y, z = path[hits[0]] * 1e3
            return f"the {name} would enter keep-out zone {zone.name} at ({x:.0f}, {y:.0f}, {z:.0f}) mm"
    return ""


def braking_way(q: Joints, qdot: Joints, acceleration: Joints, delay: float, reached: Joints | None = None) -> Joints:
    r"""Return where each joint stands at the earliest if it is stopped now, SI.

    .. math:: q + \tfrac{1}{2} (\dot q + \dot q_d) t_d + \dot q_d |\dot q_d| / 2a

    Args:
        q: Joint positions.
        qdot: Joint velocities now.
        acceleration: With what each joint brakes.
        delay: Until it begins to brake, :math:`t_d` [s].
        reached: Joint velocities by then, :math:`\dot q_d`; as now if left out.
    """
    rows = zip(q, qdot, qdot if reached is None else reached, acceleration)
    return tuple(p + 0.5 * (v + w) * delay + w * abs(w) / (2.0 * a) for p, v, w, a in rows)


def reached_speed(before: Joints, after: Joints, dt: float, delay: float, velocity: Joints) -> Joints:
    """Return the joint velocities in ``delay`` [s] if each joint goes on gaining speed as in the last ``dt`` [s].

    What a joint loses does not count: it may stop losing it at any time.
    """
    gains = ((w, (w - v) * delay / dt, limit) for v, w, limit in zip(before, after, velocity))
    return tuple(w if gain * w <= 0.0 else max(-limit, min(w + gain, limit)) for w, gain, limit in gains)


def speed_cap(peak_speed: float, limit_mm_s: float | None) -> float:
    """Return the program speed [percent] at which no watched point exceeds the limit; 100 if there is none."""
    if limit_mm_s is None or peak_speed <= 0.0:
        return 100.0
    return min(100.0, 100.0 * limit_mm_s * 1e-3 / peak_speed)


def fastest_point(points: Sequence[WatchedPoint], q: Joints, qdot: Joints) -> tuple[float, str]:
    """Return the largest speed of a watched point [m/s], by a central difference over 1 ms, and which one it is."""
    centre, step = np.array(q), np.array(qdot) * 5e-4
    rows = np.array([centre - step, centre + step])
    return max(((math.dist(*positions(point, rows)) / 1e-3, point.name) for point in points), default=(0.0, ""))


def point_speed(points: Sequence[WatchedPoint], q: Joints, qdot: Joints) -> float:
    """Return the largest speed of a watched point [m/s]."""
    return fastest_point(points, q, qdot)[0]
