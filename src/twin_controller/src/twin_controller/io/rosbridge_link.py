"""The twin's link: a rosbridge v2 client that connects by itself, again and again, and never blocks its owner."""

from __future__ import annotations

import dataclasses
import logging
import threading
import time
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Self

import msgspec

from twin_controller.io.rosbridge_access import Access, shown
from twin_controller.io.rosbridge_calls import Answer, OnAnswer, PendingCalls
from twin_controller.io.rosbridge_socket import LinkLostError, LinkSettings, RosbridgeSocket

OnMessage = Callable[[str, dict[str, Any], float], None]
OnChange = Callable[[bool, str], None]
OnStatus = Callable[[str, str], None]

__all__ = ["LinkCounters", "LinkSettings", "RosbridgeLink"]

_LOG = logging.getLogger("rosout.rosbridge_link")
_AGAIN_S = 1.0  # our choice: a wish that the server refused, because its roscore is away, is sent again after this time


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
        access: Access | None = None,
        settings: LinkSettings | None = None,
    ) -> None:
        """Prepare; ``start`` connects.

        Args:
            url: ``ws://host:port`` or ``wss://host:port``.
            on_message: Called with topic, message and when it was received (monotonic, [s]).
            on_change: Called with connected and why not; on failing attempts only when the reason changes.
            on_status: Called with level and text when the server remarks on what we sent.
            access: What the server asks of us.
            settings: Times.
        """
        self.counters = LinkCounters()
        self._url = url
        self._on_message = on_message
        self._on_change = on_change
        self._on_status = on_status
        self._shown = shown(url)
        self._access = access or Access()
        self._settings = settings or LinkSettings()
        self._standing: dict[str, dict[str, Any]] = {}
        self._again: dict[str, float] = {}
        self._calls = PendingCalls()
        self._line: RosbridgeSocket | None = None
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

    def drop(self, reason: str) -> None:
        """Give the connection up, because what comes over it cannot be true; the next one begins anew."""
        line = self._line
        if line is not None:
            self._drop(line, reason)

    def _stand(self, kind: str, topic: str, packet: dict[str, Any]) -> None:
        """Remember a packet for each connect, and send it now if there is a connection."""
        packet["id"] = f"{kind}:{topic}"
        with self._lock:
            self._standing[packet["id"]] = packet
        self._send(packet)

    def _repeat(self, now: float) -> None:
        """Send those wishes again that were refused a while ago."""
        for wish in [wish for wish, due in self._again.items() if due <= now]:
            del self._again[wish]
            self._send(self._standing[wish])

    def _send(self, packet: Mapping[str, Any]) -> bool:
        line = self._line
        if line is None:
            return False
        try:
            line.send(_ENCODER.encode(packet))
        except LinkLostError as error:
            self._drop(line, str(error))
            return False
        self.counters.sent += 1
        return True

    def _drop(self, line: RosbridgeSocket, reason: str) -> None:
        """Give up a connection; the link's thread notices at once."""
        with self._lock:
            if self._line is line:
                self._line = None
                self._drop_reason = reason
        line.abort()

    def _run(self) -> None:
        """Connect, receive until the connection ends, and again."""
        pause, told = self._settings.retry_first, None
        while not self._stop.is_set():
            try:
                line = RosbridgeSocket(self._url, self._access, self._settings)
            except LinkLostError as error:
                if str(error) != told:
                    told = str(error)
                    self._guard(self._on_change, False, f"{self._shown}: {told}")
            else:
                pause, told = self._settings.retry_first, None
                reason = self._serve(line)
                self._tell(self._calls.abandon(f"link lost: {reason}"))
                if not self._stop.is_set():
                    self._guard(self._on_change, False, f"{self._shown}: {reason}")
            self._stop.wait(pause)
            pause = min(2.0 * pause, self._settings.retry_last)

    def _serve(self, line: RosbridgeSocket) -> str:
        """Use a connection until it ends; return why it did."""
        with self._lock:
            self._line, self._drop_reason = line, ""
            standing = list(self._standing.values())
        self._again = {}
        self.counters.connects += 1
        reason = ""
        try:
            if all([self._send(packet) for packet in standing]):
                self._guard(self._on_change, True, "")
            while self._line is line and not self._stop.is_set():
                packet = line.receive()
                if packet is not None:
                    self._take(*packet)
                self._tell(self._calls.expired(time.monotonic()))
                self._repeat(time.monotonic())
        except LinkLostError as error:
            reason = str(error)
        with self._lock:
            self._line = None
            reason = self._drop_reason or reason
        line.close(politely=self._stop.is_set())
        return reason

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
            if packet.level == "error" and isinstance(packet.id, str) and packet.id in self._standing:
                self._again[packet.id] = received + _AGAIN_S
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
            _LOG.exception("a callback of the link to %s failed", self._shown)
