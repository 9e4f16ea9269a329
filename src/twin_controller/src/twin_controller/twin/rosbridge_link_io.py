"""A rosbridge v2 client that connects by itself, again and again, and never blocks its owner."""

from __future__ import annotations

import dataclasses
import logging
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from typing_extensions import Self

from twin_controller.twin.rosbridge import (
    Packet,
    Wishes,
    advertisement,
    decode,
    encode,
    publication,
    service_call,
    subscription,
)
from twin_controller.twin.rosbridge_access_io import Access, shown
from twin_controller.twin.rosbridge_calls_io import OnAnswer, PendingCalls
from twin_controller.twin.rosbridge_socket_io import (
    LinkSettings,
    RosbridgeSocket,
    TwinLinkLostError,
)

OnMessage = Callable[[str, dict[str, Any], float], None]
OnChange = Callable[[bool, str], None]
OnStatus = Callable[[str, str], None]

_LOG = logging.getLogger("rosout.rosbridge_link")


@dataclasses.dataclass(slots=True)
class LinkCounters:
    """What went over the link since its start."""

    sent: int = 0
    received: int = 0
    rejected: int = 0
    refused: int = 0
    connects: int = 0
    callback_errors: int = 0


class RosbridgeLink:
    """A connection to a rosbridge server; a context manager.

    The callbacks come from the link's own thread, one after the other. Subscriptions and
    advertisements are remembered and sent at each connect. ``null`` in a message (NaN in ROS)
    arrives as None.
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
            on_change: Called with connected and why not; on failing attempts only when the reason
                changes.
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
        self._wishes = Wishes()
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

    def __exit__(self, *_: object) -> None:
        self.close()

    def subscribe(
        self, topic: str, type_name: str, throttle_ms: int = 0, queue_length: int = 1
    ) -> None:
        """Receive ``topic`` from now on, at every connect anew."""
        self._stand(subscription(topic, type_name, throttle_ms, queue_length))

    def advertise(self, topic: str, type_name: str, latch: bool = False) -> None:
        """Announce that ``topic`` will be published, at every connect anew."""
        self._stand(advertisement(topic, type_name, latch))

    def publish(self, topic: str, message: Mapping[str, Any]) -> bool:
        """Send a message; NaN goes as ``null``.

        Returns:
            False when it could not be sent; the link is dropped then.
        """
        return self._send(publication(topic, message))

    def call_service(
        self, service: str, args: Mapping[str, Any], callback: OnAnswer, timeout: float
    ) -> bool:
        """Call a service; the answer comes to ``callback``.

        Args:
            service: Name.
            args: Request fields.
            callback: Called once with result, values (or why there are none), when the answer was
                received and when the call was sent (both monotonic, [s]).
            timeout: Without an answer for so long [s] the callback gets False and a text.

        Returns:
            False when the call could not be sent; the callback is not called then.
        """
        call_id = self._calls.add(service, callback, timeout)
        packet = service_call(call_id, service, args, timeout)
        return self._send(packet) or not self._calls.withdraw(call_id)

    def drop(self, reason: str) -> None:
        """Give the connection up: what comes over it cannot be true. The next one begins anew."""
        line = self._line
        if line is not None:
            self._drop(line, reason)

    def _stand(self, wish: Packet) -> None:
        """Remember a wish for each connect, and send it now if there is a connection."""
        with self._lock:
            self._wishes.add(wish)
        self._send(wish)

    def _send(self, packet: Mapping[str, Any]) -> bool:
        line = self._line
        if line is None:
            return False
        try:
            line.send(encode(packet))
        except TwinLinkLostError as error:
            self._drop(line, str(error))
            return False
        self.counters.sent += 1
        return True

    def _drop(self, line: RosbridgeSocket, reason: str) -> None:
        """Give up a connection; the link's thread notices at once."""
        with self._lock:
            # The link's thread may have a new connection by now, which is not the one to drop.
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
            except TwinLinkLostError as error:
                if str(error) != told:
                    told = str(error)
                    self._guard(self._on_change, False, f"{self._shown}: {told}")
            else:
                pause, told = self._settings.retry_first, None
                reason = self._serve(line)
                for answer in self._calls.abandon(f"link lost: {reason}"):
                    self._guard(*answer)
                if not self._stop.is_set():
                    self._guard(self._on_change, False, f"{self._shown}: {reason}")
            self._stop.wait(pause)
            pause = min(2.0 * pause, self._settings.retry_last)

    def _serve(self, line: RosbridgeSocket) -> str:
        """Use a connection until it ends; return why it did."""
        with self._lock:
            self._line, self._drop_reason = line, ""
            standing = self._wishes.begin()
        self.counters.connects += 1
        reason = ""
        try:
            if all([self._send(packet) for packet in standing]):
                self._guard(self._on_change, True, "")
            while self._line is line and not self._stop.is_set():
                packet = line.receive()
                if packet is not None:
                    self._take(*packet)
                for answer in self._calls.expired(time.monotonic()):
                    self._guard(*answer)
                for wish in self._wishes.due(time.monotonic()):
                    self._send(wish)
        except TwinLinkLostError as error:
            reason = str(error)
        with self._lock:
            self._line = None
            # Who drops a connection knows why; the reader sees only that it has ended.
            reason = self._drop_reason or reason
        line.close(politely=self._stop.is_set())
        return reason

    def _take(self, data: bytes, received: float) -> None:
        """Hand one packet to its callback; what is no packet is counted."""
        packet = decode(data)
        if packet is None:
            self.counters.rejected += 1
            return
        if packet.op == "publish" and isinstance(packet.msg, dict):
            self.counters.received += 1
            self._guard(self._on_message, packet.topic, packet.msg, received)
        elif packet.op == "service_response":
            answer = self._calls.answered(packet.id, packet.result, packet.values, received)
            if answer is None:
                self.counters.rejected += 1
            else:
                self.counters.received += 1
                self._guard(*answer)
        elif packet.op == "status":
            self.counters.refused += packet.level == "error"
            if packet.level == "error":
                self._wishes.refuse(packet.id, received)
            if self._on_status is not None:
                self._guard(self._on_status, packet.level, str(packet.msg))
        else:
            self.counters.rejected += 1

    def _guard(self, callback: Callable[..., None], *args: Any) -> None:
        """Call the owner; an error of its is counted and logged, the link lives on."""
        try:
            callback(*args)
        except Exception:
            self.counters.callback_errors += 1
            _LOG.exception("a callback of the link to %s failed", self._shown)
