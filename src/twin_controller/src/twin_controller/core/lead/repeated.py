"""What lets a robot go on counts once its readings repeat it; what stops it counts at once.

One byte of one answer may be wrong. A pair that a person has paused or stopped does not move by it.
"""

from __future__ import annotations

import msgspec

from twin_controller.core.events import RealMeasured

READINGS = 4
"""So many in a row: a slow robot's signals belong to three of them. Our choice."""


class Repeated(msgspec.Struct, frozen=True):
    """For how many readings in a row, at most ``READINGS``."""

    # The robot's own program is off.
    off: int = READINGS
    # A program runs and is not paused.
    runs: int = 0

    @property
    def is_off(self) -> bool:
        """Whether its own program is off, by enough of them."""
        return self.off == READINGS

    @property
    def is_running(self) -> bool:
        """Whether a program runs, by enough of them."""
        return self.runs == READINGS


def count(before: Repeated, flags: RealMeasured, writes: bool) -> Repeated:
    """Take one reading in.

    Args:
        before: What was known.
        flags: The reading.
        writes: The robot can be stopped from here. Where it cannot, a program that pauses is off
            too: whoever lets it go on stands there.
    """
    off = not flags.own_program or (flags.paused and not writes)
    found = Repeated(
        min(before.off + 1, READINGS) if off else 0,
        min(before.runs + 1, READINGS) if flags.runs else 0,
    )
    return before if found == before else found
