"""What has happened: alarms, decisions and ended commands, with severity and who has seen it; pure.

The newest events are kept in memory; the whole history is in the recordings and the audit.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable

import msgspec
from scara_ros.page import page_words

from operator_panel.view.alarms import Alarm
from operator_panel.view.progress import Command, Fate
from operator_panel.view.snapshot import DecisionLine
from scara_msgs.msg import TwinControllerState as Mode

KEPT = 500
SHOWN = 200
INFO, WARNING, FAULT = "info", "warning", "fault"
COLUMNS = ("number", "time", "severity", "source", "text", "acknowledged_by", "acknowledged_at")
_FAULTS = (Mode.ESTOP, Mode.FAULT, Mode.OFFLINE)
_WARNINGS = (Mode.STOPPED, Mode.STANDSTILL, Mode.PAUSED)
_SEVERITIES = {Fate.DONE: INFO, Fate.LOST: FAULT}
FORMULA = ("=", "+", "-", "@")  # a spreadsheet would calculate a text that begins so


class Event(msgspec.Struct, frozen=True):
    """One event.

    Attributes:
        number: Counts up.
        time: Date and time of day, ISO 8601 without a zone: the clock of this machine.
        severity: info, warning or fault.
        source: Who says it.
        text: In words.
        by: Who has acknowledged it; empty: nobody yet.
        at: When, as ``time``.
    """

    number: int
    time: str
    severity: str
    source: str
    text: str
    by: str = ""
    at: str = ""

    @property
    def open(self) -> bool:
        """Whether somebody still has to look at it."""
        return self.severity != INFO and not self.by


class EventLog:
    """Keeps the newest events. Not thread-safe: it lives in the page's event loop."""

    def __init__(self) -> None:
        """Start empty."""
        self.version = 0
        self._events: list[Event] = []
        self._count = 0
        self._alarms: dict[tuple[str, str], Alarm] = {}
        self._decided: DecisionLine | None = None

    def note(self, time: str, severity: str, source: str, text: str) -> None:
        """Add an event."""
        self._count += 1
        self._events.append(Event(self._count, time, severity, source, text))
        del self._events[:-KEPT]
        self.version += 1

    def alarms(self, now: Iterable[Alarm], time: str) -> None:
        """Note the alarms that have come or gone since the last call."""
        # Without its numbers: an alarm that counts is one alarm.
        active = {(alarm.source, re.sub(r"[\d.]+", "#", alarm.text)): alarm for alarm in now}
        for key, alarm in active.items():
            if key not in self._alarms:
                severity = WARNING if alarm.level == "warn" else FAULT
                self.note(time, severity, alarm.source, page_words.people(alarm.text))
        for key, alarm in self._alarms.items():
            if key not in active:
                self.note(time, INFO, alarm.source, f"Over: {page_words.people(alarm.text)}")
        self._alarms = active

    def decisions(self, newest_first: tuple[DecisionLine, ...]) -> None:
        """Note the decisions that are newer than the last one noted."""
        fresh: list[DecisionLine] = []
        for line in newest_first:
            # By identity and not by value: the same decision may be made twice within a second.
            if line is self._decided:
                break
            fresh.append(line)
        for line in reversed(fresh):
            change = page_words.mode_change(line.mode_before, line.mode_after)
            severity = FAULT if line.mode_after in _FAULTS else INFO
            if line.mode_after in _WARNINGS:
                severity = WARNING
            text = f"{change}: {page_words.people(line.why)}"
            self.note(line.time, severity, "twin controller", text)
        if newest_first:
            self._decided = newest_first[0]

    def ended(self, commands: Iterable[Command], time: str) -> None:
        """Note how commands have ended."""
        for command in commands:
            severity = _SEVERITIES.get(command.outcome, WARNING)
            text = f"{command.title}: {command.outcome}. {page_words.people(command.text)}"
            self.note(time, severity, command.who, text)

    def acknowledge(self, number: int, by: str, time: str) -> None:
        """Note that somebody has seen an event, or all of them (number 0)."""
        for index, event in enumerate(self._events):
            if event.open and number in (0, event.number):
                self._events[index] = msgspec.structs.replace(event, by=by, at=time)
                self.version += 1

    def since(self, number: int) -> list[Event]:
        """Return the kept events with a greater number, oldest first."""
        return [event for event in self._events if event.number > number]

    @property
    def shown(self) -> list[Event]:
        """The newest events, newest first."""
        return self._events[: -SHOWN - 1 : -1]

    @property
    def waiting(self) -> int:
        """How many nobody has acknowledged."""
        return sum(event.open for event in self._events)

    def csv(self) -> str:
        """Return all kept events as comma-separated values, oldest first, with a heading."""
        lines = _Lines()
        writer = csv.writer(lines)
        writer.writerow(COLUMNS)
        for event in self._events:
            values = (event.time, event.severity, event.source, event.text, event.by, event.at)
            writer.writerow((event.number, *map(_cell, values)))
        return "".join(lines)


class _Lines(list[str]):
    """What a csv.writer writes to, without a file."""

    write = list.append


def _cell(text: str) -> str:
    """Return a text that no spreadsheet takes for a formula."""
    return f"'{text}" if text.startswith(FORMULA) else text
