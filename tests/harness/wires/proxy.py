"""A TCP relay between a client and a server that fails in every way in which a network does.

``Proxy(target)`` listens on a port of its own and relays to ``target``. While it runs::

    proxy.cut()              # all connections end at once
    proxy.refuse(True)       # nobody listens any more
    proxy.freeze(True)       # half-open: connections stand, new ones are accepted, nothing passes
    proxy.fault = Delayed(0.05)          # every unit; what a unit is says ``units``
    proxy.fault = Both(Corrupted(rng, 0.01), Split())

A unit is what one ``recv`` returned, or one Modbus ADU (``modbus_units``), or one web-socket frame
(``websocket_units``).
"""

from __future__ import annotations

import contextlib
import heapq
import itertools
import socket
import struct
import threading
import time
from collections.abc import Callable

from typing_extensions import Self

from harness.wires.damage import Fault, Piece, passed

Units = Callable[[bytearray], list[bytes]]


def chunks(buffer: bytearray) -> list[bytes]:
    """Take what is there as one unit."""
    whole = [bytes(buffer)]
    buffer.clear()
    return whole


def modbus_units(buffer: bytearray) -> list[bytes]:
    """Take all complete Modbus TCP ADUs out of ``buffer``."""
    units = []
    while len(buffer) >= 6 and len(buffer) >= (size := 6 + int.from_bytes(buffer[4:6], "big")):
        units.append(bytes(buffer[:size]))
        del buffer[:size]
    return units


def websocket_units(buffer: bytearray) -> list[bytes]:
    """Take the handshake and all complete web-socket frames out of ``buffer``."""
    units = []
    if bytes(buffer[:4]) in (b"GET ", b"HTTP") and b"\r\n\r\n" in buffer:
        size = buffer.index(b"\r\n\r\n") + 4
        units.append(bytes(buffer[:size]))
        del buffer[:size]
    while (size := _frame_size(buffer)) and len(buffer) >= size:
        units.append(bytes(buffer[:size]))
        del buffer[:size]
    return units


def _frame_size(buffer: bytearray) -> int:
    """Return the bytes of the first frame, 0 while unknown (RFC 6455 sec. 5.2)."""
    if len(buffer) < 10 and (len(buffer) < 2 or buffer[1] & 0x7F >= 126):
        return 0
    if bytes(buffer[:4]) in (b"GET ", b"HTTP"):
        return 0
    length, header = buffer[1] & 0x7F, 2
    if length >= 126:
        width = 2 if length == 126 else 8
        length, header = int.from_bytes(buffer[2 : 2 + width], "big"), 2 + width
    return header + (4 if buffer[1] & 0x80 else 0) + length


class Proxy:
    """A relay on 127.0.0.1; a context manager.

    Attributes:
        port: Where clients connect to.
        fault: What happens to each unit; ``passed`` lets it through.
    """

    def __init__(self, target: int, units: Units = chunks) -> None:
        """Listen on a port of its own for clients of the server on ``target``."""
        self.target, self.fault = target, passed
        self._units = units
        # A connection that is being made while another thread cuts is cut too.
        self._lock, self._cuts = threading.Lock(), 0
        self._lines: list[_Line] = []
        self._moving = threading.Event()
        self._moving.set()
        self._listener: socket.socket | None = None
        self.port = 0
        self._listen()

    fault: Fault

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def connections(self) -> int:
        """How many connections stand."""
        return sum(line.open for line in self._lines.copy())

    def cut(self, reset: bool = False) -> float:
        """End all connections; ``reset`` without a farewell. Return when (monotonic)."""
        now = time.monotonic()
        with self._lock:
            self._cuts += 1
            lines, self._lines = self._lines, []
        for line in lines:
            line.close(reset)
        return now

    def refuse(self, on: bool) -> float:
        """Stop listening and cut, or listen again on the same port."""
        with self._lock:
            listener, self._listener = self._listener, None
        if listener is not None:
            _end(listener)
        if on:
            return self.cut()
        self._listen()
        return time.monotonic()

    def freeze(self, on: bool) -> float:
        """Let nothing pass, not even an end of connection; or let all pass that has waited.

        Return when.
        """
        now = time.monotonic()
        (self._moving.clear if on else self._moving.set)()
        return now

    def heal(self) -> None:
        """End the faults; connections that stand go on."""
        self.fault = passed
        self._moving.set()

    def close(self) -> None:
        """Stop listening and end all connections."""
        self._moving.set()
        self.refuse(True)

    def _listen(self) -> None:
        listener = socket.create_server(("127.0.0.1", self.port), backlog=64)
        self.port = listener.getsockname()[1]
        self._listener = listener
        threading.Thread(target=self._accept, args=(listener,), daemon=True).start()

    def _accept(self, listener: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _ = listener.accept()
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                made = (client, listener, self._cuts)
                threading.Thread(target=self._connect, args=made, daemon=True).start()

    def _connect(self, client: socket.socket, listener: socket.socket, cuts: int) -> None:
        self._moving.wait()
        try:
            server = socket.create_connection(("127.0.0.1", self.target))
        except OSError:
            _end(client)
            return
        server.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        line = _Line(self, client, server)
        with self._lock:
            stands = self._listener is listener and self._cuts == cuts
            self._lines = [old for old in self._lines if old.open]
            if stands:
                self._lines.append(line)
        if stands:
            line.start()
        else:
            line.close(reset=False)

    def carry(
        self, source: socket.socket, put: Callable[[list[Piece]], None], answers: bool
    ) -> None:
        """Read units from ``source`` and hand on what the fault makes of them, until its end."""
        buffer = bytearray()
        while True:
            self._moving.wait()
            data = source.recv(65536)
            self._moving.wait()
            buffer += data
            units = self._units(buffer) if data else [bytes(buffer)]
            for unit in units:
                put(self.fault(unit, answers) if unit else [])
            if not data:
                return

    def wait_moving(self) -> None:
        """Wait while the relay is frozen."""
        self._moving.wait()


class _Line:
    """One relayed connection: a reader and a writer for each direction."""

    def __init__(self, proxy: Proxy, client: socket.socket, server: socket.socket) -> None:
        self._proxy, self._sockets, self.open = proxy, (client, server), True

    def start(self) -> None:
        """Relay in both directions."""
        client, server = self._sockets
        for source, sink, answers in ((client, server, False), (server, client, True)):
            outbox = _Outbox(self._proxy, sink)
            threading.Thread(target=self._read, args=(source, outbox, answers), daemon=True).start()
            threading.Thread(target=outbox.write, daemon=True).start()

    def _read(self, source: socket.socket, outbox: _Outbox, answers: bool) -> None:
        with contextlib.suppress(OSError):
            self._proxy.carry(source, outbox.put, answers)
        outbox.put(None)
        self.open = False

    def close(self, reset: bool) -> None:
        """End both sides."""
        self.open = False
        for line in self._sockets:
            if reset:
                with contextlib.suppress(OSError):
                    line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            _end(line, shutdown=not reset)


class _Outbox:
    """Pieces on their way, each with the time at which it is due."""

    def __init__(self, proxy: Proxy, sink: socket.socket) -> None:
        self._proxy, self._sink = proxy, sink
        self._due: list[tuple[float, int, bytes | None]] = []
        self._numbers = itertools.count()
        self._changed = threading.Condition()

    def put(self, pieces: list[Piece] | None) -> None:
        """Add pieces; None is the end, after all of them."""
        now = time.monotonic()
        with self._changed:
            if pieces is None:
                heapq.heappush(
                    self._due,
                    (max([now, *(due for due, _, _ in self._due)]), next(self._numbers), None),
                )
            for delay, data in pieces or []:
                heapq.heappush(self._due, (now + delay, next(self._numbers), data))
            self._changed.notify()

    def write(self) -> None:
        """Send what is due, in the order in which it is due."""
        with contextlib.suppress(OSError):
            while (data := self._next()) is not None:
                self._proxy.wait_moving()
                self._sink.sendall(data)
        _end(self._sink)

    def _next(self) -> bytes | None:
        with self._changed:
            while True:
                left = self._due[0][0] - time.monotonic() if self._due else None
                if left is not None and left <= 0.0:
                    return heapq.heappop(self._due)[2]
                self._changed.wait(left)


def _end(line: socket.socket, shutdown: bool = True) -> None:
    if shutdown:
        with contextlib.suppress(OSError):
            line.shutdown(socket.SHUT_RDWR)
    line.close()
