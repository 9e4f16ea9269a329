"""What was asked for before a stop never begins after it.

A STOP, an ESTOP, a PAUSE and a YIELD each begin an epoch. A request belongs to the epoch in which
it came; what it waits for, a service, an older motion, may take until the next one has begun, and
then it is refused. A node that stood still finds requests and stops waiting side by side and cannot
know their order: it refuses all that it finds when it goes on.
"""

from __future__ import annotations

import math

from scara_control.motion.commands import Command, MotionRefusedError

ENDING = (Command.STOP, Command.ESTOP, Command.PAUSE, Command.YIELD)
STALL_S = 0.25
"""A node that did not run for so long has stood still; our choice, 25 periods of its loop."""
WAITING_S = 0.05
"""What has waited meanwhile comes within this time after it; our choice."""


class Epoch:
    """Counts the stops that a node has heard, and notices when the node itself stood still.

    Not thread-safe: its owner holds one lock.
    """

    def __init__(self, now: float) -> None:
        """Begin the first epoch at ``now`` [s]; every time here is that of a monotonic clock."""
        self._number = 0
        self._why = ""
        self._ran = now
        self._stall, self._stall_ended = 0.0, -math.inf

    def ran(self, now: float) -> None:
        """Note that the node runs; to be called in each of its periods."""
        if now - self._ran > STALL_S:
            self._stall, self._stall_ended = now - self._ran, now
        self._ran = now

    def hear(self, command: Command, reason: str) -> None:
        """Begin a new epoch if the command is a stop or a pause."""
        if command in ENDING:
            self._number += 1
            self._why = command.text(reason)

    def begin(self, now: float) -> int:
        """Take a request in; return the number of its epoch.

        Raises:
            MotionRefusedError: It may have waited while the node stood still.
        """
        self.ran(now)
        if now - self._stall_ended < WAITING_S:
            raise MotionRefusedError(
                f"this node stood still for {self._stall:.2f} s: what waited meanwhile is refused, "
                "send it again"
            )
        return self._number

    def check(self, number: int) -> None:
        """Judge a request that has waited for something, before it begins to move.

        Raises:
            MotionRefusedError: A stop or a pause came meanwhile.
        """
        if number != self._number:
            raise MotionRefusedError(f"cancelled by {self._why}, before it began")
