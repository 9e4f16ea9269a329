"""The door for other machines: a router of its own, opened anew when others may come in.

zenoh reads who may do what once, when a router opens. So other machines come to a second router in
this process, beside the one of this machine: to open it anew cuts their lines for a second, and
nobody else's.
"""

from __future__ import annotations

import sys
import threading
from datetime import datetime, timezone
from pathlib import Path

import zenoh
from scara_ros.shell.program_io import say

from farm.bus_io import BusError, open_outside
from farm.config import FarmConfig
from farm.security.authority_io import CERTIFICATE, SiteAuthority, good_of, read_register
from farm.security.invitation_io import SecurityError

LOOK_S = 0.25
"""Our choice: so often the register is looked at; to open anew takes half a second more."""
AGAIN_S = 2.0
"""Our choice: so long after it could not be opened it is tried again."""


class MemberDoor:
    """Lets in whoever is good in the authority's register at that moment; a context manager."""

    def __init__(self, config: FarmConfig, folder: Path, reached: tuple[str, int]) -> None:
        """Open it; the router of this machine is there already.

        Args:
            config: farm.yaml.
            folder: Of the authority; it is made if there is none.
            reached: Host and port at which other machines come in.

        Raises:
            SecurityError: Nobody can know who may come in, or no certificate can be made.
            BusError: The address is taken.
        """
        self._config, self._folder, self._reached = config, folder, reached
        self._session: zenoh.Session | None = None
        self._authority = b""
        self.names: tuple[str, ...] | None = None
        """In the certificates that are let in; None: the door is closed."""
        self._open()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="door", daemon=True)
        self._thread.start()

    def __enter__(self) -> MemberDoor:
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self._close()

    def _watch(self) -> None:
        """Open it anew when others may come in; nobody does while nobody knows who may."""
        told, wait = "", LOOK_S
        while not self._ended.wait(wait):
            wait = LOOK_S
            try:
                good = good_of(read_register(self._folder), datetime.now(timezone.utc))
                there = tuple(each.shown for each in good), self._certificate()
                if there == (self.names, self._authority):
                    continue
                self._close()
                self._open()
                told = ""
                names = ", ".join(self.names or ()) or "nobody"
                say(f"farm: may come in from now on: {names}")
            except (SecurityError, BusError) as error:
                self._close()
                wait = AGAIN_S
                if told != (told := str(error)):
                    say(f"farm: nobody comes in: {told}", sys.stderr)

    def _certificate(self) -> bytes:
        """Return the authority's certificate: what it has signed is let in, and nothing else."""
        file = self._folder / CERTIFICATE
        try:
            return file.read_bytes()
        except OSError as error:
            raise SecurityError(f"{file}: {error.strerror}") from error

    def _open(self) -> None:
        authority = SiteAuthority(self._folder, self._config.site, datetime.now(timezone.utc))
        outside = authority.outside(*self._reached)
        config = self._config
        # Before the router reads it: if it changes meanwhile, the next look sees that.
        self._authority = self._certificate()
        self._session = open_outside(config.router, config.lease_ms, outside)
        self.names = tuple(each.shown for each in authority.good())

    def _close(self) -> None:
        self.names = None
        if self._session is not None:
            self._session.close()  # type: ignore[no-untyped-call]
            self._session = None
