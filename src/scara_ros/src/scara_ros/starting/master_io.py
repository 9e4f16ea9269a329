"""Questions to a ROS master, each with a deadline."""

from __future__ import annotations

import http.client
import select
import time
import xmlrpc.client
from typing import Any

TIMEOUT = 1.0  # our choice: a master that is stopped or overloaded holds nobody up for longer
UNREACHABLE = (OSError, http.client.HTTPException, xmlrpc.client.Error)


class MasterError(RuntimeError):
    """The master refused what it was asked."""


class _Transport(xmlrpc.client.Transport):
    """HTTP with a time-out: xmlrpc's own waits for ever on a master that does not answer."""

    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout
        self._open: http.client.HTTPConnection | None = None

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        self._open = connection
        return connection

    def is_open(self) -> bool:
        """Return whether the line has been kept."""
        return self._open is not None and self._open.sock is not None

    def wait_for_end(self, timeout: float) -> None:
        """Wait until the other side closes the line, or time is up."""
        if self._open is None or self._open.sock is None:
            time.sleep(timeout)
            return
        # Nothing but its end comes unasked over a line of questions and answers.
        poll = select.poll()
        poll.register(self._open.sock, select.POLLIN)
        poll.poll(timeout * 1e3)


class MasterClient:
    """Asks a ROS master, or another node; no question lasts longer than ``timeout`` [s]."""

    def __init__(self, uri: str, caller: str, timeout: float = TIMEOUT) -> None:
        """Ask ``uri`` in the name of the node ``caller``; nothing is sent yet."""
        self._transport = _Transport(timeout)
        self._proxy = xmlrpc.client.ServerProxy(uri, transport=self._transport)
        self._caller = caller

    def ask(self, method: str, *args: Any) -> Any:
        """Call ``method`` and return its value.

        Raises:
            MasterError: It answered with an error.
            OSError, HTTPException, xmlrpc.client.Error: It did not answer; see ``UNREACHABLE``.
        """
        code, text, value = getattr(self._proxy, method)(self._caller, *args)
        if code != 1:
            raise MasterError(f"{method}: {text}")
        return value

    def is_open(self) -> bool:
        """Return whether the line of the last question is still there, so that its end is seen."""
        return self._transport.is_open()

    def wait_for_end(self, timeout: float) -> None:
        """Wait until the master closes the line of the last question, or ``timeout`` [s] is up."""
        self._transport.wait_for_end(timeout)
