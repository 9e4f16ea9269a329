"""The desk's alarms: read again from history and marks at the start, marked by people later."""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TypeVar

import msgspec

from farm.desk.alarms import LINK, AlarmBook, AlarmRow, Mark, MarkError, SeenAlarm
from farm.desk.history_io import Kept
from farm.keys import CellName
from farm.wire import Answer, Event, WireError, decode

MARKS = "alarm_marks.jsonl"
"""File of the marks, in the desk's data: one JSON object a line, appended to only."""
LINKS = "alarm_links.jsonl"
"""File beside it, of the same form: which cells were lost and came back, as no journal can tell."""
KINDS = ("alarm", "start")
"""Events of a journal that say something of alarms."""
ACKNOWLEDGE, SHELVE = "acknowledge", "shelve"

T = TypeVar("T")


class MarksAsked(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a person asks to do to an alarm, or to equal alarms of several cells.

    Attributes:
        word: acknowledge or shelve.
        alarms: As the person saw them.
        seconds: Of shelving: for how long; 0: take it off the shelf.
        why: Of shelving.
    """

    word: str
    alarms: list[SeenAlarm]
    seconds: float = 0.0
    why: str = ""


class LinkChange(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A cell was lost, or came back.

    Attributes:
        cell: MACHINE/CELL.
        lost: Which of both.
        time: When [s since 1970].
    """

    cell: str
    lost: bool
    time: float


class AlarmDesk:
    """Holds all alarms; safe to use from several threads."""

    def __init__(self, file: Path, history: Iterable[Kept]) -> None:
        """Read what was.

        Args:
            file: Of the marks; made with the first one. Lost cells are kept beside it.
            history: The events of the history that say something of alarms, in their order.

        Raises:
            OSError: The file cannot be read.
        """
        self._file, self._links, self._lock = file, file.with_name(LINKS), threading.Lock()
        # A disk that hangs holds up who marks, one after another, and nobody who asks or tells.
        self._marking = threading.Lock()
        self._book = AlarmBook()
        # The newest of each cell that is on the disk.
        self._changes: dict[str, LinkChange] = {}
        for kept in history:
            self._book.told(str(kept.cell), kept.event)
        for change in _lines(self._links, LinkChange):
            (self._book.lost if change.lost else self._book.found)(change.cell, change.time)
            self._changes[change.cell] = change
        for mark in _lines(file, Mark):
            self._book.read(mark)

    def told(self, cell: CellName, event: Event) -> None:
        """Take in an event."""
        with self._lock:
            self._book.told(str(cell), event)

    def there(self, lost: Mapping[str, float], now: float) -> None:
        """Take in which cells are lost, and since when; all others are there.

        One thread alone calls this: it waits for the disk.
        """
        with self._lock:
            for cell, since in lost.items():
                self._book.lost(cell, since)
            # A cell of which no alarm is known has none to clear.
            for cell in {known.cell for known in self._book.known.values()} - set(lost):
                self._book.found(cell, now)
            links = [known for known in self._book.known.values() if known.source == LINK]
            changes = [
                LinkChange(known.cell, not known.cleared, known.cleared or known.raised)
                for known in links
            ]
        for change in changes:
            if change != self._changes.get(change.cell):
                # A disk that takes nothing is tried again at the next look.
                with contextlib.suppress(OSError):
                    _append(self._links, change)
                    self._changes[change.cell] = change

    def rows(self) -> list[AlarmRow]:
        """Return what asks for somebody, the most urgent first."""
        with self._lock:
            return self._book.rows(time.time())

    def _mark(self, asked: MarksAsked, seen: SeenAlarm, person: str) -> Answer:
        """Acknowledge or shelve one alarm; it is on the disk before it counts."""
        name, now = seen.id, time.time()
        with self._marking:
            try:
                with self._lock:
                    self._book.check_seen(seen, shelves=asked.word == SHELVE)
                    if asked.word == ACKNOWLEDGE:
                        mark = self._book.acknowledge(name, person, now)
                    elif asked.word == SHELVE:
                        mark = self._book.shelve(name, person, now, asked.seconds, asked.why)
                    else:
                        words = f"{ACKNOWLEDGE} and {SHELVE}"
                        return Answer(False, f"{asked.word}: allowed are {words}")
                _append(self._file, mark)
            except MarkError as error:
                return Answer(False, str(error))
            except OSError as error:
                return Answer(False, f"{self._file}: {error.strerror}: nothing was changed")
            with self._lock:
                self._book.read(mark)
        return Answer(True, f"{name}: {_said(mark)}")

    def mark(self, asked: MarksAsked, person: str) -> Answer:
        """Acknowledge or shelve; refusals do not hold up the others.

        Args:
            asked: What to do.
            person: Who asks, as PERSON@DESK.
        """
        answers = [self._mark(asked, seen, person) for seen in asked.alarms]
        refused = [answer.text for answer in answers if not answer.accepted]
        if refused or not answers:
            return Answer(False, "; ".join(refused) or f"{asked.word}: no alarm was named")
        equal = f", and {len(answers) - 1} more" if len(answers) > 1 else ""
        return Answer(True, answers[0].text + equal)


def _lines(file: Path, kind: type[T]) -> Iterator[T]:
    """Yield what was kept; a line that a crash has torn is left out: the alarm asks again."""
    for line in file.read_bytes().splitlines() if file.exists() else ():
        try:
            kept = decode(line, kind)
        except WireError:
            continue
        yield kept


def _append(file: Path, kept: Mark | LinkChange) -> None:
    """Write a line; it is on the disk then.

    Raises:
        OSError: It is not.
    """
    with file.open("ab+") as stream:
        # A line that a crash has torn stays a line of its own.
        if stream.tell():
            stream.seek(-1, os.SEEK_END)
            if stream.read() != b"\n":
                stream.write(b"\n")
        stream.write(msgspec.json.encode(kept) + b"\n")
        stream.flush()
        os.fsync(stream.fileno())


def _said(mark: Mark) -> str:
    if mark.acknowledges:
        return f"acknowledged by {mark.person}"
    if not mark.until:
        return f"taken off the shelf by {mark.person}"
    until = time.strftime("%Y-%m-%d %H:%M", time.localtime(mark.until))
    return f"shelved by {mark.person} until {until}"
