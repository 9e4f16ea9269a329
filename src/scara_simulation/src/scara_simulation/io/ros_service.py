"""One call of a ROS service over TCPROS with a time-out, which rospy's proxy does not have."""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from io import BytesIO
from types import TracebackType
from typing import Self
from urllib.parse import urlparse

from rosgraph.network import ROSHandshakeException, read_ros_handshake_header, write_ros_handshake_header

_ANY_TYPE = "*"
_HEADER_BYTES = 4096


class ServiceCallError(RuntimeError):
    """The service did not answer, or answered with an error; the text says which."""


class ServiceLine:
    """A connection to one service for one call; a context manager.

    ``close`` may come from another thread and ends a waiting call.
    """

    def __init__(self, service: str, uri: str, caller_id: str, timeout: float, md5sum: str | None = None) -> None:
        """Connect.

        Args:
            service: Absolute name.
            uri: ``rosrpc://host:port`` as the master tells it.
            caller_id: Name of this node.
            timeout: Of connecting and calling together [s].
            md5sum: Of the type that the caller will send; None: only ask for the type.

        Raises:
            ServiceCallError: The service's node cannot be reached or refuses.
        """
        self._service = service
        self._timeout = timeout
        self._deadline = time.monotonic() + timeout
        address = urlparse(uri)
        try:
            self._socket = socket.create_connection((address.hostname or "", address.port or 0), self._left())
        except OSError as error:
            raise ServiceCallError(f"service {service} cannot be reached at {uri}: {error.strerror or error}") from error
        try:
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            asked = {"md5sum": _ANY_TYPE, "probe": "1"} if md5sum is None else {"md5sum": md5sum}
            write_ros_handshake_header(self._socket, {"service": service, "callerid": caller_id} | asked)
            header = read_ros_handshake_header(self._socket, BytesIO(), _HEADER_BYTES)
            if "error" in header:
                self.close()
                raise ServiceCallError(f"service {service} refuses: {header['error']}")
            self.type: str = header["type"]
        except (OSError, ROSHandshakeException, KeyError) as error:
            self.close()
            raise self._failed(error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def call(self, request: bytes) -> bytes:
        """Send a serialised request, return the serialised response.

        Raises:
            ServiceCallError: The time-out passed, the connection ended, or the service answered with an error.
        """
        try:
            self._socket.settimeout(self._left())
            self._socket.sendall(struct.pack("<I", len(request)) + request)
            ok, size = struct.unpack("<BI", self._read(5))
            body = self._read(size)
        except OSError as error:
            raise self._failed(error) from error
        if not ok:
            raise ServiceCallError(f"service {self._service} failed: {body.decode('utf-8', 'replace')}")
        return body

    def close(self) -> None:
        """End the connection, also under a waiting call."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _read(self, count: int) -> bytes:
        parts = bytearray()
        while len(parts) < count:
            self._socket.settimeout(self._left())
            part = self._socket.recv(min(count - len(parts), 1 << 16))
            if not part:
                raise ConnectionResetError("the connection ended before the answer")
            parts += part
        return bytes(parts)

    def _left(self) -> float:
        return max(self._deadline - time.monotonic(), 1e-3)

    def _failed(self, error: Exception) -> ServiceCallError:
        if isinstance(error, TimeoutError):
            return ServiceCallError(f"service {self._service} did not answer within {self._timeout:g} s")
        return ServiceCallError(f"service {self._service} broke off: {error}")
