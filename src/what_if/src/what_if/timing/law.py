"""The time law of the robot's own moves, in closed form: the planner's, at an override."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from fanuc_emulator.drives.interpolator import Trapezoid

from what_if.geometry.bodies import FloatArray
from what_if.geometry.way import straight
from what_if.timing.leg import Course, Leg

NO_TIME = 1e-9
"""[s]: shorter pieces of a trapezoid are rounding."""


class Law:
    r"""When a move is where on its path.

    The place :math:`s \in [0, 1]` has the largest rate :math:`r` and changes it by :math:`c`. Ramps
    take :math:`r / c`; a move too short for both has the top rate :math:`\sqrt c`.

    Args:
        move: As the robot plans it.
        override: Fraction 0..1 of its programmed speed.

    Attributes:
        duration: Of the plan [s].
        ramp: Of its beginning, and of its end [s].
    """

    def __init__(self, move: Trapezoid, override: float) -> None:
        rate, change = move.law
        self.duration = self.ramp = self._top = self._change = 0.0
        if not move.done:
            self._change = change
            self._top = min(rate * override, math.sqrt(self._change))
            self.ramp = self._top / self._change
            self.duration = 1.0 / self._top + self.ramp

    def times(self, sample: float) -> FloatArray:
        """Return the corners and times between them no further apart than ``sample`` [s]."""
        return _times((0.0, self.ramp, self.duration - self.ramp, self.duration), sample)

    def at(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return place, rate and change of rate at times from the beginning [s]; at rest behind."""
        times = np.minimum(times, self.duration)
        brakes = self.duration - self.ramp
        up, down = np.minimum(times, self.ramp), np.maximum(times - brakes, 0.0)
        change, top = self._change, self._top
        s = 0.5 * change * up**2 + top * np.maximum(times - self.ramp, 0.0) - 0.5 * change * down**2
        speed = np.maximum(change * up - change * down, 0.0)
        # At a corner of the trapezoid the joints have the ramp's acceleration just before or after.
        bend = np.where(times <= self.ramp, change, np.where(times >= brakes, -change, 0.0))
        # Rounding leaves the sum a little beside 1 at the end.
        s[times >= self.duration] = 1.0
        return np.minimum(s, 1.0), speed, bend


def straight_course(start: Sequence[float], move: Trapezoid, law: Law, sample: float) -> Course:
    """Return a joint move with nothing beside it.

    Args:
        start: Joint positions at its start, shape (n,), SI.
        move: The move.
        law: Its own.
        sample: Distance of the chosen times [s].
    """
    a, way = np.array(start, dtype=float), np.subtract(move.end, start)
    times = law.times(sample)
    s, speed, bend = law.at(times)
    if law.duration == 0.0:
        still = np.zeros((1, len(a)))
        return Course(times, a[None], still, still, np.zeros(1))
    return Course(times, a + s[:, None] * way, speed[:, None] * way, bend[:, None] * way, s)


def _times(corners: Sequence[float], sample: float) -> FloatArray:
    """Return the corners and, between two of them, times no further apart than ``sample`` [s]."""
    found = [0.0]
    for begin, end in pairwise(corners):
        if end - begin > NO_TIME:
            count = math.ceil((end - begin) / sample)
            found += np.linspace(begin, end, count + 1)[1:].tolist()
    return np.array(found)


def move_leg(course: Course, begin: float, step: str, after: float, spread: float) -> Leg:
    """Return a straight move as a leg; the arguments are those of :func:`curved`."""
    if len(course.times) < 2:
        # Who stands at the target already has arrived.
        return Leg(begin, 0.0, step, None, course)
    way = straight(course.q[0], course.q[-1])
    return Leg(begin, float(course.times[-1]) + after, step, way, course, spread=spread)
