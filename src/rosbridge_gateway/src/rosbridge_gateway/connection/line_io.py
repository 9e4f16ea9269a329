"""A client's connection: read piece by piece, within a budget, and with the time of each packet."""

from __future__ import annotations

import asyncio
import contextlib
import selectors
import time
from collections import deque
from collections.abc import Iterator
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.frames import DATA_OPCODES, Frame

from rosbridge_gateway.protocol.rate import Budget

# Our choice: so many bytes are parsed in one turn of the loop. A piece full of the smallest frames
# takes some milliseconds; a piece as asyncio reads it, 256 kB, would hold the loop for 0.7 s.
_PIECE_BYTES = 2048
_FULL_BYTES = 65536  # our choice: after so long a piece more may wait in the socket
_LOOK_S = (
    0.01  # our choice: an idle loop looks at its sockets so often, to know when it stood still
)


class Poll(selectors.DefaultSelector):
    """A selector that knows since when what it reports may have waited.

    ``since`` (monotonic, [s]) is not later than the instant at which that came: the present if the
    loop was waiting for it, else when the loop last looked. So a packet that came while this
    process stood still has the time at which it stopped. ``turn`` counts looks.
    """

    def __init__(self) -> None:
        super().__init__()
        self.since = time.monotonic()
        self.turn = 0
        self._looked = self.since

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Wait for sockets, as any selector does."""
        self.turn += 1
        begun = now = time.monotonic()  # before we look: the process may stop right behind it
        ready = super().select(0.0)
        self.since = self._looked  # it was there when we looked: it may have come at once
        end = None if timeout is None else begun + timeout
        seen = now
        while not ready and (end is None or now < end):
            left = _LOOK_S if end is None else min(_LOOK_S, end - now)
            ready, looked = super().select(left), now
            now = time.monotonic()
            stood_still = now - looked > left + _LOOK_S
            if stood_still and not ready:  # its time was over, and nobody has looked
                ready = super().select(0.0)
            # What this look reports was found before it stood still, perhaps: what came meanwhile
            # is reported by the next one, and is as old.
            self.since = seen = looked if stood_still else now
        self._looked = seen
        return ready


class Line(ServerConnection):
    """A web-socket connection that takes no more of the loop than its budget allows.

    Beyond it nothing is refused: what comes next is read later. All times are monotonic [s].
    """

    def __init__(self, poll: Poll, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.budget: Budget | None = None
        """None until the client is known: a handshake is short."""
        self._poll = poll
        # Bytes that wait for their turn, each with the time at which it came.
        self._pieces: deque[tuple[bytes, float]] = deque()
        # When each packet came that was parsed and not taken yet: its age counts from there,
        # whatever waits in front of it.
        self._stamps: deque[float] = deque()
        self._stamp = 0.0
        # The library pauses reading for its queue, we for the budget: both have to agree.
        self._queue_is_full = False
        self._going_on: asyncio.Handle | None = None
        # Since when bytes may wait in the socket, and in which turn of the loop they then come.
        self._late_since: float | None = None
        self._late_turn = 0
        self._ended = self.loop.create_future()

    def taken_at(self) -> float:
        """Return when the packet that was received last had come; once for each packet."""
        return self._stamps.popleft()

    def packet(self) -> None:
        """Charge one packet."""
        if self.budget is not None:
            self.budget.packet(time.monotonic())

    @contextlib.contextmanager
    def charged(self) -> Iterator[None]:
        """Charge the processor time of what is done within."""
        begun = time.thread_time()
        try:
            yield
        finally:
            self.computed(time.thread_time() - begun)

    def computed(self, seconds: float) -> None:
        """Charge processor time [s]."""
        if self.budget is not None:
            self.budget.computed(seconds, time.monotonic())

    def wait(self) -> float:
        """Return after how long [s] there is time for this client again."""
        return 0.0 if self.budget is None else self.budget.wait(time.monotonic())

    def wait_to_send(self) -> float:
        """Return after how long [s] something may go out: packets that came do not count here."""
        return 0.0 if self.budget is None else self.budget.wait_for_cpu(time.monotonic())

    async def make_way(self) -> None:
        """Let the others have their turn; wait until there is time again, or until the end."""
        wait = self.wait()
        if wait and not self._ended.done():
            await asyncio.wait([self._ended], timeout=wait)
        else:
            await asyncio.sleep(0)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Stop reading in one place, whoever wants it."""
        super().connection_made(transport)
        self.recv_messages.pause = self._queue_filled
        self.recv_messages.resume = self._queue_emptied

    def data_received(self, data: bytes) -> None:
        """Note when bytes came; parse them in pieces."""
        stamp = self._poll.since
        if self._late_since is not None:
            if self._poll.turn <= self._late_turn + 1:
                stamp = min(stamp, self._late_since)
            self._late_since = None
        if len(data) >= _FULL_BYTES:  # there may be more, and it came as early
            self._late_since, self._late_turn = stamp, self._poll.turn
        if self.budget is not None:
            self.budget.received(len(data), time.monotonic())
        for start in range(0, len(data), _PIECE_BYTES):
            self._pieces.append((data[start : start + _PIECE_BYTES], stamp))
        if self._going_on is None:
            self._go_on()

    def process_event(self, event: Any) -> None:
        """Note when a packet was whole."""
        if isinstance(event, Frame) and event.opcode in DATA_OPCODES and event.fin:
            self._stamps.append(self._stamp)
        super().process_event(event)

    def send_data(self) -> None:
        """Write all that waits at once: a piece full of pings would be hundreds of writes."""
        waiting = self.protocol.data_to_send()
        at_end = b"" in waiting  # the protocol's word for the end of the stream
        if any(waiting) and not self.transport.is_closing():
            self.transport.write(b"".join(waiting))
        if not at_end:
            return
        if self.transport.can_write_eof():
            self.transport.write_eof()
        else:
            self.transport.close()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget what was not parsed yet: nobody waits for an answer to it."""
        if self._going_on is not None:
            self._going_on.cancel()
        self._pieces.clear()
        self._end()
        super().connection_lost(exc)

    def _go_on(self) -> None:
        """Parse one piece, then read on, wait for the next turn, or until there is time again."""
        self._going_on = None
        if self._pieces and not self._queue_is_full and not self.wait():
            piece, self._stamp = self._pieces.popleft()
            with self.charged():
                super().data_received(piece)
            if self.protocol.parser_exc is not None:
                # It broke the protocol: a word of why, and nothing more is read.
                self._pieces.clear()
                self._end()
                self.transport.pause_reading()
                self.loop.call_later(self.close_timeout or 0.0, self.transport.abort)
        if self._ended.done():
            return
        wait = self.wait()
        if not self._pieces and not wait and not self._queue_is_full:
            if not self.transport.is_closing():
                self._late_turn = self._poll.turn  # what has waited is there at the next look
                self.transport.resume_reading()
            return
        self._hold()
        if self._queue_is_full:
            return  # it goes on when the client's packets have been taken
        if wait:
            self._going_on = self.loop.call_later(wait, self._go_on)
        else:
            self._going_on = self.loop.call_soon(self._go_on)

    def _end(self) -> None:
        if not self._ended.done():
            self._ended.set_result(None)

    def _hold(self) -> None:
        if self._late_since is None:
            self._late_since = time.monotonic()
        self.transport.pause_reading()

    def _queue_filled(self) -> None:
        self._queue_is_full = True
        self._hold()

    def _queue_emptied(self) -> None:
        self._queue_is_full = False
        if self._going_on is None and not self._ended.done():
            self._going_on = self.loop.call_soon(self._go_on)
