"""Read the files of a cell's journal, also while they are written.

The folder holds a file for each day (UTC), ``YYYY-MM-DD.jsonl``; each line is one JSON object with
``number``, ``time`` and ``kind``. Numbers grow from line to line and from file to file. A number is
found by bisection, so an answer costs the same early and late in a day. Files may be removed
meanwhile, because they are too old; what they held is not there then. A last line without its end
is being written, or the journal's next start keeps it aside: it is left out.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import msgspec

NAME = re.compile(r"\d{4}-\d{2}-\d{2}\.jsonl")
BLOCK = 1 << 16
"""Our choice: so much of a file is searched at once [bytes]."""


class JournalLine(msgspec.Struct, frozen=True):
    """What makes a line an entry, whatever its kind."""

    number: int
    time: float
    kind: str


class JournalBounds(NamedTuple):
    """Oldest and newest number that a journal holds; 0 and 0: it is empty."""

    first: int
    last: int


_DECODER = msgspec.json.Decoder(JournalLine)


def numbered(line: bytes) -> JournalLine | None:
    """Return number, time and kind of a whole line; None if it is no entry.

    Example:
        >>> numbered(b'{"number": 7, "time": 1.5, "kind": "audit"}').number, numbered(b'{"numb')
        (7, None)
    """
    try:
        return _DECODER.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None


def files_of(folder: Path) -> list[Path]:
    """Return the files of a journal, the oldest first; none if there is no such folder."""
    try:
        return sorted(path for path in folder.iterdir() if NAME.fullmatch(path.name))
    except (FileNotFoundError, NotADirectoryError):
        return []


def files_after(folder: Path, since: int) -> list[Path]:
    """Return the files that can hold the entries after a number, the oldest first."""
    files = files_of(folder)
    for index in range(len(files) - 1, 0, -1):
        first = next(lines_of(files[index]), b"")
        if (found := numbered(first)) is not None and found.number <= since + 1:
            return files[index:]
    return files


def journal_bounds(folder: Path) -> JournalBounds:
    """Return oldest and newest number.

    Raises:
        OSError: A file is there and cannot be read.
    """
    files = files_of(folder)
    lines = (line for file in files for line in lines_of(file))
    first = next((found.number for line in lines if (found := numbered(line))), 0)
    lasts = (_last_number(file) for file in reversed(files))
    return JournalBounds(first, next((last for last in lasts if last), 0))


def lines_of(file: Path, since: int = 0) -> Iterator[bytes]:
    """Yield the whole lines of a file, with their ends.

    Args:
        file: Of a journal.
        since: Begin at, or a little before, the first line with a greater number.

    Raises:
        OSError: The file is there and cannot be read.
    """
    try:
        stream = file.open("rb")
    except FileNotFoundError:
        return
    with stream:
        low, high = 0, stream.seek(0, os.SEEK_END) if since else 0
        # low: beginning of a line at or before the wanted one; high: behind it.
        while high - low > BLOCK:
            middle = (low + high) // 2
            stream.seek(middle)
            stream.readline()
            start = stream.tell()
            line = stream.readline()
            found = numbered(line) if line.endswith(b"\n") else None
            if start >= high or found is None or found.number > since:
                high = middle
            else:
                low = start
        stream.seek(low)
        yield from (line for line in stream if line.endswith(b"\n"))


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
                if found := numbered(line):
                    return found.number
    return 0
