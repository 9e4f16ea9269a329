"""Cycles: from the first motion of the pair to rest, or to what ended it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from scara_ros.names import current_line

from cell_recorder.journal.entries import (
    DONE,
    ESTOP,
    FAULT,
    LINK_LOST,
    STOPPED,
    TAKEN_OVER,
    UNFINISHED,
    Cycle,
)
from scara_msgs.msg import PartEvent, TwinControllerState

REAL, TWIN = "real", "twin"
LEADS = (
    TwinControllerState.REAL_LEADS,
    TwinControllerState.TWIN_LEADS,
    TwinControllerState.OPERATOR_LEADS,
)
ENDS = {
    TwinControllerState.STOPPED: STOPPED,
    TwinControllerState.STANDSTILL: STOPPED,
    TwinControllerState.ESTOP: ESTOP,
    TwinControllerState.FAULT: FAULT,
    TwinControllerState.OFFLINE: LINK_LOST,
    # The robot is stopped and the pair aligned anew: what was begun is not gone on with.
    TwinControllerState.ALIGNING: STOPPED,
}


@dataclass
class _Open:
    """A cycle that has begun."""

    start: float
    leader: str
    who: str
    program: str = ""
    running: bool = False
    worst: float = -math.inf
    lag: float = math.nan
    # Since when the pair is at rest, while it is; and since when it is paused.
    rests: float | None = None
    paused: float | None = None
    paused_s: float = 0.0
    placed: dict[str, int] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)


class Cycles:
    """Makes cycles of decisions, states and parts. Times are Unix time [s]; not thread-safe.

    Motions with pauses shorter than ``rest_s`` between them are one cycle. While the robot's own
    program runs the cycle goes on, however long it waits; each run is a cycle of its own. What runs
    on the robot while another side leads is its stream program, and no run.
    """

    def __init__(self, rest_s: float) -> None:
        """Know of none."""
        self._rest_s = rest_s
        self._open: _Open | None = None
        # Set once the real side tells of parts: then its counts are those of a cycle, not the
        # twin's.
        self._real_tells = False

    @property
    def is_open(self) -> bool:
        """Whether a cycle has begun and not ended: then states and programs are of use."""
        return self._open is not None

    def decided(
        self, now: float, mode: str, leader: str, why: str = "", who: str = ""
    ) -> list[Cycle]:
        """Take a decision, or a first state.

        Args:
            now: When.
            mode: After it.
            leader: real, twin or operator; empty: nobody leads.
            why: In words.
            who: Who is behind it.
        """
        if mode in LEADS:
            # Begin a cycle or go on with one
            cycle, ended = self._open, []
            if cycle is not None and cycle.leader != leader:
                if cycle.rests is None:
                    ended = [self._end(now, TAKEN_OVER, f"{leader} leads")]
                else:
                    ended = [self._end(cycle.rests, DONE)]
            if self._open is None:
                self._open = _Open(now, leader, who)
            self._goes_on(now)
            self._open.rests = None
            return ended
        cycle = self._open
        if cycle is None:
            return []
        halts = mode == TwinControllerState.PAUSED or mode in ENDS
        if halts and cycle.rests is not None and not cycle.running:
            # It was done before, and only waited for more to come.
            return [self._end(cycle.rests, DONE)]
        if mode == TwinControllerState.PAUSED:
            cycle.paused = cycle.paused or now
            cycle.rests = None
            return []
        self._goes_on(now)
        if mode in ENDS:
            return [self._end(now, ENDS[mode], why)]
        if cycle.rests is None:
            cycle.rests = now
        return []

    def measured(self, deviation_mm: float, lag_s: float = math.nan) -> None:
        """Take how far both tools are apart [mm] and how late the real robot is [s].

        NaN: not known.
        """
        if self._open is None or self._open.rests is not None:
            return
        if math.isfinite(deviation_mm):
            self._open.worst = max(self._open.worst, deviation_mm)
        if math.isfinite(lag_s):
            self._open.lag = lag_s

    def program(self, now: float, said: str, running: bool) -> list[Cycle]:
        """Take what the real robot says of its program; a new run begins a new cycle.

        Args:
            now: When.
            said: Name, line and state, as scara_msgs/RobotData says them. They are read behind
                ``running`` and may still be those of the run before, which has ended.
            running: Whether a program runs that is the robot's own.
        """
        cycle = self._open
        if cycle is None or cycle.leader != REAL:
            return []
        name, _ = current_line(said)
        # A paused program has not ended: it goes on, as the same run.
        running = running or bool(name)
        if running == cycle.running:
            cycle.program = cycle.program or name
            return []
        ended = []
        if running and cycle.program:
            ended = [self._end(now if cycle.rests is None else cycle.rests, DONE)]
            cycle = self._open = _Open(now, cycle.leader, cycle.who, rests=cycle.rests and now)
        cycle.running = running
        if running:
            cycle.program = name
        elif cycle.rests is not None:
            cycle.rests = now
        return ended

    def part(self, side: str, kind: str) -> None:
        """Take what became of a part, on the side ``real`` or ``twin``."""
        self._real_tells = self._real_tells or side == REAL
        if self._open is None:
            return
        if kind == PartEvent.PLACED:
            self._open.placed[side] = self._open.placed.get(side, 0) + 1
        elif kind == PartEvent.DROPPED:
            self._open.dropped[side] = self._open.dropped.get(side, 0) + 1

    def look(self, now: float) -> list[Cycle]:
        """Return the cycle that has ended by rest; ask once a second."""
        cycle = self._open
        if cycle is None or cycle.rests is None or cycle.running:
            return []
        # A clock that was set back ends it too.
        if 0.0 <= now - cycle.rests < self._rest_s:
            return []
        return [self._end(cycle.rests, DONE)]

    def close(self, now: float) -> list[Cycle]:
        """Return the cycle that the journal does not see the end of."""
        if self._open is None:
            return []
        rests = self._open.rests
        return [self._end(now if rests is None else rests, UNFINISHED, "the journal was ended")]

    def _goes_on(self, now: float) -> None:
        """Count a pause that ends."""
        cycle = self._open
        if cycle is not None and cycle.paused is not None:
            cycle.paused_s += max(0.0, now - cycle.paused)
            cycle.paused = None

    def _end(self, end: float, outcome: str, why: str = "") -> Cycle:
        """Close the cycle and return its entry."""
        cycle = self._open
        assert cycle is not None
        self._goes_on(end)
        self._open = None
        side = REAL if self._real_tells else TWIN
        return Cycle(
            start=cycle.start,
            end=max(cycle.start, end),
            program=cycle.program,
            leader=cycle.leader,
            who=cycle.who,
            parts_placed=cycle.placed.get(side, 0),
            parts_dropped=cycle.dropped.get(side, 0),
            worst_error_mm=round(cycle.worst, 4) if math.isfinite(cycle.worst) else None,
            paused_s=round(cycle.paused_s, 3),
            outcome=outcome,
            why=why,
            follower_lag_s=round(cycle.lag, 4) if math.isfinite(cycle.lag) else None,
        )
