"""Logs that cannot fill a disk: at most one older file of the same size beside each."""

from __future__ import annotations

import logging
import shutil
from logging.handlers import RotatingFileHandler
from pathlib import Path

OLDER = 1


class LogFile:
    """A log that begins anew when it is full. A disk that takes no line costs lines only."""

    def __init__(self, path: Path, limit_mb: float) -> None:
        """Append to ``path``, at most ``limit_mb`` [MB]; the file is made with the first line."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._handler = RotatingFileHandler(
            path, maxBytes=int(limit_mb * 1e6), backupCount=OLDER, errors="replace", delay=True
        )

    def write(self, text: str) -> None:
        """Write one line."""
        self._handler.handle(logging.LogRecord("", logging.INFO, "", 0, text, None, None))


def cut_off(path: Path, limit_mb: float) -> bool:
    """Begin a file anew that has grown beyond ``limit_mb`` [MB], while somebody appends to it.

    What it held becomes the older file, unless the disk is too full for that. Lines that come
    between copy and cut are lost. Return whether it was cut.

    Raises:
        OSError: The file cannot be cut.
    """
    if not path.is_file() or path.stat().st_size <= limit_mb * 1e6:
        return False
    older = path.with_name(f"{path.name}.{OLDER}")
    try:
        shutil.copyfile(path, older)
    except OSError:
        older.unlink(missing_ok=True)
    # Cut in place: who appends has it open, and goes on at its new end.
    with path.open("r+b") as file:
        file.truncate(0)
    return True
