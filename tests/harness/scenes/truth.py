"""Read the ground truth of one side: rows of time [s], positions and velocities of twin joints.

Kinematics in closed form, for the SR-6iA alone: another route than the product's.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence

Row = tuple[float, tuple[float, ...], tuple[float, ...]]
STANDING = 1e-3
"""Slower than this is standing [rad/s or m/s]."""


def standstill_since(truth: Sequence[Row], begun: float) -> float:
    """Return since when all joints have stood, at the earliest ``begun`` [s]."""
    stood = begun
    for at, _, qdot in reversed(truth):
        if at < begun:
            break
        if max(map(abs, qdot)) > STANDING:
            stood = at
            break
    return stood


def travel(truth: Sequence[Row], begun: float) -> float:
    """Return how far a joint went since ``begun`` [deg or mm], at most."""
    rows = [q for at, q, _ in truth if at >= begun]
    scales = (math.degrees(1.0), math.degrees(1.0), 1e3, math.degrees(1.0))
    spans: list[float] = [max(values) - min(values) for values in zip(*rows)]
    return max(scale * span for scale, span in zip(scales, spans))


def tool_and_elbow(q: Sequence[float]) -> list[tuple[float, float, float]]:
    """Return tool and elbow [m]; the elbow's height is robot.yaml's."""
    both = q[0] + q[1]
    x, y = 0.35 * math.cos(q[0]), 0.35 * math.sin(q[0])
    return [(x + 0.30 * math.cos(both), y + 0.30 * math.sin(both), 0.16 + q[2]), (x, y, 0.30)]


def tool_speed(q: Sequence[float], qdot: Sequence[float]) -> float:
    """Return the larger speed of tool and elbow [m/s], by the planar Jacobian."""
    both, together = q[0] + q[1], qdot[0] + qdot[1]
    vx = -0.35 * math.sin(q[0]) * qdot[0] - 0.30 * math.sin(both) * together
    vy = 0.35 * math.cos(q[0]) * qdot[0] + 0.30 * math.cos(both) * together
    return max(math.hypot(vx, vy, qdot[2]), 0.35 * abs(qdot[0]))


def farthest_apart_mm(real: Sequence[Row], twin: Sequence[Row]) -> float:
    """Return the largest distance of the two tools at the same instant, 0 without one [mm]."""
    times = [at for at, _, _ in twin]
    worst = 0.0
    for at, q, _ in real:
        k = bisect_right(times, at) - 1
        if k < 0 or k + 1 >= len(times):
            continue
        (before, a, _), (after, b, _) = twin[k : k + 2]
        part = (at - before) / (after - before)
        between = [p + part * (r - p) for p, r in zip(a, b)]
        worst = max(worst, math.dist(tool_and_elbow(q)[0], tool_and_elbow(between)[0]))
    return 1e3 * worst
