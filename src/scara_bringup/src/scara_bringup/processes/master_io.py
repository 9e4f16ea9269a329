"""Ask the ROS master what there is, with a deadline for each answer."""

from __future__ import annotations

import socket
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from scara_ros.starting.master_io import UNREACHABLE, MasterClient, MasterError

_CALLER = "/cell"


@dataclass(frozen=True)
class MasterAddress:
    """Host and port of a ROS_MASTER_URI."""

    host: str
    port: int

    @classmethod
    def of(cls, uri: str) -> MasterAddress:
        """Split a ROS_MASTER_URI.

        Raises:
            ValueError: It is none.
        """
        try:
            parts = urlsplit(uri)
            host, port = parts.hostname, parts.port
        except ValueError:
            host, port = None, None
        if not host or not port:
            raise ValueError(f"ROS_MASTER_URI = {uri!r}: must be like http://127.0.0.1:11311")
        return cls(host, port)

    @property
    def is_local(self) -> bool:
        """Whether a master could be started there by this machine."""
        return self.host in ("localhost", "127.0.0.1", "::1", socket.gethostname())


class MasterProbe:
    """Questions to one master; no answer within ``timeout`` [s] counts as nothing there."""

    def __init__(self, uri: str, timeout: float = 2.0) -> None:
        """Ask the master at ``uri``."""
        self.uri = uri
        self._timeout = timeout

    def answers(self) -> bool:
        """Say whether a ROS master answers there."""
        return self._ask(self.uri, "getPid") is not None

    def services_and_topics(self) -> tuple[frozenset[str], frozenset[str]]:
        """Return the names of all services, and of all topics with a publisher."""
        state = self._ask(self.uri, "getSystemState")
        if state is None:
            return frozenset(), frozenset()
        publishers, _, services = state
        return frozenset(name for name, _ in services), frozenset(name for name, _ in publishers)

    def is_running(self, node: str) -> bool:
        """Say whether a node of this absolute name is registered and answers."""
        uri = self._ask(self.uri, "lookupNode", node)
        return uri is not None and self._ask(uri, "getPid") is not None

    def _ask(self, uri: str, method: str, *arguments: Any) -> Any:
        """Return the value of one answer, None if there was none."""
        try:
            return MasterClient(uri, _CALLER, self._timeout).ask(method, *arguments)
        except (*UNREACHABLE, MasterError, ValueError, TypeError):
            return None
