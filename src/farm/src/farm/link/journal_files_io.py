"""Read a cell's journal from its files, also while it is being written.

It finds a number by bisection and reads on from there, so an answer costs the same early and late
in a day. ``cell_recorder.journal.reader_io.read`` reads the same files from their beginning.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from farm.link.journal import FILE, Describe, JournalBounds, JournalReadError, events_of, number_of
from farm.wire import Events

BLOCK = 1 << 16
"""Our choice: so much of a file's end is searched at once for its last whole line [bytes]."""


class JournalFiles:
    """A :class:`farm.link.journal.Journal` in a folder, which need not be there yet."""

    def __init__(self, folder: Path, describe: Describe) -> None:
        """Remember the folder; nothing is read yet."""
        self._folder, self._describe = folder, describe
        self._lock = threading.Lock()
        self._firsts: dict[str, int] = {}

    def bounds(self) -> JournalBounds:
        """Return oldest and newest number.

        Raises:
            JournalReadError: A file cannot be read.
        """
        try:
            files = self._files()
            numbers = (_last_number(file) for file in reversed(files))
            last = next((number for number in numbers if number), 0)
            return JournalBounds(self._first(files[0]) if files and last else 0, last)
        except OSError as error:
            raise JournalReadError(f"{self._folder}: {error.strerror}") from error

    def read(self, since: int, limit: int) -> Events:
        """Return the events after ``since``, at most ``limit`` of them.

        Raises:
            JournalReadError: A file cannot be read.
        """
        bounds = self.bounds()
        if since >= bounds.last:
            return Events(*bounds)
        try:
            lines = (line for file in self._from(since) for line in _lines_after(file, since))
            found = islice(events_of(lines, self._describe), limit)
            # What was written after the bounds were read comes with the next answer.
            return Events(*bounds, tuple(e for e in found if since < e.number <= bounds.last))
        except OSError as error:
            raise JournalReadError(f"{self._folder}: {error.strerror}") from error

    def _files(self) -> list[Path]:
        """Return the files that hold something, the oldest first."""
        try:
            found = [path for path in self._folder.iterdir() if FILE.match(path.name)]
        except (FileNotFoundError, NotADirectoryError):
            return []
        with self._lock:  # a file that has gone may come again under its name, as another one
            here = {path.name for path in found}
            self._firsts = {name: first for name, first in self._firsts.items() if name in here}
        return [path for path in sorted(found) if self._first(path)]

    def _from(self, since: int) -> list[Path]:
        """Return the files that can hold what comes after a number."""
        files = self._files()
        later = [k for k, file in enumerate(files) if self._first(file) > since]
        return files[max(0, later[0] - 1) :] if later else files[-1:]

    def _first(self, file: Path) -> int:
        """Return the first number of a file, 0 if it has no whole line yet; it never changes."""
        with self._lock:
            known = self._firsts.get(file.name)
        if known:
            return known
        try:
            with file.open("rb") as stream:
                line = stream.readline()
        except FileNotFoundError:  # it has grown too old meanwhile
            return 0
        number = (number_of(line) or 0) if line.endswith(b"\n") else 0
        with self._lock:
            self._firsts[file.name] = number
        return number


def _last_number(file: Path) -> int:
    """Return the number of the last whole line, 0 if there is none."""
    try:
        stream = file.open("rb")
    except FileNotFoundError:
        return 0
    with stream:
        begin = end = stream.seek(0, os.SEEK_END)
        tail = b""
        while begin > 0:
            begin = max(0, begin - BLOCK)
            stream.seek(begin)
            tail = stream.read(end - begin) + tail
            end = begin
            whole = tail[: tail.rfind(b"\n") + 1].splitlines()
            # The first piece may be the rest of a line, except at the file's beginning.
            for line in reversed(whole[0 if begin == 0 else 1 :]):
                if number := number_of(line):
                    return number
    return 0


def _lines_after(file: Path, since: int) -> Iterator[bytes]:
    """Yield the whole lines of a file whose numbers are after ``since``, without their ends."""
    try:
        stream = file.open("rb")
    except FileNotFoundError:
        return
    with stream:
        low, high = 0, stream.seek(0, os.SEEK_END)
        # low: beginning of a line at or before the wanted one; high: behind it.
        while high - low > BLOCK:
            middle = (low + high) // 2
            stream.seek(middle)
            stream.readline()
            start = stream.tell()
            line = stream.readline()
            number = number_of(line) if line.endswith(b"\n") else None
            if start >= high or number is None or number > since:
                high = middle
            else:
                low = start
        stream.seek(low)
        for line in stream:
            if not line.endswith(b"\n"):
                return
            number = number_of(line)
            if number is not None and number > since:
                yield line
