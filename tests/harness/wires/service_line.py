"""A service's line on a bare socket: who calls knows when the request really left.

rospy looks up, connects and sends in one call; a node that stands still greets nobody, and a
request that has not been sent cannot be held against it.
"""

from __future__ import annotations

import io
import socket
import struct
import xmlrpc.client
from types import TracebackType
from typing import Any
from urllib.parse import urlsplit

from genpy.message import fill_message_args
from roslib.message import get_service_class
from typing_extensions import Self

CONNECT_S = 2.0


class ServiceLine:
    """One connection to a service; a context manager. :meth:`send`, then :meth:`answer`."""

    def __init__(
        self,
        master: str,
        service: str,
        kind: type[Any] | None,
        caller: str,
        patience: float = CONNECT_S,
    ) -> None:
        """Ask the master where the service is, connect, and wait for its greeting.

        Args:
            master: Its address.
            service: Its whole name.
            kind: Its class; None: the one that it names in its greeting.
            caller: The name of the node that calls.
            patience: For its greeting [s].

        Raises:
            OSError: It is not there, or does not greet.
        """
        found: Any = xmlrpc.client.ServerProxy(master).lookupService(caller, service)
        if found[0] != 1:
            raise ConnectionError(f"{service}: {found[1]}")
        where = urlsplit(found[2])
        self._socket = socket.create_connection((where.hostname, where.port), patience)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        md5sum = kind._md5sum if kind else "*"
        fields = {"callerid": caller, "service": service, "md5sum": md5sum}
        parts = [f"{key}={value}".encode() for key, value in fields.items()]
        try:
            self._socket.sendall(_sized(b"".join(_sized(part) for part in parts)))
            greeting = self._block()
        except OSError:
            self._socket.close()
            raise
        self._kind: Any = kind or get_service_class(_fields(greeting)["type"])

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the connection."""
        self._socket.close()

    def send(self, **fields: Any) -> None:
        """Send the request; a message in it may be given as its fields."""
        nested = {name: value for name, value in fields.items() if isinstance(value, (dict, list))}
        plain = {name: value for name, value in fields.items() if name not in nested}
        request = self._kind._request_class(**plain)
        fill_message_args(request, [nested])
        buffer = io.BytesIO()
        request.serialize(buffer)
        self._socket.sendall(_sized(buffer.getvalue()))

    def answer(self, timeout: float) -> Any:
        """Return the answer.

        Raises:
            OSError: None came within ``timeout`` [s], or the service has failed.
        """
        self._socket.settimeout(timeout)
        fine = self._take(1) == b"\x01"
        body = self._block()
        if not fine:
            raise ConnectionError(body.decode(errors="replace"))
        return self._kind._response_class().deserialize(body)

    def _block(self) -> bytes:
        (size,) = struct.unpack("<I", self._take(4))
        return self._take(size)

    def _take(self, size: int) -> bytes:
        data = b""
        while len(data) < size:
            part = self._socket.recv(size - len(data))
            if not part:
                raise ConnectionError("the service has hung up")
            data += part
        return data


def _fields(block: bytes) -> dict[str, str]:
    """Return the fields of a greeting; each has its size in front."""
    found = {}
    while block:
        (size,) = struct.unpack_from("<I", block)
        name, _, value = block[4 : 4 + size].decode().partition("=")
        found[name], block = value, block[4 + size :]
    return found


def _sized(block: bytes) -> bytes:
    return struct.pack("<I", len(block)) + block
