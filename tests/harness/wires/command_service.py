"""The twin controller's command service on a bare socket: it counts, hangs and goes as it is told.

No ROS node stands behind it, so it lives on when the master is gone.
"""

from __future__ import annotations

import contextlib
import io
import socket
import struct
import threading
import xmlrpc.client
from typing import Any

NAME = "twin_controller/command"


class CommandService:
    """A node that offers scara_msgs/TwinCommand and answers ``<command> was heard``."""

    def __init__(self) -> None:
        """Listen on a free port."""
        from scara_msgs.srv import TwinCommand

        self._kind: Any = TwinCommand
        self.heard: list[str] = []
        self.connections = 0
        self.answers = threading.Event()
        """While it is not set, commands are heard and not answered."""
        self.answers.set()
        self.greets = threading.Event()
        """While it is not set, no connection is greeted, as by a process that stands still."""
        self.greets.set()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.uri = f"rosrpc://127.0.0.1:{self._listener.getsockname()[1]}"
        self._lines: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def register(self, master: str, name: str) -> None:
        """Tell a master about this service."""
        uri = self.uri.replace("rosrpc", "http")
        answer: Any = xmlrpc.client.ServerProxy(master).registerService(
            "/stand_in", name, self.uri, uri
        )
        assert answer[0] == 1, answer[1]

    def break_lines(self) -> None:
        """End all connections; new ones are welcome."""
        lines, self._lines = self._lines, []
        for line in lines:
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)
            line.close()

    def close(self) -> None:
        """End."""
        self.answers.set()
        self.greets.set()
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        self.break_lines()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                line, _ = self._listener.accept()
                self._lines.append(line)
                threading.Thread(target=self._serve, args=(line,), daemon=True).start()

    def _serve(self, line: socket.socket) -> None:
        with contextlib.suppress(OSError):
            header = read_block(line)
            self.greets.wait()
            fields = {"type": self._kind._type, "md5sum": self._kind._md5sum, "callerid": "/n"}
            parts = [f"{key}={value}".encode() for key, value in fields.items()]
            self.connections += 1  # before the greeting: who has been greeted may look at once
            line.sendall(_sized(b"".join(_sized(part) for part in parts)))
            while b"probe=1" not in header:
                request = self._kind._request_class()
                request.deserialize(read_block(line))
                self.heard.append(request.command)
                self.answers.wait()
                buffer = io.BytesIO()
                words = f"{request.command} was heard"
                self._kind._response_class(True, words, True).serialize(buffer)
                line.sendall(b"\x01" + _sized(buffer.getvalue()))


def _sized(block: bytes) -> bytes:
    return struct.pack("<I", len(block)) + block


def read_block(line: socket.socket) -> bytes:
    """Read one block with its length before it.

    Raises:
        ConnectionError: The other side is gone.
    """
    head = line.recv(4, socket.MSG_WAITALL)
    if len(head) < 4:
        raise ConnectionError
    (size,) = struct.unpack("<I", head)
    return line.recv(size, socket.MSG_WAITALL) if size else b""
