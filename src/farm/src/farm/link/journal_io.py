"""A cell's journal as the events of the bus."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import msgspec
from scara_ros.journal_files_io import (
    JournalBounds,
    files_after,
    journal_bounds,
    lines_of,
    numbered,
)

from farm.link.event_text import describe
from farm.wire import Event, Events


class JournalReadError(Exception):
    """The journal cannot be read; the text says why."""


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


class JournalFiles:
    """A :class:`Journal` in a folder, which need not be there yet."""

    def __init__(self, folder: Path) -> None:
        """Remember the folder; nothing is read yet."""
        self._folder = folder

    def bounds(self) -> JournalBounds:
        """Return what the files hold now; see :class:`Journal`."""
        try:
            return journal_bounds(self._folder)
        except OSError as error:
            raise JournalReadError(f"{self._folder}: {error.strerror}") from error

    def read(self, since: int, limit: int) -> Events:
        """Return events; see :class:`Journal`. A line that is no entry leaves its number out."""
        bounds = self.bounds()
        events: list[Event] = []
        try:
            # With nothing new no file is looked into.
            files = files_after(self._folder, since) if since < bounds.last else []
            for line in (line for file in files for line in lines_of(file, since)):
                found = numbered(line)
                if found is None or found.number <= since:
                    continue
                # What was written after the bounds were read comes with the next answer.
                if found.number > bounds.last or len(events) == limit:
                    break
                try:
                    body = msgspec.json.decode(line, type=dict[str, Any])
                    stop, text = describe(found.kind, body)
                # The latter: it is no UTF-8, or a figure of it no number.
                except (msgspec.DecodeError, ValueError, TypeError):
                    continue
                events.append(Event(found.number, found.time, found.kind, stop, text, body))
        except OSError as error:
            raise JournalReadError(f"{self._folder}: {error.strerror}") from error
        return Events(*bounds, tuple(events))
