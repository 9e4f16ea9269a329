"""Go on without a log while the disk is full: a line that cannot be written is dropped and counted.

rospy's handler of the screen lets the error of a full disk through to whoever had something to say.
A controller died of a log line, at its next change of mode.
"""

from __future__ import annotations

import errno
import logging
import sys
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass
from logging.handlers import RotatingFileHandler
from typing import Any, TextIO

from rosgraph.roslogging import RosStreamHandler

DISK_ERRORS = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS})
"""What a disk says that is full, over quota, limited, broken or read-only."""

LOG_BYTES = 10_000_000  # our choice: rospy's own choice is 250 MB for each node and run
OLDER_LOGS = 1


@dataclass(frozen=True)
class Loss:
    """What this process could not write so far.

    Args:
        lines: Lines or pieces of text that were dropped.
        reason: What the system said at the last one, empty before the first.
        age: Time since the last one [s].
    """

    lines: int = 0
    reason: str = ""
    age: float = 0.0


class LossCounter:
    """Counts what was dropped; any thread may ask and tell."""

    def __init__(self) -> None:
        """Begin with nothing lost."""
        self._lock = threading.Lock()
        self._lines, self._reason, self._last = 0, "", 0.0

    def count(self, error: OSError) -> None:
        """Take down one line that was dropped."""
        with self._lock:
            self._lines += 1
            self._reason = error.strerror or str(error)
            self._last = time.monotonic()

    @property
    def loss(self) -> Loss:
        """What was lost so far."""
        with self._lock:
            return Loss(self._lines, self._reason, time.monotonic() - self._last)


class DroppingStream:
    """A text stream that drops what the disk does not take.

    The first line that is written again says how many are missing before it. Errors of another
    kind, a closed pipe for example, are raised as before.
    """

    def __init__(self, stream: TextIO, counter: LossCounter) -> None:
        """Write to ``stream`` and tell ``counter`` what is dropped."""
        self._stream = stream
        self._counter = counter
        self._missing = 0

    def write(self, text: str) -> int:
        """Write ``text`` or drop it; return its length in both cases."""
        try:
            if self._missing:
                self._stream.write(f"[{self._missing} lines are missing here: the disk was full]\n")
                self._missing = 0
            self._stream.write(text)
        except OSError as error:
            self._drop(error)
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write or drop each of ``lines``."""
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        """Hand on what waits; what the disk does not take stays with the stream."""
        try:
            self._stream.flush()
        except OSError as error:
            self._drop(error)

    def _drop(self, error: OSError) -> None:
        if error.errno not in DISK_ERRORS:
            raise error
        self._missing += 1
        self._counter.count(error)

    def __getattr__(self, name: str) -> Any:
        """Be the wrapped stream in everything else."""
        return getattr(self._stream, name)


lost_lines = LossCounter()
"""The one count of this process."""


def outlive_full_disk() -> None:
    """Let no print and no log line of this process raise because a disk is full.

    A second call changes nothing.
    """
    if isinstance(sys.stdout, DroppingStream):
        return
    sys.stdout = DroppingStream(sys.stdout, lost_lines)
    sys.stderr = DroppingStream(sys.stderr, lost_lines)
    for screen in logging.getLogger("rosout").handlers:
        # rospy's handler keeps the streams that it has found at the start of the node.
        if isinstance(screen, RosStreamHandler):
            screen._stdout, screen._stderr = sys.stdout, sys.stderr
    complain = logging.Handler.handleError

    def drop_or_complain(self: logging.Handler, record: logging.LogRecord) -> None:
        error = sys.exc_info()[1]
        if isinstance(error, OSError) and error.errno in DISK_ERRORS:
            # Without this each lost line of the log file became a page of traceback on the screen.
            lost_lines.count(error)
        else:
            complain(self, record)

    logging.Handler.handleError = drop_or_complain  # type: ignore[method-assign]


def limit_log_file() -> None:
    """Let the log file that rospy has begun take 20 MB at most."""
    for handler in logging.getLogger().handlers:
        if isinstance(handler, RotatingFileHandler):
            handler.maxBytes, handler.backupCount = LOG_BYTES, OLDER_LOGS
