"""What the link needs of a cell's journal, and how its lines become events; pure.

The journal's folder holds a file for each day (UTC), ``YYYY-MM-DD.jsonl``; each line is one JSON
object with ``number``, ``time`` and ``kind``. Numbers grow from line to line and from file to file.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Protocol

import msgspec

from farm.wire import Event, Events

FILE = re.compile(r"^\d{4}-\d{2}-\d{2}\.jsonl\Z")


class JournalReadError(Exception):
    """The journal cannot be read; the text says why."""


class JournalBounds(NamedTuple):
    """Oldest and newest number that a journal holds; 0 and 0: it is empty."""

    first: int
    last: int


class Journal(Protocol):
    """A cell's journal, wherever it is kept; safe to use from several threads."""

    def bounds(self) -> JournalBounds:
        """Return what it holds.

        Raises:
            JournalReadError: It cannot be read.
        """

    def read(self, since: int, limit: int) -> Events:
        """Return the events after a number, at most ``limit`` of them.

        Raises:
            JournalReadError: It cannot be read.
        """


class JournalLine(msgspec.Struct, frozen=True):
    """What every line has."""

    number: int
    time: float
    kind: str


_LINE = msgspec.json.Decoder(JournalLine)
_BODY = msgspec.json.Decoder(dict[str, Any])
Describe = Callable[[str, dict[str, Any]], tuple[bool, str]]
"""Of an event's kind and line: whether it stopped the pair, and what to say of it."""


def number_of(line: bytes) -> int | None:
    """Return the number of a whole line; None if it is none.

    Example:
        >>> number_of(b'{"number": 7, "time": 1.5, "kind": "audit"}'), number_of(b'{"numb')
        (7, None)
    """
    try:
        return _LINE.decode(line).number
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None


def events_of(lines: Iterator[bytes], describe: Describe) -> Iterator[Event]:
    """Yield the events of whole lines; a line that is none is left out.

    Its number is missing then, and whoever reads by number sees that.
    """
    for line in lines:
        try:
            found, body = _LINE.decode(line), _BODY.decode(line)
        except (msgspec.DecodeError, UnicodeDecodeError):
            continue
        stop, text = describe(found.kind, body)
        yield Event(found.number, found.time, found.kind, stop, text, body)
