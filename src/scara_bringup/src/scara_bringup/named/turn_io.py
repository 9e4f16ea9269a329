"""Cells start one after the other, so that each sees the ports and the load of all."""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Callable
from pathlib import Path

LOCK = ".starting"


class StartTurn:
    """Held from the choice of ports until the cell is ready, or has ended; a context manager."""

    def __init__(self, folder: Path, on_wait: Callable[[], None]) -> None:
        """Wait for the others; ``on_wait`` is called before, if there are any.

        Raises:
            OSError: The folder cannot be written to.
        """
        folder.mkdir(parents=True, exist_ok=True)
        # Closed in what is started from here: a lock ends with the last who has the file open.
        self._fd = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        # Tried first, so that a person learns why nothing happens.
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            on_wait()
            fcntl.flock(self._fd, fcntl.LOCK_EX)

    def end(self) -> None:
        """Let the next one start; a second call changes nothing."""
        fd, self._fd = self._fd, -1
        if fd >= 0:
            with contextlib.suppress(OSError):
                os.close(fd)

    def __enter__(self) -> StartTurn:
        """Return the turn, which has begun."""
        return self

    def __exit__(self, *error: object) -> None:
        """End it."""
        self.end()
