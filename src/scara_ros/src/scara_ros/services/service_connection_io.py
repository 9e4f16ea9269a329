"""One connection to a ROS service over TCPROS with deadlines, which rospy's proxy does not have."""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from collections.abc import Callable
from io import BytesIO
from urllib.parse import urlparse

from rosgraph.network import (
    ROSHandshakeException,
    read_ros_handshake_header,
    write_ros_handshake_header,
)
from typing_extensions import Self

_ANY_TYPE = "*"
_HEADER_BYTES = 4096


class ServiceError(RuntimeError):
    """The service cannot be called, or answered with an error; the text says which."""


class ServiceTimeoutError(ServiceError):
    """The service did not answer in time."""


class ServiceMissingError(ServiceError):
    """No service of that name is known."""


class ServiceConnection:
    """A connection to one service; a context manager.

    ``close`` may come from another thread and ends a waiting call.
    """

    def __init__(
        self,
        service: str,
        uri: str,
        caller_id: str,
        timeout: float,
        md5sum: str | None = None,
        keep: bool = False,
        begun: float | None = None,
    ) -> None:
        """Connect.

        Args:
            service: Absolute name.
            uri: ``rosrpc://host:port`` as the master tells it.
            caller_id: Name of this node.
            timeout: Of connecting and calling together [s].
            md5sum: Of the type that the caller will send; None: only ask for the type.
            keep: Ask the service to leave the connection open for more than one call.
            begun: Since when the time-out counts, by the monotonic clock [s]; None: now.

        Raises:
            ServiceError: The service's node cannot be reached or refuses.
        """
        self._service = service
        self._timeout = timeout
        self._deadline = (time.monotonic() if begun is None else begun) + timeout
        address = urlparse(uri)
        try:
            self._socket = socket.create_connection(
                (address.hostname or "", address.port or 0), self._left()
            )
        except OSError as error:
            raise ServiceError(
                f"service {service} cannot be reached at {uri}: {error.strerror or error}"
            ) from error
        # A probe takes any type: it asks only who is there, and which type that has.
        asked = {"md5sum": _ANY_TYPE, "probe": "1"} if md5sum is None else {"md5sum": md5sum}
        if keep:
            asked["persistent"] = "1"
        self.type = self._shake_hands({"service": service, "callerid": caller_id} | asked)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _shake_hands(self, fields: dict[str, str]) -> str:
        """Exchange the headers; return the name of the service's type."""
        try:
            # A request is small and waits for its answer: to collect more of it would only delay
            # it.
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            write_ros_handshake_header(self._socket, fields)
            header = read_ros_handshake_header(self._socket, BytesIO(), _HEADER_BYTES)
            if "error" not in header:
                return str(header["type"])
        except (OSError, ROSHandshakeException, KeyError) as error:
            self.close()
            raise self._failed(error) from error
        self.close()
        raise ServiceError(f"service {self._service} refuses: {header['error']}")

    def call(
        self,
        request: bytes,
        timeout: float | None = None,
        alive: Callable[[], bool] | None = None,
        sent: Callable[[], None] | None = None,
    ) -> bytes:
        """Send a serialised request, return the serialised response.

        Args:
            request: Without its length.
            timeout: Of this call [s]; None: what the connection's own has left.
            alive: For calls of unknown length. It is asked each time that the time-out passes;
                the call goes on for another one as long as it says yes.
            sent: Called once the request has been sent.

        Raises:
            ServiceTimeoutError: The time-out passed.
            ServiceError: The connection ended, or the service answered with an error.
        """
        if timeout is not None:
            self._timeout, self._deadline = timeout, time.monotonic() + timeout
        try:
            self._socket.settimeout(self._left())
            self._socket.sendall(struct.pack("<I", len(request)) + request)
            if sent is not None:
                sent()
            ok, size = struct.unpack("<BI", self._read(5, alive))
            body = self._read(size, alive)
        except OSError as error:
            raise self._failed(error) from error
        if not ok:
            raise ServiceError(f"service {self._service} failed: {body.decode('utf-8', 'replace')}")
        return body

    def is_open(self) -> bool:
        """Return whether the service still holds its end; between calls it sends nothing."""
        try:
            self._socket.setblocking(False)
            self._socket.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return True
        except OSError:
            return False
        return False  # its end was closed, or it sent what nobody asked for

    def close(self) -> None:
        """End the connection, also under a waiting call."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()

    def _read(self, count: int, alive: Callable[[], bool] | None) -> bytes:
        parts = bytearray()
        while len(parts) < count:
            self._socket.settimeout(self._left())
            try:
                # Not more at a time, however long the answer says it is: the length is the other
                # side's word.
                part = self._socket.recv(min(count - len(parts), 1 << 16))
            except TimeoutError:
                if alive is None or not alive():
                    raise
                self._deadline = time.monotonic() + self._timeout
                continue
            if not part:
                raise ConnectionResetError("the connection ended before the answer")
            parts += part
        return bytes(parts)

    def _left(self) -> float:
        return max(self._deadline - time.monotonic(), 1e-3)

    def _failed(self, error: Exception) -> ServiceError:
        if isinstance(error, TimeoutError):
            return ServiceTimeoutError(
                f"service {self._service} did not answer within {self._timeout:g} s"
            )
        return ServiceError(f"service {self._service} broke off: {error}")
