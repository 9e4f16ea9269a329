"""What the real robot's own motion means for zones and people, in every mode: its pendant can start it at any time."""

from __future__ import annotations

import math

import msgspec

REPEAT_S = 0.5
"""A robot that goes on moving in spite of a safety stop is stopped again after this time [s]."""


class Guard(msgspec.Struct, frozen=True):
    """The real robot's motion now.

    Attributes:
        moves: A program drives it, or it is faster than standstill.
        violation: The zone that it cannot stop before, in words; empty if there is none.
        fast_since: Since when a watched point is faster than the Cartesian limit allows [s], None if none is.
        too_fast: Point, speed and limit in words once that has lasted; empty if it has not.
        stopped_at: When a safety stop was sent to it that it has not come to rest after [s].
    """

    moves: bool = False
    violation: str = ""
    fast_since: float | None = None
    too_fast: str = ""
    stopped_at: float = -math.inf

    def due(self, now: float) -> bool:
        """Return whether the robot moves and a safety stop is not on its way already."""
        return self.moves and now - self.stopped_at >= REPEAT_S
