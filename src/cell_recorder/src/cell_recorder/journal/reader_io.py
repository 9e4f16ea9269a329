"""Read the entries of a journal, with or without a running cell: the files are all there is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import date, datetime, timedelta, timezone
from pathlib import Path

import msgspec
from scara_ros.journal_files_io import NAME, files_after, files_of, lines_of

from cell_recorder.journal.entries import AnyEntry, decode

JOURNAL = "journal"
"""The folder of all journals, in the runs folder."""


def day_of(path: Path) -> date:
    """Return the day (UTC) of a file."""
    return date.fromisoformat(path.stem)


def utc_day(time: float) -> date:
    """Return the day (UTC) of a time [s], Unix time."""
    return datetime.fromtimestamp(time, timezone.utc).date()


def journals(runs: Path) -> dict[str, Path]:
    """Return the folder of each cell's journal in a runs folder, by the cell's name."""
    top = runs / JOURNAL
    folders = {path.parent for path in top.rglob("*.jsonl") if NAME.fullmatch(path.name)}
    return {str(folder.relative_to(top)): folder for folder in sorted(folders)}


def read(
    folder: Path | str, since_number: int = 0, bad: Callable[[str], None] | None = None
) -> Iterator[AnyEntry]:
    """Yield the entries after a number, in their order.

    Args:
        folder: Of the cell's journal.
        since_number: The first entry has a greater number.
        bad: Is told, in words, of each line that is no entry.

    Raises:
        OSError: A file is there and cannot be read.
    """
    for path in files_after(Path(folder), since_number):
        for entry in _entries(path, bad):
            if entry.number > since_number:
                yield entry


def read_between(
    folder: Path | str, start: float, end: float, bad: Callable[[str], None] | None = None
) -> Iterator[AnyEntry]:
    """Yield the entries of a time, in the order of their numbers.

    Args:
        folder: Of the cell's journal.
        start: Not before this [s], Unix time.
        end: Before this [s].
        bad: As for :func:`read`.

    Raises:
        OSError: A file is there and cannot be read.
    """
    for path in files_of(Path(folder)):
        # A clock that was set back writes on into the newest file: a file may hold times before
        # its day, but none after it.
        ends = datetime.combine(day_of(path) + timedelta(days=1), datetime.min.time(), timezone.utc)
        if ends.timestamp() <= start:
            continue
        for entry in _entries(path, bad):
            if start <= entry.time < end:
                yield entry


def _entries(path: Path, bad: Callable[[str], None] | None) -> Iterator[AnyEntry]:
    """Yield the entries of a file."""
    for place, line in enumerate(lines_of(path), 1):
        try:
            yield decode(line)
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            if bad is not None:
                bad(f"{path}, line {place}: is no entry: {error}")
