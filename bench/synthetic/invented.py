"""Invented cells: what they show at a time, and a journal that needs no disk; pure.

Everything follows from the cell's number and the time, so a cell that was killed and started again
tells the same events with the same numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from farm.link.event_text import describe
from farm.link.shown import told_by
from farm.wire import CellState, Event, Events, Joints
from msgspec.structs import replace
from scara_ros.journal_files_io import JournalBounds

from scara_msgs.msg import TwinControllerState

PROGRAMS = ("TWO_POINT", "PALLET", "MILK")
CYCLE_S = 12.0
"""Our choice: an invented program takes so long."""
BUSY = 0.9
"""Our choice: it is over before the next one begins, where events come quicker than that."""


@dataclass(frozen=True)
class Invented:
    """One cell that does not exist.

    Attributes:
        index: Its number; everything about it follows from that.
        begin: When its journal began [s since 1970].
        events_hz: Events of its journal in a second.
        drifts: Whether its lag grows with the age of its journal, by a third in its life of 300
            events or more.
    """

    index: int
    begin: float
    events_hz: float = 0.2
    drifts: bool = False

    @property
    def name(self) -> str:
        """Its name.

        Example:
            >>> Invented(7, 0.0).name
            'made_up_007'
        """
        return f"made_up_{self.index:03d}"

    def pair(self, now: float, stopped: str = "") -> CellState:
        """Return what its twin controller would say.

        Args:
            now: Time [s since 1970].
            stopped: The mode that a command has put it into; empty: it works.
        """
        turn = (now + 1.7 * self.index) / CYCLE_S % 10.0
        said = TwinControllerState(speed_applied_percent=100.0, deviation_mm=math.nan)
        deviation = 0.3 + 0.2 * math.sin(now + self.index)
        if stopped:
            said.mode, said.why = stopped, "by the farm"
        elif self.index % 7 == 3 and turn < 1.0:
            said.mode, said.alarm = said.FAULT, "SRVO-014 fan of the controller: clean it"
            said.speed_applied_percent, said.deviation_mm = 0.0, deviation
        elif turn < 2.0:
            said.mode, said.why = said.IDLE, "both stand still and agree"
        else:
            said.mode, said.leader = said.REAL_LEADS, "real"
            said.why, said.deviation_mm = f"{PROGRAMS[self.index % 3]} runs", deviation
        return replace(told_by(said), stamp=now)

    def joints(self, now: float) -> Joints:
        """Return both robots' joints."""
        real = {f"joint_{k}": math.sin(now + k + self.index) for k in (1, 2, 3)}
        return Joints(now, real, {name: place + 1e-3 for name, place in real.items()})

    def event(self, number: int) -> Event:
        """Return an event of its journal."""
        time = self.begin + number / self.events_hz
        body = self._body(number, time)
        body |= {"number": number, "time": time, "cell": self.name}
        kind = str(body["kind"])
        return Event(number, time, kind, *describe(kind, body), body)

    def _body(self, number: int, time: float) -> dict[str, object]:
        """Return what the journal's line of a number holds."""
        idle, paused = TwinControllerState.IDLE, TwinControllerState.PAUSED
        if number % 10 == 1:
            return {"kind": "start", "robot": "fanuc_sr6ia", "plant": "ideal", "pid": self.index}
        if number % 10 == 5:
            words = {"event": "PAUSE", "why": "PAUSE by the operator", "who": "ann"}
            modes = {"mode_before": idle, "mode_after": paused, "leader": ""}
            return {"kind": "decision", "seq": number, "actions": [], **words, **modes}
        if number % 10 == 7:
            alarm = {"source": "real", "level": "warning", "active": True, "text": "R[5] is slow"}
            return {"kind": "alarm", **alarm}
        return {
            "kind": "cycle",
            "start": time - min(CYCLE_S, BUSY / self.events_hz),
            "end": time,
            "program": PROGRAMS[self.index % 3],
            "leader": "real",
            "who": "",
            "parts_placed": 3,
            "parts_dropped": 0,
            "worst_error_mm": round(0.4 + 0.1 * math.sin(number), 3),
            "outcome": "done",
            "why": "",
            "follower_lag_s": round(self._lag(number), 4),
        }

    def _lag(self, number: int) -> float:
        """Return its lag at an event [s]; cells differ by more than one of them drifts."""
        steady = 0.084 * (1.0 + 0.05 * math.sin(7.0 * self.index)) + 5e-4 * math.sin(3.0 * number)
        return steady * (1.0 + min(number, 600) / 1800.0 * self.drifts)


@dataclass(frozen=True)
class InventedJournal:
    """The journal of an invented cell; see :class:`farm.link.journal.Journal`.

    Attributes:
        cell: Whose.
        clock: Returns the time [s since 1970].
        until: It grows no further than this number; 0: without end.
    """

    cell: Invented
    clock: Callable[[], float]
    until: int = 0

    def bounds(self) -> JournalBounds:
        """Return oldest and newest number."""
        last = max(0, int((self.clock() - self.cell.begin) * self.cell.events_hz))
        last = min(last, self.until) if self.until else last
        return JournalBounds(min(1, last), last)

    def read(self, since: int, limit: int) -> Events:
        """Return the events after a number."""
        first, last = self.bounds()
        numbers = range(since + 1, min(last, since + limit) + 1)
        return Events(first, last, tuple(map(self.cell.event, numbers)))
