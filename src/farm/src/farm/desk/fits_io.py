"""The fits of each day, in a file of the desk's data: ``fits/DAY.jsonl``, a line for each cell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec
from scara_config.files.whole_file import write_whole

from farm.desk.reading_io import AskingError
from farm.fits import DayFit, noon_of

FITS = "fits"
"""Folder of the fits, beside that of the events."""


def keep_fits(data: Path, day: str, fits: Sequence[DayFit]) -> Path:
    """Keep the fits of a day in place of those that were there; whole or not at all.

    Args:
        data: The desk's data.
        day: As 2026-11-22.
        fits: Of that day.

    Raises:
        OSError: The disk is full, or fails.
    """
    file = data / FITS / f"{day}.jsonl"
    file.parent.mkdir(parents=True, exist_ok=True)
    write_whole(file, b"".join(msgspec.json.encode(fit) + b"\n" for fit in fits))
    return file


def read_fits(data: Path, begin: float, end: float) -> Iterator[DayFit]:
    """Yield the fits of the days between two times [s since 1970]; none if there are none.

    Raises:
        AskingError: A file cannot be read, or is none of ours.
    """
    for file in sorted((data / FITS).glob("*.jsonl")):
        try:
            if begin <= noon_of(file.stem) <= end:
                for line in file.read_bytes().splitlines():
                    yield msgspec.json.decode(line, type=DayFit)
        except (OSError, ValueError, msgspec.DecodeError) as error:
            raise AskingError(f"{file}: is no file of fits: {error}: move it away") from error
