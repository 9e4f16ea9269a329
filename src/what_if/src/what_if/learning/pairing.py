"""Pair a prediction with what the joints then did; knows neither clock nor ROS."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from what_if.geometry.bodies import FloatArray
from what_if.learning.measures import NEAR, away, moving_time, way_length

BEGIN_S = 5.0
"""A motion that has not begun by then does not begin; our choice: as long as a program may wait
for its judgement."""
REST_S = 0.5
"""So much longer than at any place that was predicted joints stand before the motion counts as
ended; our choice, as long as a rest is measured elsewhere."""
UNHEARD = 0.1
"""A motion of whose way this part was not heard is not compared; our choice: twice what a time may
be off before it is an alarm."""
LATEST = 3.0
"""After so many times the predicted time plus BEGIN_S nobody waits any longer; our choice."""


class End(Enum):
    """How a motion ended."""

    REACHED = "reached"
    STOPPED = "stopped on the way"
    REPLACED = "replaced by another motion"


@dataclass(frozen=True)
class Prediction:
    """What the second world has said of a motion that was then let through.

    Attributes:
        what: The motion in words.
        start: Joint positions at the beginning, shape (n,), SI.
        target: Those at the end.
        stroke: Way of all joints, at each time of the one that goes farthest, SI.
        moving_s: As :func:`moving_time` measures it.
        way_m: Length of the tool's way.
        effort: Largest share of each joint's effort, 1 is all of it, shape (n,).
        stand_s: Longest time at one place.
    """

    what: str
    start: tuple[float, ...]
    target: tuple[float, ...]
    stroke: float
    moving_s: float
    way_m: float
    effort: tuple[float, ...]
    stand_s: float


@dataclass(frozen=True)
class Outcome:
    """A prediction beside what happened.

    Attributes:
        predicted: What was said.
        end: How it ended.
        moving_s: As measured, as are the next two.
        way_m: Likewise.
        effort: Likewise.
    """

    predicted: Prediction
    end: End
    moving_s: float
    way_m: float
    effort: tuple[float, ...]

    @property
    def ratios(self) -> dict[str, float]:
        """Measured by predicted: time, way and effort; only of what was reached and moved."""
        said = self.predicted
        if self.end is not End.REACHED or said.moving_s <= 0.0 or said.way_m <= 0.0:
            return {}
        found = {"time": self.moving_s / said.moving_s, "way": self.way_m / said.way_m}
        if said.effort and max(said.effort) > 0.0 and max(self.effort, default=0.0) > 0.0:
            found["effort"] = max(self.effort) / max(said.effort)
        return found


@dataclass
class MotionWatch:
    """What the joints do since a motion was let through; ask :meth:`end` after each position.

    Attributes:
        program: Name of the program; empty: a move.
        since: When it was let through [s].
        predicted: What was said; None while that is being worked out.
    """

    program: str
    since: float
    predicted: Prediction | None = None
    _times: list[float] = field(default_factory=list)
    _rows: list[tuple[float, ...]] = field(default_factory=list)
    _effort: list[float] = field(default_factory=list)
    _rest: tuple[float, tuple[float, ...]] | None = None
    _begun: bool = False

    def joints(self, now: float, q: Sequence[float]) -> None:
        """Take in where the joints are [rad] or [m]."""
        row = tuple(q)
        if self._times and now <= self._times[-1]:
            return
        self._times.append(now)
        self._rows.append(row)
        self._begun = self._begun or _apart(row, self._rows[0])
        if self._rest is None or _apart(row, self._rest[1]):
            self._rest = (now, row)

    def effort(self, shares: Sequence[float]) -> None:
        """Take in what share of its effort each joint needs, by amount."""
        if not self._effort:
            self._effort = [0.0] * len(shares)
        self._effort = [max(a, abs(b)) for a, b in zip(self._effort, shares)]

    def end(self, now: float) -> End | None:
        """Return how the motion has ended; None while it goes on, or has not begun."""
        if self._rest is None or not self._begun or self.predicted is None or self.is_unheard:
            return None
        since, place = self._rest
        if now - since <= self.predicted.stand_s + REST_S:
            return None
        return End.STOPPED if _apart(place, self.predicted.target) else End.REACHED

    def is_hopeless(self, now: float) -> bool:
        """Return whether nothing can be learnt of the motion.

        Its beginning was not heard, or it does not begin or end any more in reasonable time.
        """
        if self.is_unheard:
            return True
        waited = now - self.since
        if not self._begun or self.predicted is None:
            return waited > BEGIN_S
        return waited > BEGIN_S + LATEST * (self.predicted.moving_s + self.predicted.stand_s)

    @property
    def is_unheard(self) -> bool:
        """Whether the joints were well on their way before their first position came.

        Then way and time would be measured too short.
        """
        said = self.predicted
        if said is None or not self._rows:
            return False
        gone = max(abs(a - b) for a, b in zip(self._rows[0], said.start))
        return gone > max(UNHEARD * said.stroke, NEAR)

    def is_same(self, program: str) -> bool:
        """Return whether a program that is judged now is the one that is watched already.

        A program that the page starts is judged a second time when the robot says that it runs.
        """
        return bool(program) and program == self.program

    def outcome(self, end: End, points: FloatArray) -> Outcome:
        """Return prediction and measurement.

        Args:
            end: How it ended.
            points: The tool's, of :attr:`rows` [m], shape (m, 3).
        """
        assert self.predicted is not None
        times, rows = np.array(self._times), self.rows
        target = np.array(self.predicted.target) if end is End.REACHED else rows[-1]
        return Outcome(
            self.predicted,
            end,
            moving_time(times, rows, target),
            way_length(points),
            tuple(self._effort),
        )

    @property
    def rows(self) -> FloatArray:
        """All positions that were taken in, shape (m, n)."""
        return np.array(self._rows)

    @property
    def has_begun(self) -> bool:
        """Whether the joints have left their place."""
        return self._begun


def _apart(one: Sequence[float], other: Sequence[float]) -> bool:
    return bool(away(np.array([one]), np.array(other))[0])
