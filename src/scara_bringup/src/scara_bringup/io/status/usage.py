"""What a process uses, read from /proc."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from scara_bringup.status import Usage

TICKS = os.sysconf("SC_CLK_TCK")
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


def usage_of(pid: int) -> Usage | None:
    """Return what a process has used up to now; None if it is not there or has ended."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        # The name of a program stands in brackets and may hold spaces.
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        if fields[0] != "Z":
            processor = (int(fields[11]) + int(fields[12])) / TICKS
            return Usage(processor, int(fields[21]) * PAGE_BYTES / 1e6)
    return None
