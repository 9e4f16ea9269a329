"""One piece of a motion: a move, a pause, or a switch of the suction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from what_if.geometry.bodies import FloatArray
from what_if.geometry.way import Way
from what_if.verdict import Reason


@dataclass(frozen=True)
class Course:
    """The motion of the joints at chosen times.

    Attributes:
        times: From the beginning of the leg [s], shape (m,).
        q: Joint positions, shape (m, n), SI.
        qdot: Velocities, shape (m, n).
        qddot: Accelerations, shape (m, n).
        u: Place on the leg's way, shape (m,).
    """

    times: FloatArray
    q: FloatArray
    qdot: FloatArray
    qddot: FloatArray
    u: FloatArray


@dataclass(frozen=True)
class Leg:
    """A piece of a motion.

    Attributes:
        begin: From the beginning of the motion [s].
        duration: Until the next one may begin [s].
        step: In words, for example ``line 3``.
        way: Where the joints go; None: they stand.
        course: When they are where; None: they stand.
        grip: The suction is switched on or off at the end; None: it stays.
        spread: Standard deviation of the duration [s].
        number: Of the program's step that it belongs to; -1: it is no program's.
    """

    begin: float
    duration: float
    step: str
    way: Way | None = None
    course: Course | None = None
    grip: bool | None = None
    spread: float = 0.0
    number: int = -1

    def time_at(self, u: float) -> float:
        """Return when a place of the way is passed, from the beginning of the motion [s]."""
        if self.course is None:
            return self.begin
        return self.begin + float(np.interp(u, self.course.u, self.course.times))


@dataclass(frozen=True)
class Planned:
    """A motion in time, and what stands against it before anybody looks at bodies."""

    legs: tuple[Leg, ...]
    reasons: tuple[Reason, ...] = ()


def curved(course: Course, begin: float, step: str, after: float, spread: float = 0.0) -> Leg:
    r"""Return a leg whose way is no straight line, but nearly one between two samples.

    A joint with the acceleration a strays from a straight piece that lasts h by at most
    :math:`a h^2 / 8`.

    Args:
        course: Of the joints.
        begin: From the beginning of the motion [s].
        step: In words.
        after: What its end is waited for [s].
        spread: Standard deviation of that [s].
    """
    h = float(np.max(np.diff(course.times)))
    slack = np.max(np.abs(course.qddot), axis=0) * h * h / 8.0
    way = Way(course.q, slack.tolist())
    return Leg(begin, float(course.times[-1]) + after, step, way, course, spread=spread)
