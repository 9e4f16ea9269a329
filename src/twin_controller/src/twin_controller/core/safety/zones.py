"""Keep-out zones and Cartesian speed, judged on the whole way and not only at its end."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np
from scara_config import KeepOut

from twin_controller.core.events import Joints
from twin_controller.core.safety.points import FloatArray, WatchedPoint, all_positions

COARSE_STEPS = 8
MOST_STEPS = 2000
SPACING = 0.01
"""Longest chord of a point's path [m]; at 0.2 m from an axis it is 0.06 mm off the arc."""
FINER = 1.2
BULGE = 0.2
"""How far an arc may bulge beyond its chord, in parts of the chord: an eighth of a coarse step."""
STILL = 1e-12
DEPTH_TOLERANCE = 1e-3
"""A point in a zone that goes deeper by less [m] stands there."""


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
    points: Sequence[WatchedPoint],
    zones: Sequence[KeepOut],
    start: Joints,
    end: Joints,
    velocity: Joints,
) -> Way:
    r"""Judge the straight joint-space way from ``start`` to ``end``.

    All joints start and end together, so at full program speed the slowest one sets the pace and a
    point moves at most
    :math:`\max_s |\partial p / \partial s| \, / \, \max_i (|\Delta q_i| / \dot q_{i,max})`.

    Args:
        points: What is watched.
        zones: Where it may not be.
        start: Joint positions, SI.
        end: Joint positions, SI.
        velocity: Largest joint speeds, SI.
    """
    first, last = np.array(start), np.array(end)
    duration = float(np.max(np.abs(last - first) / np.array(velocity)))
    paths, longest = _paths(points, first, last)
    peak = longest * (paths.shape[1] - 1) / duration if duration > 0.0 else 0.0
    return Way(end, _first_entered(points, paths, zones), peak)


def heads_into(
    points: Sequence[WatchedPoint], zones: Sequence[KeepOut], start: Joints, end: Joints
) -> str:
    """Return in words the zone that the straight joint-space way leads into.

    As :func:`judge_way`, but quick far from zones.
    """
    if not points:
        return ""
    first, last = np.array(start), np.array(end)
    rough = _cut(points, first, last, COARSE_STEPS)
    chords = np.abs(np.diff(rough, axis=1))
    reach = chords.max(axis=1) + BULGE * chords.max(axis=(1, 2))[:, None]
    near = [point for point, close in zip(points, _near(rough, zones, reach)) if close]
    return _first_entered(near, _paths(near, first, last)[0], zones) if near else ""


def _near(
    paths: FloatArray, zones: Sequence[KeepOut], reach: FloatArray | float = 0.0
) -> FloatArray:
    """Return which points come as near as ``reach`` [m] to a zone, by boxes around their paths."""
    low, high = (paths.min(axis=1) - reach) * 1e3, (paths.max(axis=1) + reach) * 1e3
    overlaps = [np.all((low <= zone.upper_mm) & (high >= zone.lower_mm), axis=1) for zone in zones]
    return np.any(overlaps, axis=0) if overlaps else np.zeros(len(paths))


def _first_entered(
    points: Sequence[WatchedPoint], paths: FloatArray, zones: Sequence[KeepOut]
) -> str:
    near = zip(points, paths, _near(paths, zones))
    found = (entered(point.name, path, zones) for point, path, close in near if close)
    return next((violation for violation in found if violation), "")


def _cut(
    points: Sequence[WatchedPoint], first: FloatArray, last: FloatArray, steps: int
) -> FloatArray:
    """Return where the points pass, shape (p, steps + 1, 3) [m]."""
    return all_positions(points, first + np.linspace(0.0, 1.0, steps + 1)[:, None] * (last - first))


def _longest(paths: FloatArray) -> float:
    return float(np.max(np.linalg.norm(np.diff(paths, axis=1), axis=2), initial=0.0))


def _paths(
    points: Sequence[WatchedPoint], first: FloatArray, last: FloatArray
) -> tuple[FloatArray, float]:
    """Return where the points pass, cut so finely that chords are the path, and the longest [m]."""
    steps = COARSE_STEPS
    while True:
        paths = _cut(points, first, last, steps)
        longest = _longest(paths)
        if not SPACING < longest < math.inf or steps >= MOST_STEPS:
            return paths, longest
        steps = min(MOST_STEPS, math.ceil(FINER * steps * longest / SPACING))


def entered(name: str, path: FloatArray, zones: Sequence[KeepOut]) -> str:
    """Return in words where a path (m, 3) [m] enters a zone; empty if nowhere.

    A point that is in a zone already may leave it, but go no deeper, not in again, into no other.
    """
    for zone in zones:
        lower, upper = np.array(zone.lower_mm) * 1e-3, np.array(zone.upper_mm) * 1e-3
        depth = np.min(np.minimum(path - lower, upper - path), axis=1)
        outside = np.flatnonzero(~(depth >= 0.0))
        # From the first point outside on, the path may not come in again.
        left = int(outside[0]) if outside.size else len(path)
        deeper = np.flatnonzero(
            depth[:left] > np.minimum.accumulate(depth)[:left] + DEPTH_TOLERANCE
        )
        if deeper.size:
            place = _words(path[deeper[0]])
            return f"the {name} would go deeper into keep-out zone {zone.name} at {place}"
        hit = first_hit(path[left:], lower, upper)
        if hit is not None:
            return f"the {name} would enter keep-out zone {zone.name} at {_words(hit)}"
    return ""


def _words(place: FloatArray) -> str:
    x, y, z = place * 1e3
    return f"({x:.0f}, {y:.0f}, {z:.0f}) mm"


def first_hit(path: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray | None:
    """Return where a polyline (m, 3) first meets a box, None if nowhere.

    By the slabs between opposite faces.

    Args:
        path: Corners of the polyline [m].
        lower: Smallest corner of the box [m].
        upper: Largest corner of the box [m].
    """
    begin, way = path[:-1], np.diff(path, axis=0)
    still = np.abs(way) < STILL
    between = (begin >= lower) & (begin <= upper)
    rate = np.where(still, 1.0, way)
    one, other = (lower - begin) / rate, (upper - begin) / rate
    enters = np.where(still, np.where(between, -np.inf, np.inf), np.minimum(one, other)).max(
        axis=1, initial=0.0
    )
    leaves = np.where(still, np.where(between, np.inf, -np.inf), np.maximum(one, other)).min(
        axis=1, initial=1.0
    )
    hits = np.flatnonzero(enters <= leaves)
    if not hits.size:
        return None
    return np.asarray(begin[hits[0]] + enters[hits[0]] * way[hits[0]])


def braking_way(
    q: Joints, qdot: Joints, acceleration: Joints, delay: float, reached: Joints | None = None
) -> Joints:
    r"""Return where each joint stands at the earliest if it is stopped now, SI.

    .. math:: q + \tfrac{1}{2} (\dot q + \dot q_d) t_d + \dot q_d |\dot q_d| / 2a

    Args:
        q: Joint positions.
        qdot: Joint velocities now.
        acceleration: With what each joint brakes.
        delay: Until it begins to brake, :math:`t_d` [s].
        reached: Joint velocities by then, :math:`\dot q_d`; as now if left out.
    """
    rows = zip(q, qdot, reached or qdot, acceleration)
    return tuple(p + 0.5 * (v + w) * delay + w * abs(w) / (2.0 * a) for p, v, w, a in rows)


def reached_speed(
    before: Joints, after: Joints, dt: float, delay: float, velocity: Joints
) -> Joints:
    """Return the joint velocities in ``delay`` [s] if each joint gains as in the last ``dt`` [s].

    What a joint loses does not count: it may stop losing it at any time.
    """

    def reached(v: float, w: float, limit: float) -> float:
        gain = (w - v) * delay / dt
        if gain * w <= 0.0:
            return w
        return math.copysign(max(abs(w), min(abs(w + gain), limit)), w)

    return tuple(map(reached, before, after, velocity))
