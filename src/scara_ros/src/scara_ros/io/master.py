"""Questions to a ROS master, each with a deadline."""

from __future__ import annotations

import http.client
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

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


class MasterClient:
    """Asks a ROS master, or another node; no question lasts longer than ``timeout`` [s]."""

    def __init__(self, uri: str, caller: str, timeout: float = TIMEOUT) -> None:
        """Ask ``uri`` in the name of the node ``caller``; nothing is sent yet."""
        self._proxy = xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout))
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
