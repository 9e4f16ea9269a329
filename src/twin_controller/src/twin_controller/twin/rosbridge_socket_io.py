"""One web-socket connection: bounded sending, silent peers found, errors in few words."""

from __future__ import annotations

import contextlib
import dataclasses
import socket
import time

from websocket import (
    ABNF,
    WebSocket,
    WebSocketBadStatusException,
    WebSocketException,
    WebSocketTimeoutException,
)

from twin_controller.twin.rosbridge_access_io import Access, is_secure, tls_context

_CLOSE_TIMEOUT = 0.2
_PING_PART = 0.4
_WAKE_PART = 0.2


@dataclasses.dataclass(frozen=True, slots=True)
class LinkSettings:
    """Times of a link [s].

    Attributes:
        silent_timeout: A peer that sends nothing for this long, not even a pong, counts as dead.
        send_timeout: The longest that sending may block.
        connect_timeout: Of connecting, at each step of the handshake.
        retry_first: Pause before the first new attempt; doubled at each failure.
        retry_last: Longest pause.
    """

    silent_timeout: float = 0.25
    send_timeout: float = 0.05
    connect_timeout: float = 1.0
    retry_first: float = 0.1
    retry_last: float = 2.0


class TwinLinkLostError(RuntimeError):
    """The connection cannot be made, or has ended; the text says why."""


class RosbridgeSocket:
    """A connected web socket. One thread receives, any thread sends."""

    def __init__(self, url: str, access: Access, settings: LinkSettings) -> None:
        """Connect.

        Raises:
            TwinLinkLostError: Nobody there, refused, or the address is none.
        """
        self._settings = settings
        try:
            self._line = WebSocket(
                sockopt=[(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)],
                sslopt={"context": tls_context(access.ca_file)} if is_secure(url) else None,
                # decode() checks it; the library's own check goes byte by byte in Python.
                skip_utf8_validation=True,
                # With a lock: frames of several senders must not mix.
                enable_multithread=True,
            )
            self._line.settimeout(settings.connect_timeout)
            self._line.connect(  # type: ignore[no-untyped-call]
                url,
                header=access.headers,
                # An Origin says that a page asks, and a gateway judges that.
                suppress_origin=True,
                # The library would take a proxy from the environment.
                http_no_proxy=["*"],
                # Behind a redirect another server would get the token.
                redirect_limit=0,
            )
        except (OSError, WebSocketException, ValueError) as error:
            raise TwinLinkLostError(_text(error)) from error
        # One time-out for both: it bounds a send, and wakes the reader to look for a sign of life.
        self._line.settimeout(min(settings.send_timeout, _WAKE_PART * settings.silent_timeout))
        self._heard = self._asked = time.monotonic()

    def send(self, data: bytes) -> None:
        """Send a text packet.

        Raises:
            TwinLinkLostError: It could not be sent within the time allowed; the connection is of
                no use any longer.
        """
        try:
            self._line.send(data, ABNF.OPCODE_TEXT)
        except (OSError, WebSocketException) as error:
            raise TwinLinkLostError(f"sending failed: {_text(error)}") from error

    def receive(self) -> tuple[bytes, float] | None:
        """Return the next packet and when it came (monotonic, [s]); None: nothing for a moment.

        Raises:
            TwinLinkLostError: The peer closed, the connection broke, or nothing came for
                ``silent_timeout``.
        """
        try:
            # A ping or a pong is a sign of life, too.
            opcode, frame = self._line.recv_data_frame(control_frame=True)
            self._heard = time.monotonic()
        except WebSocketTimeoutException:
            self._look_for_life()
            return None
        except (OSError, WebSocketException) as error:
            raise TwinLinkLostError(_text(error)) from error
        if opcode == ABNF.OPCODE_CLOSE:
            raise TwinLinkLostError(
                f"closed by the server: {frame.data[2:].decode('utf-8', 'replace')}".rstrip(": ")
            )
        return (
            (frame.data, self._heard) if opcode in (ABNF.OPCODE_TEXT, ABNF.OPCODE_BINARY) else None
        )

    def _look_for_life(self) -> None:
        """Ask a quiet peer for a sign of life, give a silent one up."""
        now = time.monotonic()
        if now - self._heard > self._settings.silent_timeout:
            raise TwinLinkLostError(f"silent for {self._settings.silent_timeout:g} s")
        if now - max(self._heard, self._asked) > _PING_PART * self._settings.silent_timeout:
            self._asked = now
            try:
                self._line.ping()
            except (OSError, WebSocketException) as error:
                raise TwinLinkLostError(f"sending failed: {_text(error)}") from error

    def abort(self) -> None:
        """Break the connection off; a waiting ``receive`` notices at once."""
        # Looked at once: the reader forgets it when the line breaks.
        if (line := self._line.sock) is not None:
            # A close would not wake the thread that waits for a packet.
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)

    def close(self, politely: bool) -> None:
        """Free the socket, ``politely`` after a close frame."""
        if politely:
            with contextlib.suppress(OSError, WebSocketException):
                self._line.close(timeout=_CLOSE_TIMEOUT)
        self._line.shutdown()  # type: ignore[no-untyped-call]


def _text(error: Exception) -> str:
    """Say an error in few words: a refused handshake with the server's own."""
    if isinstance(error, WebSocketBadStatusException):
        body = (
            error.resp_body.decode("utf-8", "replace").strip()
            if isinstance(error.resp_body, bytes)
            else ""
        )
        return f"refused with HTTP {error.status_code}: {body[:200]}".rstrip(": ")
    return str(error) or type(error).__name__
