"""What goes out to one client: as much as it takes, and as its budget allows."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from websockets.asyncio.connection import broadcast

from rosbridge_gateway.config import GatewayConfig
from rosbridge_gateway.connection.line_io import Line
from rosbridge_gateway.protocol.latest import Outbox
from rosbridge_gateway.wire.outgoing import Frames

_DRAIN_POLL = 0.01


class Sending:
    """The outbox of a client and the timer that empties it, in the event loop's thread."""

    def __init__(self, line: Line, config: GatewayConfig, drop: Callable[[str], None]) -> None:
        """Take the connection, and what ends it with a reason."""
        limits = config.limits
        self.outbox = Outbox[Frames](
            limits.waiting_answers, limits.waiting_bytes, lambda frames: sum(map(len, frames.parts))
        )
        self._line, self._limits, self._drop = line, limits, drop
        self._stall_timeout = config.stall_timeout
        self._loop = asyncio.get_running_loop()
        self._timer: asyncio.TimerHandle | None = None
        # Since when a full buffer has not become shorter, and its length at the last look.
        self._full_since: float | None = None
        self._buffered = 0
        self._ended = False

    def answer(self, frames: Frames) -> None:
        """Send an answer, in order with the other answers."""
        if self.outbox.put_answer(frames):
            self.flush()
        else:
            self._drop(f"{self._limits.waiting_answers} answers wait and are not taken")

    def message(self, topic: str, frames: Frames) -> None:
        """Send a topic's message, or keep it as its newest."""
        self.outbox.put_message(topic, frames, time.monotonic())
        self.flush()

    def flush(self) -> None:
        """Send what may go out now; come back when more may."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._ended:
            return
        wait = self._line.wait_to_send()
        if wait:  # what a client hears counts too; newer messages take the place of what waits
            self._timer = self._loop.call_later(wait, self.flush)
            return
        with self._line.charged():
            self._send(time.monotonic())

    def end(self) -> None:
        """Send nothing any more."""
        self._ended = True
        if self._timer is not None:
            self._timer.cancel()

    def _send(self, now: float) -> None:
        transport = self._line.transport
        while (size := transport.get_write_buffer_size()) < self._limits.send_buffer_bytes:
            self._full_since = None
            frames = self.outbox.pop(now)
            if frames is None:
                due = self.outbox.next_due()
                if due is not None:
                    self._timer = self._loop.call_later(max(due - now, 0.0), self.flush)
                return
            for part in frames.parts:
                broadcast([self._line], part, text=frames.is_text)
        # One that takes may stay, however slow it is: the outbox bounds what waits for it, and
        # the buffer gets nothing more before it is short again.
        if self._full_since is None or size < self._buffered:
            self._full_since = now
        self._buffered = size
        if now - self._full_since > self._stall_timeout:
            self._drop(f"took nothing for {self._stall_timeout:g} s")
            return
        self._timer = self._loop.call_later(_DRAIN_POLL, self.flush)
