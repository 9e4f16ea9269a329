"""Which cycles of a running cell are taken, and from when to when its joints are listened to."""

from __future__ import annotations

from dataclasses import dataclass

from cell_recorder.journal.cycles import Cycles
from cell_recorder.journal.entries import DONE, Cycle
from scara_ros.names import current_line

from scara_msgs.msg import TwinControllerState

LONGEST_S = 120.0
"""Of a longer cycle so much is taken: a program may run all day. Our choice."""
REST_S = 3.0
"""A pair that rests for so long has ended its cycle, as in journal.yaml."""


@dataclass(frozen=True)
class HeardCycle:
    """A cycle, or the part of one, that was listened to.

    Attributes:
        leader: real, twin or operator.
        program: Of the real robot; empty: none ran.
    """

    leader: str
    program: str


class Taking:
    """Says when to listen, and what was heard. Times are Unix time [s]; not thread-safe."""

    def __init__(self, every_s: float) -> None:
        """Take no cycle that begins sooner than ``every_s`` after the one before."""
        self._every_s, self._due = every_s, 0.0
        self._cycles = Cycles(REST_S)
        self._leader = self._program = ""
        # Since when it is listened to; and whether this cycle was paused, so that it is no longer
        # as the others are.
        self._since: float | None = None
        self._paused = False

    def listens(self, now: float) -> bool:
        """Return whether the joints are of use now, and begin to listen if they are."""
        if not self._cycles.is_open:
            self._since, self._paused = None, False
        elif self._paused:
            self._since = None
        elif self._since is None and not 0.0 < self._due - now <= self._every_s:
            # A clock that was set back far must not end it for ever.
            self._since = now
        return self._since is not None

    def decided(self, now: float, mode: str, leader: str) -> HeardCycle | None:
        """Take a decision, as :meth:`Cycles.decided` does; return the cycle that it has ended."""
        self._paused = self._paused or mode == TwinControllerState.PAUSED
        taken = self._ended(self._cycles.decided(now, mode, leader))
        self._leader = leader
        return taken

    def program(self, now: float, said: str, running: bool) -> HeardCycle | None:
        """Take the robot's program, as :meth:`Cycles.program`; return the run that has ended."""
        taken = self._ended(self._cycles.program(now, said, running))
        self._program = current_line(said)[0]
        return taken

    def look(self, now: float) -> HeardCycle | None:
        """Return what has ended by rest, or has become long enough; ask once a second."""
        taken = self._ended(self._cycles.look(now))
        if taken is None and self._since is not None and now - self._since >= LONGEST_S:
            return self._take(self._leader, self._program)
        return taken

    def _ended(self, cycles: list[Cycle]) -> HeardCycle | None:
        """Return the cycle that ended, if all of it was heard and it came to its end."""
        if not cycles or self._since is None:
            return None
        cycle = cycles[-1]
        if cycle.outcome == DONE and not self._paused:
            return self._take(cycle.leader, cycle.program)
        self._since = None
        return None

    def _take(self, leader: str, program: str) -> HeardCycle:
        assert self._since is not None
        # From its begin on: the length of a cycle does not make them rarer.
        self._due, self._since = self._since + self._every_s, None
        return HeardCycle(leader, program)
