"""Who listens at which TCP port, read from /proc without touching the listener."""

from __future__ import annotations

import contextlib
import ipaddress
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

_LISTEN = "0A"


class ListeningSocket(NamedTuple):
    """A listening socket: its address, TCP port and inode."""

    address: str
    port: int
    inode: str

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach it."""
        address = ipaddress.ip_address(self.address)
        mapped = getattr(address, "ipv4_mapped", None)
        return (mapped or address).is_loopback


def listening_ports() -> frozenset[int]:
    """Return every TCP port of this machine that somebody listens at."""
    return frozenset(listener.port for listener in listeners())


def owner_of(port: int) -> str:
    """Name the listener at ``port`` as ``pid command``.

    Empty if it belongs to another user and cannot be seen.
    """
    inodes = {listener.inode for listener in listeners() if listener.port == port}
    found = (f"pid {pid} ({command})" for pid, command, held in sockets() if held & inodes)
    return next(found, "")


def sockets() -> Iterator[tuple[int, str, set[str]]]:
    """Yield id, command and the inodes of the sockets of each process that may be looked at."""
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        with contextlib.suppress(OSError):
            links = list((entry / "fd").iterdir())
            command = (entry / "cmdline").read_bytes().replace(b"\0", b" ")
            held = {_socket(link) for link in links} - {""}
            yield int(entry.name), command.decode(errors="replace").strip(), held


def _socket(link: Path) -> str:
    """Return the inode of the socket behind an entry of fd/, empty for anything else."""
    try:
        found = re.fullmatch(r"socket:\[(\d+)\]", os.readlink(link))
    except OSError:  # closed meanwhile
        return ""
    return found[1] if found else ""


def listeners() -> Iterator[ListeningSocket]:
    """Yield each listening TCP socket of this machine."""
    for table in ("/proc/net/tcp", "/proc/net/tcp6"):
        with contextlib.suppress(OSError):
            for line in Path(table).read_text().splitlines()[1:]:
                fields = line.split()
                if fields[3] == _LISTEN:
                    address, port = fields[1].rsplit(":", 1)
                    # An address of the kernel's table: words of 4 bytes, each in the machine's
                    # order. 0100007F is 127.0.0.1.
                    words = [address[i : i + 8] for i in range(0, len(address), 8)]
                    packed = b"".join(int(word, 16).to_bytes(4, sys.byteorder) for word in words)
                    yield ListeningSocket(
                        str(ipaddress.ip_address(packed)), int(port, 16), fields[9]
                    )
