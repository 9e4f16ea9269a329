"""Who listens at which TCP port, read from /proc without touching the listener."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

_LISTEN = "0A"


def listening_ports() -> frozenset[int]:
    """Return every TCP port of this machine that somebody listens at."""
    return frozenset(port for port, _ in _listeners())


def owner_of(port: int) -> str:
    """Name the listener at ``port`` as ``pid command``; empty if it belongs to another user and cannot be seen."""
    inodes = {f"socket:[{inode}]" for listening, inode in _listeners() if listening == port}
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        with contextlib.suppress(OSError):
            if any(os.readlink(link) in inodes for link in (entry / "fd").iterdir()):
                command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
                return f"pid {entry.name} ({command})"
    return ""


def _listeners() -> Iterator[tuple[int, str]]:
    """Yield (port, inode) of each listening socket."""
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        with contextlib.suppress(OSError):
            for line in Path(table).read_text().splitlines()[1:]:
                fields = line.split()
                if fields[3] == _LISTEN:
                    yield int(fields[1].rsplit(":", 1)[1], 16), fields[9]
