"""Modbus TCP transactions on one connection: an answer is known by its number, not by its turn.

So one that is busy, late, lost or doubled costs no connection: what it was for is asked again under
a new number, and what nobody waits for any longer is dropped and counted. How long an answer is
waited for is learned from those that came (RFC 6298 sec. 2). Frames: MODBUS Messaging on TCP/IP
V1.0b sec. 3.1.3.
"""

from __future__ import annotations

import contextlib
import itertools
import socket
import struct
import time
from collections import Counter
from typing import NoReturn

from twin_controller.robot.link import LinkLostError

BUSY = {5: "busy (exception 5)", 6: "busy (exception 6)"}
"""Exceptions that ask for patience: acknowledge, server device busy."""
BUSY_PAUSE = 0.002
"""A robot that is busy is left alone for so long [s]. Our choice."""
SHORTEST_WAIT = 0.01
"""A fast robot is asked again when the next poll is due anyway [s]. Our choice."""
MOST_DOUBLINGS = 2
"""While nothing comes the wait is doubled so often: heartbeats must go on."""
_HEADER = struct.Struct(">HHHB")
_LONGEST = 254
"""Unit and PDU."""
_REMEMBERED = 64


class UnansweredError(Exception):
    """No answer of use: the same may be asked again. The text says what the robot did."""


class Connection:
    """A connection that stays closed once it is lost, until :meth:`open` is called again.

    Args:
        host: The robot's address.
        port: TCP port.
        device_id: Modbus device.
        timeout: The longest wait for a connection, or for the rest of an answer [s].

    Attributes:
        tally: How many answers were busy, late, lost, doubled, short.
        sent: When the question was sent that was answered last (monotonic) [s].
    """

    def __init__(self, host: str, port: int, device_id: int, timeout: float) -> None:
        self.name = f"{host}:{port}"
        self.tally: Counter[str] = Counter()
        self.sent = 0.0
        self._address, self._device_id, self._timeout = (host, port), device_id, timeout
        self._socket: socket.socket | None = None
        self._numbers = itertools.cycle(range(1, 0x10000))
        self._received = bytearray()
        # Questions without an answer: number and time; those that were given up.
        self._open: dict[int, float] = {}
        self._lost: set[int] = set()
        self._rest_until = 0.0
        # Smoothed answer time and its deviation; None before the first answer.
        self._usual: tuple[float, float] | None = None
        self._unanswered = 0

    def open(self) -> None:
        """Connect.

        Raises:
            LinkLostError: Nobody accepts the connection in time.
        """
        self.close()
        try:
            self._socket = socket.create_connection(self._address, self._timeout)
        except OSError as error:
            raise LinkLostError(f"no robot at {self.name}") from error
        # Else a short question may wait until the one before has been acknowledged.
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._received.clear()
        self._open.clear()
        self._lost.clear()
        self._rest_until, self._unanswered = 0.0, 0

    def close(self) -> None:
        """Disconnect."""
        if self._socket is not None:
            self._socket.close()
        self._socket = None

    def interrupt(self) -> None:
        """End a wait in another thread: it raises LinkLostError at once."""
        # Looked at once, for its owner may close it now; a close from here would end no wait.
        if (line := self._socket) is not None:
            with contextlib.suppress(OSError):  # it may be lost already
                line.shutdown(socket.SHUT_RDWR)

    def ask(self, request: bytes, sent: dict[int, float], by: float) -> bytes:
        """Send a request and return the answer to it, or to the same one sent before.

        Args:
            request: Function and data.
            sent: Number and time of each time that it was sent; this time is added.
            by: The end of all patience (monotonic) [s].

        Raises:
            UnansweredError: The robot is busy, or no answer came in the usual time.
            LinkLostError: The connection is closed, or what comes is no Modbus.
        """
        while (stray := self._next(self._rest_until, by)) is not None:
            self._count(stray[0])
        number, now = next(self._numbers), time.monotonic()
        self._send(_HEADER.pack(number, 0, len(request) + 1, self._device_id) + request)
        sent[number] = self._open[number] = now
        if len(self._open) > _REMEMBERED:
            self._lost.discard(oldest := next(iter(self._open)))
            del self._open[oldest]
        until = min(by, now + self._wait())
        while (answer := self._next(until, by)) is not None:
            answered, pdu = answer
            if answered not in sent or answered not in self._open:
                self._count(answered)
                continue
            self.sent = sent[answered]
            self._count(answered)
            self._unanswered = 0
            if pdu[0] & 0x80 and len(pdu) > 1 and pdu[1] in BUSY:
                self.tally["busy"] += 1
                self._rest_until = time.monotonic() + BUSY_PAUSE
                raise UnansweredError(f"answered {BUSY[pdu[1]]}")
            return pdu
        self.tally["lost"] += 1
        self._lost.add(number)
        self._unanswered += 1
        raise UnansweredError("did not answer in time")

    def _wait(self) -> float:
        """Return how long an answer is waited for before the same is asked again [s]."""
        if self._usual is None:
            return 0.5 * self._timeout
        mean, deviation = self._usual
        # A robot's own pace is waited for as long as a second question fits into the time-out. What
        # comes on top is doubt: one late answer may not use up the time that two lost ones need.
        longest = max(self._timeout / 3.0, min(0.5 * self._timeout, mean + deviation))
        # RFC 6298: four deviations above the mean; the gains in _count are its 1/4 and 1/8.
        usual = max(SHORTEST_WAIT, mean + 4.0 * deviation)
        return min(longest, usual * 2.0 ** min(self._unanswered, MOST_DOUBLINGS))

    def _count(self, number: int) -> None:
        """Count an answer, and learn from the time that it took."""
        if (sent := self._open.pop(number, None)) is None:
            self.tally["doubled"] += 1
            return
        if number in self._lost:
            self._lost.remove(number)
            self.tally["lost"] -= 1
            self.tally["late"] += 1
        took = time.monotonic() - sent
        mean, deviation = self._usual or (took, took)
        deviation += 0.25 * (abs(took - mean) - deviation)
        self._usual = mean + 0.125 * (took - mean), deviation

    def _send(self, frame: bytes) -> None:
        if self._socket is None:
            self._end("closed the connection")
        try:
            self._socket.settimeout(self._timeout)
            self._socket.sendall(frame)
        except OSError as error:
            self._end(f"was lost: {error}")

    def _next(self, until: float, by: float) -> tuple[int, bytes] | None:
        """Return number and PDU of the next answer; None if none has begun to come by ``until``.

        Nothing is asked behind a part of an answer: the next one would be taken for its rest.
        """
        while True:
            if len(self._received) >= _HEADER.size:
                number, protocol, size, device = _HEADER.unpack_from(self._received)
                if protocol or not 2 <= size <= _LONGEST:
                    self._end("was lost: what came is no Modbus")
                if len(self._received) >= 6 + size:
                    pdu = bytes(self._received[7 : 6 + size])
                    del self._received[: 6 + size]
                    if device == self._device_id:
                        return number, pdu
                    self.tally["doubled"] += 1
                    continue
            left = (by if self._received else until) - time.monotonic()
            if left <= 0.0:
                if self._received:
                    self._end("did not answer in time: a part of an answer came")
                return None
            self._receive(left)

    def _receive(self, left: float) -> None:
        """Wait for bytes, ``left`` [s] at most."""
        if self._socket is None:
            self._end("closed the connection")
        self._socket.settimeout(left)
        try:
            data = self._socket.recv(4096)
        except TimeoutError:
            return
        except OSError as error:
            self._end(f"was lost: {error}")
        if not data:
            self._end("closed the connection")
        self._received += data

    def _end(self, what: str) -> NoReturn:
        """Close: where one answer ends and the next begins is not known any longer."""
        self.close()
        raise LinkLostError(f"the robot at {self.name} {what}")
