"""The twin's link: a rosbridge v2 client that connects by itself, again and again, and never blocks its owner."""

from __future__ import annotations

import contextlib
import dataclasses
import logging
import socket
import threading
import time
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Self

import msgspec
from websocket import ABNF, WebSocket, WebSocketBadStatusException, WebSocketException, WebSocketTimeoutException

from twin_controller.io.rosbridge_calls import Answer, OnAnswer, PendingCalls

OnMessage = Callable[[str, dict[str, Any], float], None]
OnChange = Callable[[bool, str], None]
OnStatus = Callable[[str, str], None]

_LOG = logging.getLogger("rosout.rosbridge_link")
_CLOSE_TIMEOUT = 0.2
_PING_PART = 0.4
_WAKE_PART = 0.2


@dataclasses.dataclass(frozen=True, slots=True)
class LinkSettings:
    """Times of a link [s].

    Attributes:
        silent_timeout: A peer of which nothing comes for so long, not even a pong, is taken for dead.
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


@dataclasses.dataclass(slots=True)
class LinkCounters:
    """What went over the link since its start."""

    sent: int = 0
    received: int = 0
    rejected: int = 0
    refused: int = 0
    connects: int = 0
    callback_errors: int = 0


class _Packet(msgspec.Struct):
    """Any packet that a rosbridge server sends."""

    op: str
    id: Any = None
    topic: str = ""
    msg: Any = None
    values: Any = None
    result: bool = True
    level: str = ""


_DECODER = msgspec.json.Decoder(_Packet)
_ENCODER = msgspec.json.Encoder()


class RosbridgeLink:
    """A connection to a rosbridge server; a context manager.

    The callbacks come from the link's own thread, one after the other. Subscriptions and advertisements are
    remembered and sent at each connect. ``null`` in a message (NaN in ROS) arrives as None.
    """

    def __init__(
        self,
        url: str,
        on_message: OnMessage,
        on_change: OnChange,
        on_status: OnStatus | None = None,
        token: str | None = None,
        settings: LinkSettings | None = None,
    ) -> None:
        """Prepare; ``start`` connects.

        Args:
            url: ``ws://host:port``.
            on_message: Called with topic, message and when it was received (monotonic, [s]).
            on_change: Called with connected and why not; on failing attempts only when the reason changes.
            on_status: Called with level and text when the server remarks on what we sent.
            token: Sent to a server that asks for one.
            settings: Times.
        """
        self.counters = LinkCounters()
        self._url = url
        self._on_message = on_message
        self._on_change = on_change
        self._on_status = on_status
        self._headers = [f"Authorization: Bearer {token}"] if token else []
        self._settings = settings or LinkSettings()
        self._standing: dict[tuple[str, str], dict[str, Any]] = {}
        self._calls = PendingCalls()
        self._line: WebSocket | None = None
        self._drop_reason = ""
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="rosbridge_link", daemon=True)

    @property
    def connected(self) -> bool:
        """Tell whether packets can be sent now."""
        return self._line is not None

    def start(self) -> None:
        """Begin to connect."""
        self._thread.start()

    def close(self) -> None:
        """End the connection with a close frame, and the thread; no callback comes afterwards."""
        self._stop.set()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def subscribe(self, topic: str, type_name: str, throttle_ms: int = 0, queue_length: int = 1) -> None:
        """Receive ``topic`` from now on, at every connect anew."""
        wish = {"op": "subscribe", "topic": topic, "type": type_name}
        self._stand("subscribe", topic, wish | {"throttle_rate": throttle_ms, "queue_length": queue_length})

    def advertise(self, topic: str, type_name: str, latch: bool = False) -> None:
        """Announce that ``topic`` will be published, at every connect anew."""
        self._stand("advertise", topic, {"op": "advertise", "topic": topic, "type": type_name, "latch": latch})

    def publish(self, topic: str, message: Mapping[str, Any]) -> bool:
        """Send a message; NaN goes as ``null``. False when it could not be sent; the link is dropped then."""
        return self._send({"op": "publish", "topic": topic, "msg": message})

    def call_service(self, service: str, args: Mapping[str, Any], callback: OnAnswer, timeout: float) -> bool:
        """Call a service; the answer comes to ``callback``.

        Args:
            service: Name.
            args: Request fields.
            callback: Called once with result, values (the reason in words when result is False), when the answer was
                received and when the call was sent (both monotonic, [s]).
            timeout: Without an answer for so long [s] the callback gets False and a text.

        Returns:
            False when the call could not be sent; the callback is not called then.
        """
        call_id = self._calls.add(service, callback, timeout)
        packet = {"op": "call_service", "id": call_id, "service": service, "args": args, "timeout": timeout}
        return self._send(packet) or not self._calls.withdraw(call_id)

    def _stand(self, kind: str, topic: str, packet: dict[str, Any]) -> None:
        """Remember a packet for each connect, and send it now if there is a connection."""
        with self._lock:
            self._standing[kind, topic] = packet
        self._send(packet)

    def _send(self, packet: Mapping[str, Any]) -> bool:
        line = self._line
        if line is None:
            return False
        try:
            line.send(_ENCODER.encode(packet), ABNF.OPCODE_TEXT)
        except (OSError, WebSocketException) as error:
            self._drop(line, f"sending failed: {_text(error)}")
            return False
        self.counters.sent += 1
        return True

    def _drop(self, line: WebSocket, reason: str) -> None:
        """Give up a connection; the link's thread notices at once."""
        with self._lock:
            if self._line is line:
                self._line = None
                self._drop_reason = reason
        if line.sock is not None:
            with contextlib.suppress(OSError):
                line.sock.shutdown(socket.SHUT_RDWR)

    def _run(self) -> None:
        """Connect, receive until the connection ends, and again."""
        pause, told = self._settings.retry_first, None
        while not self._stop.is_set():
            try:
                line = self._connect()
            except (OSError, WebSocketException, ValueError) as error:
                reason = f"{self._url}: {_text(error)}"
                if reason != told:
                    self._guard(self._on_change, False, reason)
                told = reason
            else:
                pause, told = self._settings.retry_first, None
                reason = self._serve(line)
                self._tell(self._calls.abandon(f"link lost: {reason}"))
                if not self._stop.is_set():
                    self._guard(self._on_change, False, f"{self._url}: {reason}")
            self._stop.wait(pause)
            pause = min(2.0 * pause, self._settings.retry_last)

    def _connect(self) -> WebSocket:
        line = WebSocket(
            sockopt=[(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)], skip_utf8_validation=True, enable_multithread=True
        )
        line.settimeout(self._settings.connect_timeout)
        line.connect(  # type: ignore[no-untyped-call]
            self._url, header=self._headers, suppress_origin=True, http_no_proxy=["*"], redirect_limit=0
        )
        line.settimeout(min(self._settings.send_timeout, _WAKE_PART * self._settings.silent_timeout))
        return line

    def _serve(self, line: WebSocket) -> str:
        """Use a connection until it ends; return why it did."""
        with self._lock:
            self._line, self._drop_reason = line, ""
            standing = list(self._standing.values())
        self.counters.connects += 1
        try:
            if all([self._send(packet) for packet in standing]):
                self._guard(self._on_change, True, "")
                self._receive(line)
            reason = self._drop_reason
        except (OSError, WebSocketException) as error:
            reason = self._drop_reason or _text(error)
        finally:
            with self._lock:
                self._line = None
        if self._stop.is_set():
            with contextlib.suppress(OSError, WebSocketException):
                line.close(timeout=_CLOSE_TIMEOUT)
        line.shutdown()  # type: ignore[no-untyped-call]
        return reason

    def _receive(self, line: WebSocket) -> None:
        """Hand on what comes; ask a silent peer for a sign of life, and drop it when none comes."""
        heard = asked = time.monotonic()
        while self._line is line and not self._stop.is_set():
            try:
                opcode, frame = line.recv_data_frame(control_frame=True)
            except WebSocketTimeoutException:
                now = time.monotonic()
                if now - heard > self._settings.silent_timeout:
                    self._drop(line, f"silent for {self._settings.silent_timeout:g} s")
                elif now - max(heard, asked) > _PING_PART * self._settings.silent_timeout:
                    asked = now
                    line.ping()
            else:
                heard = now = time.monotonic()
                if opcode == ABNF.OPCODE_CLOSE:
                    self._drop(line, f"closed by the server: {frame.data[2:].decode('utf-8', 'replace')}".rstrip(": "))
                elif opcode in (ABNF.OPCODE_TEXT, ABNF.OPCODE_BINARY):
                    self._take(frame.data, heard)
            self._tell(self._calls.expired(now))

    def _take(self, data: bytes, received: float) -> None:
        """Hand one packet to its callback; what is no packet is counted."""
        try:
            packet = _DECODER.decode(data)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
            self.counters.rejected += 1
            return
        if packet.op == "publish" and isinstance(packet.msg, dict):
            self.counters.received += 1
            self._guard(self._on_message, packet.topic, packet.msg, received)
        elif packet.op == "service_response":
            self._answered(packet, received)
        elif packet.op == "status":
            self.counters.refused += packet.level == "error"
            if self._on_status is not None:
                self._guard(self._on_status, packet.level, str(packet.msg))
        else:
            self.counters.rejected += 1

    def _answered(self, packet: _Packet, received: float) -> None:
        answer = self._calls.answered(packet.id, packet.result, packet.values, received)
        if answer is None:
            self.counters.rejected += 1
            return
        self.counters.received += 1
        self._tell([answer])

    def _tell(self, answers: list[Answer]) -> None:
        for callback, *args in answers:
            self._guard(callback, *args)

    def _guard(self, callback: Callable[..., None], *args: Any) -> None:
        """Call the owner; an error of its is counted and logged, the link lives on."""
        try:
            callback(*args)
        except Exception:
            self.counters.callback_errors += 1
            _LOG.exception("a callback of the link to %s failed", self._url)


def _text(error: Exception) -> str:
    """Say an error in few words: a refused handshake with the server's own."""
    if isinstance(error, WebSocketBadStatusException):
        body = error.resp_body.decode("utf-8", "replace").strip() if isinstance(error.resp_body, bytes) else ""
        return f"refused with HTTP {error.status_code}: {body[:200]}".rstrip(": ")
    return str(error) or type(error).__name__
