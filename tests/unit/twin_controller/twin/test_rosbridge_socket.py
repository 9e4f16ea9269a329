"""One web-socket connection of the link, without a network."""

from __future__ import annotations

import socket
from typing import Any

from twin_controller.twin.rosbridge_socket_io import RosbridgeSocket


class Breaking:
    """The library's connection: its reader forgets the socket once somebody has looked at it."""

    def __init__(self, line: socket.socket) -> None:
        self._line: socket.socket | None = line

    @property
    def sock(self) -> socket.socket | None:
        """Return the socket at the first look."""
        line, self._line = self._line, None
        return line


def test_a_line_that_breaks_while_it_is_given_up_ends_nobody() -> None:
    """Whoever sends gives it up, the engine too; the other end sees the end."""
    ours, theirs = socket.socketpair()
    given_up: Any = RosbridgeSocket.__new__(RosbridgeSocket)
    given_up._line = Breaking(ours)
    with ours, theirs:
        theirs.settimeout(5.0)
        given_up.abort()
        assert theirs.recv(1) == b""
        given_up.abort()
