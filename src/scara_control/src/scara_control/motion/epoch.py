"""What was asked for before a stop never begins after it.

A STOP, an ESTOP, a PAUSE and a YIELD each begin an epoch. A request carries when it was asked for,
a stop when it was given; the stop that is newer refuses the request, whichever of both is read
first. A request without that time is taken for as old as it may be: it is as old as its arrival, or
as the beginning of a gap in which this node may have stood still right before. What waits in the
node for something, a service or an older motion, is refused by each stop that is heard meanwhile.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from scara_ros.standstill import Standstill, said

from scara_control.motion.commands import Command, MotionRefusedError

ENDING = (Command.STOP, Command.ESTOP, Command.PAUSE, Command.YIELD)


class CancelledError(MotionRefusedError):
    """A request is older than a stop, or may be."""


class AskedAt(NamedTuple):
    """A request that was taken in.

    Attributes:
        at: When it was asked for, or the earliest time at which that may have been [s]; this goes
            on with what the request asks of other nodes.
        number: Of the stops that were heard before it.
    """

    at: float
    number: int


class Epoch:
    """Knows the stops that a node has heard, and when the node itself may have stood still.

    Not thread-safe: its owner holds one lock. Every time is that of the monotonic clock [s].
    """

    def __init__(self, now: float) -> None:
        """Begin the first epoch at ``now``."""
        self._standstill = Standstill(now)
        self._number, self._why = 0, ""
        # When the newest stop was given; and the newest but for YIELD, which ends no stream.
        self._ended = self._stopped = -math.inf

    def ran(self, now: float) -> float:
        """Note that the node runs; return the gap before, in which it may have stood still [s]."""
        return self._standstill.seen(now)

    def found_by(self, now: float) -> float:
        """Return until when what waited while the node stood still may be found [s]."""
        return self._standstill.found_by(now)

    def blocked(self, begin: float, now: float) -> None:
        """Note that a reader was busy since ``begin``: its next request may be as old as that."""
        self._standstill.blocked(begin, now)

    def hear(self, command: Command, reason: str, asked: float, now: float) -> bool:
        """Take a motion command in; return whether it is to be obeyed.

        A stop always is. A release is not when it is older than the newest stop.

        Args:
            command: Which.
            reason: Why, for people.
            asked: When it was given; 0: not said, so now.
            now: When it is read.
        """
        self.ran(now)
        given = asked if said(asked, now) else now
        if command in ENDING:
            self._number += 1
            # Stops may be read out of order: time and reason stay those of the newest.
            if given >= self._ended:
                self._ended, self._why = given, command.text(reason)
            if command is not Command.YIELD:
                self._stopped = max(self._stopped, given)
            return True
        return given >= self._ended

    def begin(self, asked: float, now: float, *, stream: bool = False) -> AskedAt:
        """Take a request in.

        Args:
            asked: When it was asked for; 0: not said.
            now: When it is read.
            stream: It begins a stream, for which YIELD makes room.

        Raises:
            CancelledError: A stop was given after it was asked for, or may have been.
        """
        self.ran(now)
        at = asked if said(asked, now) else self._standstill.earliest(now)
        if at < (self._stopped if stream else self._ended):
            raise CancelledError(f"cancelled by {self._why}, before it began")
        return AskedAt(at, self._number)

    def check(self, request: AskedAt) -> None:
        """Judge a request that has waited for something, before it begins to move.

        Raises:
            CancelledError: A stop or a pause was heard meanwhile.
        """
        if request.number != self._number:
            raise CancelledError(f"cancelled by {self._why}, before it began")
