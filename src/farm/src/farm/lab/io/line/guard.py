"""TLS of dask with a look at the name in each certificate, before a byte of dask's is read.

dask asks both sides for a certificate of one authority, and is then content with each. Here each
handshake ends with the question whether this name may be at the other end, on both sides. Lines
that were let in are known, and are ended when their name may be there no more.

Source: dask.distributed, Security; Python's ssl, SSLContext.sslsocket_class.
"""

from __future__ import annotations

import socket
import ssl
import weakref
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, Protocol

from distributed.security import Security

from farm.config import Credentials
from farm.security.io.authority import good_of, read_register
from farm.security.io.invitation import SecurityError
from farm.security.io.lab_authority import DESK


class Admission(Protocol):
    """Who may be at the other end; asked at each handshake."""

    def names(self) -> frozenset[str]:
        """Return the names in their certificates."""


@dataclass(frozen=True)
class Only:
    """These names: of a worker or a lab, the desk and its own machine."""

    allowed: frozenset[str]

    def names(self) -> frozenset[str]:
        """Return them."""
        return self.allowed


@dataclass(frozen=True)
class Registered:
    """The desk, and whoever is good in the register of the lab's authority at this moment."""

    folder: Path

    def names(self) -> frozenset[str]:
        """Return their names; nobody but the desk if the register cannot be read."""
        try:
            register = read_register(self.folder)
        except SecurityError:
            return frozenset({DESK})
        good = good_of(register, datetime.now(timezone.utc))
        return frozenset({DESK, *(each.shown for each in good)})


class Guard:
    """Lets lines in by the name at their other end, and remembers them."""

    def __init__(self, admission: Admission) -> None:
        """Ask ``admission`` who may."""
        self._admission = admission
        self._lines: weakref.WeakKeyDictionary[ssl.SSLSocket, str] = weakref.WeakKeyDictionary()

    def check(self, line: ssl.SSLSocket) -> None:
        """Let a line in whose handshake is done.

        Raises:
            ssl.SSLCertVerificationError: Its other end may not be there.
        """
        name = name_in(line.getpeercert())
        if name not in self._admission.names():
            raise ssl.SSLCertVerificationError(
                ssl.SSL_ERROR_SSL, f"{name or 'who shows no name'} is not let in: revoked, or not"
            )
        self._lines[line] = name

    def expel(self) -> list[str]:
        """End all lines whose other end may be there no more; return their names."""
        good = self._admission.names()
        out = [(line, name) for line, name in list(self._lines.items()) if name not in good]
        for line, _ in out:
            del self._lines[line]
            # Of the socket, not of its TLS: that would let plain bytes be read from then on.
            with suppress(OSError):
                socket.socket.shutdown(line, socket.SHUT_RDWR)
        return sorted({name for _, name in out})


class LabSecurity(Security):
    """dask's security of a machine of the lab; goes to workers' processes as its files' names."""

    def __init__(self, files: Credentials, admission: Admission) -> None:
        """Show ``files``, and let in whom ``admission`` names."""
        ends = ("client", "scheduler", "worker")
        super().__init__(  # type: ignore[no-untyped-call]
            require_encryption=True,
            tls_ca_file=files.authority,
            tls_min_version=ssl.TLSVersion.TLSv1_3,
            **{f"tls_{end}_cert": files.certificate for end in ends},
            **{f"tls_{end}_key": files.key for end in ends},
        )
        self.files, self.admission = files, admission
        self.guard = Guard(admission)

    def __reduce__(self) -> tuple[type[LabSecurity], tuple[Credentials, Admission]]:
        """Travel as what it was made of."""
        return type(self), (self.files, self.admission)

    def get_connection_args(self, role: str) -> dict[str, Any]:
        """Return what a line is opened with; see dask's."""
        return self._guarded(super().get_connection_args(role))  # type: ignore[no-untyped-call]

    def get_listen_args(self, role: str) -> dict[str, Any]:
        """Return what lines are taken with; see dask's."""
        args = self._guarded(super().get_listen_args(role))  # type: ignore[no-untyped-call]
        # No tickets: each line shows its certificate anew, and its time is looked at.
        args["ssl_context"].num_tickets = 0
        return args

    def _guarded(self, args: dict[str, Any]) -> dict[str, Any]:
        context, guard = args["ssl_context"], self.guard

        class GuardedSocket(ssl.SSLSocket):
            """Looks at the name when the handshake is done."""

            def do_handshake(self, block: bool = False) -> None:
                super().do_handshake(block)
                guard.check(self)

        context.sslsocket_class = GuardedSocket
        return args


def name_in(certificate: Any) -> str:
    """Return the name that a certificate shows, as Python's ssl reads it; empty: none or several.

    Example:
        >>> name_in({"subject": ((("commonName", "pc_2 1"),),)}), name_in(None)
        ('pc_2 1', '')
    """
    subject = (certificate or {}).get("subject", ())
    found = [value for part in subject for key, value in part if key == "commonName"]
    return found[0] if len(found) == 1 else ""
