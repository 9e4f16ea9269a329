"""Keep events in Parquet: one writer, files that are whole or not there, small ones joined."""

from __future__ import annotations

import fcntl
import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq
from scara_config.files.whole_file import sync_folder, whole_file

from farm.desk.files import EventSpan, counting, to_join
from farm.keys import CellName
from farm.wire import Event

SCHEMA = pa.schema(
    [
        ("site", pa.string()),
        ("machine", pa.string()),
        ("cell", pa.string()),
        ("era", pa.int32()),
        ("number", pa.int64()),
        ("time", pa.timestamp("us")),
        ("kind", pa.string()),
        ("stop", pa.bool_()),
        ("text", pa.string()),
        ("body", pa.string()),
    ]
)
HALF = ".part"
"""Ending of a file that is being written."""


class HistoryError(RuntimeError):
    """The history cannot be read or written; the text says why and what to do."""


class Kept(NamedTuple):
    """An event to keep: whose, of which journal, and the event."""

    cell: CellName
    era: int
    event: Event


class History:
    """The history's only writer; a context manager."""

    def __init__(self, folder: Path, small_files: int, small_file_mb: float) -> None:
        """Take the folder, and remove what a killed writer has left.

        Args:
            folder: Made if missing.
            small_files: So many small files become one.
            small_file_mb: A file of this size is left as it is [MB].

        Raises:
            HistoryError: The folder cannot be used, or another desk writes there.
        """
        self.folder = folder
        self._small_files, self._large = small_files, int(small_file_mb * 1e6)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = (folder / "lock").open("a")
            # The system lets go of it when the process ends, however that ends.
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # A killed writer leaves halves, and small files whose events a large one holds.
            for half in folder.glob(f"*{HALF}"):
                half.unlink()
            self._spans, held = counting(path.name for path in folder.iterdir())
            for span in held:
                self._path(span).unlink()
        except BlockingIOError as error:
            self._lock.close()
            raise HistoryError(
                f"{folder}: another desk keeps its history there: end it, or name another folder"
            ) from error
        except OSError as error:
            raise HistoryError(f"{folder}: {error.strerror}") from error

    def __enter__(self) -> History:
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.close()

    def write(self, kept: Sequence[Kept]) -> None:
        """Keep events: all of them, or none if this raises.

        Raises:
            HistoryError: The disk is full, or fails, or an event does not fit into a column.
        """
        if not kept:
            return
        first = self._spans[-1].last + 1 if self._spans else 1
        span = EventSpan(first, first + len(kept) - 1)
        try:
            table = pa.Table.from_pydict(_columns(kept), schema=SCHEMA)
        except (ValueError, OverflowError, pa.ArrowException) as error:
            raise HistoryError(f"{self.folder}: an event cannot be kept: {error}") from error
        self._put(span, table)
        self._spans.append(span)

    def join(self) -> int:
        """Make one file of the small ones if there are too many; return how many there were.

        Raises:
            HistoryError: The disk is full, or fails; everything is still there.
        """
        try:
            # Somebody may have moved a damaged one away.
            there = [span for span in self._spans if self._path(span).exists()]
            sizes = [self._path(span).stat().st_size for span in there]
            row = to_join(there, sizes, self._small_files, self._large)
            if not row:
                return 0
            whole = EventSpan(row[0].first, row[-1].last)
            self._put(whole, pa.concat_tables([self._read(span) for span in row]))
            self._spans = [*there[: -len(row)], whole]
            for span in row:
                self._path(span).unlink(missing_ok=True)
        except OSError as error:
            raise HistoryError(f"{self.folder}: {error.strerror}") from error
        return len(row)

    def _put(self, span: EventSpan, table: pa.Table) -> None:
        """Write a file; it has its name when all of it is on the disk."""
        try:
            with whole_file(self._path(span), half=HALF) as stream:
                pq.write_table(table, stream, compression="zstd")
            sync_folder(self.folder)
        except OSError as error:
            raise HistoryError(f"{self.folder}: {error.strerror}") from error

    def _read(self, span: EventSpan) -> pa.Table:
        try:
            return pq.ParquetFile(self._path(span)).read()
        except (OSError, pa.ArrowInvalid) as error:
            raise HistoryError(
                f"{self._path(span)}: cannot be read: {error}; move it away to go on without it"
            ) from error

    def _path(self, span: EventSpan) -> Path:
        return self.folder / span.name


def _columns(kept: Sequence[Kept]) -> dict[str, list[object]]:
    return {
        "site": [each.cell.site for each in kept],
        "machine": [each.cell.machine for each in kept],
        "cell": [each.cell.cell for each in kept],
        "era": [each.era for each in kept],
        "number": [each.event.number for each in kept],
        # The column counts microseconds.
        "time": [int(each.event.time * 1e6) for each in kept],
        "kind": [each.event.kind for each in kept],
        "stop": [each.event.stop for each in kept],
        "text": [each.event.text for each in kept],
        "body": [json.dumps(each.event.body, ensure_ascii=False) for each in kept],
    }
