"""The time law of the robot's own joint moves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from what_if.geometry.bodies import FloatArray
from what_if.geometry.way import straight
from what_if.timing.leg import Course, Leg

NO_TIME = 1e-9
"""[s]: shorter pieces of a trapezoid are rounding."""


def trapezoid(
    start: Sequence[float],
    end: Sequence[float],
    velocity: Sequence[float],
    acceleration: Sequence[float],
    sample: float,
) -> Course:
    r"""Return a joint move with a trapezoid of speed, all joints together.

    With the distances :math:`D_i` the place :math:`s \in [0, 1]` has the largest rate
    :math:`r = \min_i v_i / D_i` and changes it by :math:`c = \min_i a_i / D_i`. Ramps take
    :math:`r / c`; a move too short for both has the top rate :math:`\sqrt c`.

    Args:
        start: Joint positions, shape (n,), SI.
        end: Likewise.
        velocity: Largest joint speeds in this move, shape (n,).
        acceleration: Largest accelerations, shape (n,).
        sample: Distance of the chosen times [s].
    """
    a, b = np.array(start, dtype=float), np.array(end, dtype=float)
    way = b - a
    moving = [k for k in range(len(way)) if way[k] != 0.0]
    if not moving:
        still = np.zeros((1, len(a)))
        return Course(np.zeros(1), a[None], still, still, np.zeros(1))
    rate = min(velocity[k] / abs(way[k]) for k in moving)
    change = min(acceleration[k] / abs(way[k]) for k in moving)
    top = min(rate, math.sqrt(change))
    ramp = top / change
    duration = 1.0 / top + ramp
    times = _times((0.0, ramp, duration - ramp, duration), sample)
    up, down = np.minimum(times, ramp), np.maximum(times - (duration - ramp), 0.0)
    s = 0.5 * change * up**2 + top * np.maximum(times - ramp, 0.0) - 0.5 * change * down**2
    speed = np.maximum(change * up - change * down, 0.0)
    # At a corner of the trapezoid the joints have the ramp's acceleration just before or after.
    bend = np.where(times <= ramp, change, np.where(times >= duration - ramp, -change, 0.0))
    s[-1] = 1.0
    return Course(
        times, a + s[:, None] * way, speed[:, None] * way, bend[:, None] * way, np.clip(s, 0.0, 1.0)
    )


def _times(corners: Sequence[float], sample: float) -> FloatArray:
    """Return the corners and, between two of them, times no further apart than ``sample`` [s]."""
    found = [0.0]
    for begin, end in pairwise(corners):
        if end - begin > NO_TIME:
            count = math.ceil((end - begin) / sample)
            found += np.linspace(begin, end, count + 1)[1:].tolist()
    return np.array(found)


def move_leg(course: Course, begin: float, step: str, after: float) -> Leg:
    """Return a straight move as a leg; ``after`` is what the end of the plan is waited for [s]."""
    if len(course.times) < 2:
        # Who stands at the target already has arrived.
        return Leg(begin, 0.0, step, None, course)
    way = straight(course.q[0], course.q[-1])
    return Leg(begin, float(course.times[-1]) + after, step, way, course, waits=after > 0.0)
