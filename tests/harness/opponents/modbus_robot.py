"""A small Modbus TCP server on bare sockets, that can misbehave."""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from collections import defaultdict, deque

HEARTBEAT, ECHO, CLOCK = 11069, 11041, 11019
"""PDU addresses of the heartbeat, of its copy and of the clock."""
COMMAND, COMMAND_ECHO = 11094, 11048
"""PDU addresses of a numbered command, its number behind it, and of the copy of that number."""
LATE = 0.25
"""A late answer is so late [s]: the same has been asked again long before."""
Written = tuple[int, int, tuple[int, ...]]


class Robot:
    """Answers FC2, FC3, FC5 and FC16; keeps every write as (function, PDU address, values).

    ``delay`` is the wire's [s]. ``fault`` makes it misbehave: silent, short, busy, exception,
    transaction, device, close, refuse_writes, write_function, write_address, write_count,
    write_level, write_refusal (its code, with a confirmation behind it). ``once`` holds, for a
    function, what it does with the next requests: busy and acknowledge (exceptions 6 and 5, nothing
    is done), late (by ``LATE`` s), lost, doubled, short, part. With ``echoes`` it copies the
    heartbeat and the number of a command back, and its clock goes on, as by a background program.
    """

    def __init__(self, port: int = 0) -> None:
        self.words = {address: 0 for address in range(10982, 11401)}
        self.words[11018] = self.words[11043] = 1
        self.put_float(11004, -160.0)
        self.words[11020] = 1
        self.signals = 0b11
        self.written: list[Written] = []
        self.fault = ""
        self.once: defaultdict[int, deque[str]] = defaultdict(deque)
        self.clients = 0
        self.echoes = False
        self.delay = 0.0
        self.asked: list[int] = []
        self._listener = socket.create_server(("127.0.0.1", port), reuse_port=True)
        self.port = self._listener.getsockname()[1]
        self._open: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def put_float(self, address: int, value: float) -> None:
        """Store a float32, low word first."""
        self.words[address], self.words[address + 1] = struct.unpack(
            "<2H", struct.pack("<f", value)
        )

    def close(self) -> None:
        """Drop all clients and stop listening."""
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for line in self._open:
            line.close()

    def writes(self, address: int) -> list[tuple[int, ...]]:
        """Return what was written at one PDU address."""
        return [values for _, at, values in list(self.written) if at == address]

    def _accept(self) -> None:
        while True:
            try:
                line, _ = self._listener.accept()
            except OSError:
                return
            self._open.append(line)
            self.clients += 1
            threading.Thread(target=self._serve, args=(line,), daemon=True).start()

    def _serve(self, line: socket.socket) -> None:
        try:
            while header := line.recv(7, socket.MSG_WAITALL):
                transaction, _, length, device = struct.unpack(">HHHB", header)
                request = line.recv(length - 1, socket.MSG_WAITALL)
                if self.fault == "close":
                    line.close()
                    return
                if self.fault == "silent":
                    continue
                time.sleep(self.delay)
                self.asked.append(request[0])
                waiting = self.once[request[0]]
                once = waiting.popleft() if waiting else ""
                answer = self._answer(request, once)
                transaction += self.fault == "transaction"
                device += self.fault == "device"
                whole = struct.pack(">HHHB", transaction, 0, len(answer) + 1, device) + answer
                if once == "late":
                    threading.Timer(LATE, _send, (line, whole)).start()
                elif once != "lost":
                    line.sendall(
                        whole[:-1] if once == "part" else whole * (1 + (once == "doubled"))
                    )
        except OSError:
            return

    def _answer(self, request: bytes, once: str) -> bytes:
        function, address, count = struct.unpack(">BHH", request[:5])
        if "busy" in (self.fault, once):
            return bytes([function | 0x80, 6])
        if once == "acknowledge":
            return bytes([function | 0x80, 5])
        if self.fault == "exception" or (self.fault == "refuse_writes" and function > 3):
            return bytes([function | 0x80, 2])
        if function == 3:
            if self.echoes:
                high, low = divmod(time.monotonic_ns() // 1_000_000 % 2**31, 2**16)
                self.words[CLOCK], self.words[CLOCK + 1] = low, high
            count -= "short" in (self.fault, once)
            words = [self.words.get(address + i, 0) for i in range(count)]
            return struct.pack(f">BB{count}H", 3, 2 * count, *words)
        if function == 2:
            packed = self.signals.to_bytes((count + 7) // 8, "little")
            return bytes([2, len(packed)]) + packed
        values = (count,) if function == 5 else struct.unpack(f">{count}H", request[6:])
        self.written.append((function, address, values))
        if self.echoes and function == 16 and address <= HEARTBEAT < address + count:
            self.words[ECHO] = values[HEARTBEAT - address]
        if self.echoes and address == COMMAND:
            self.words[COMMAND_ECHO] = values[1]
        return self._echo(function, address, count)

    def _echo(self, function: int, address: int, count: int) -> bytes:
        """Confirm a write, or another one."""
        if self.fault == "write_function":
            return struct.pack(">BHH", 15 if function == 16 else 6, address, count)
        if self.fault == "write_refusal":
            return struct.pack(">BHH", function | 0x80, address, count)
        address += self.fault == "write_address"
        count += self.fault == "write_count" and function == 16
        count ^= 0xFF00 if self.fault == "write_level" and function == 5 else 0
        return struct.pack(">BHH", function, address, count)


def _send(line: socket.socket, answer: bytes) -> None:
    """Send an answer, unless its client has gone."""
    with contextlib.suppress(OSError):
        line.sendall(answer)
