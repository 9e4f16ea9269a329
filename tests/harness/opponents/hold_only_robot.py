"""A stranger's robot on a Modbus line: it follows PR[1], and nothing but HOLD stops it.

Its servo, its programs and its server are its own. CSTOPI does nothing but clear what waits,
``*IMSTP`` has no input, there is no ring of set points, and START and RSR want 100 ms. What is
written in PR[1] counts, valid or not, as a controller's ``J PR[1]`` takes it.
"""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import threading
import time

PERIOD_S = 0.004
SHORTEST_PULSE_S = 0.1
SILENT_S = 1.0
"""A heartbeat that stands still for so long pauses the program; a test machine is late at times."""
NONE, PROGRAM, STREAM = 0, 1, 2
ABORTED, PAUSED, RUNNING = 0, 1, 2
SPEED = (300.0, 400.0, 1000.0, 900.0, 180.0)
"""Of each axis [deg/s or mm/s]; its acceleration is eight times that [1/s]."""
LOWEST, HIGHEST = (-148, -150, -210, -720, -180), (148, 150, 0, 720, 180)
HOME = (0.0, 0.0, -160.0, 0.0, 0.0)
WAY = ((25.0, 30.0, -120.0, 0.0, 0.0), HOME, (25.0, 30.0, -120.0, 0.0, 0.0), HOME)
"""Of its own program [deg, mm]."""
PROGRAM_PERCENT = 15.0
COILS = {6001: "hold", 6003: "cstopi", 6004: "reset", 6005: "start", 6008: "rsr1"}
OUTPUTS = ("cmdenbl", "sysrdy", "progrun", "paused", "held", "fault")
CYCLE, POSITION, SETPOINT, OVERRIDE, PRG = 11000, 11000, 11050, 11100, 11200


class HoldOnlyRobot:
    """Serve FC1 to FC3, FC5, FC6 and FC16 on a free port; a context manager.

    Attributes:
        q: Where the axes are [deg or mm].
        speed: How fast they move [deg/s or mm/s].
        state: Of the program: aborted, paused, running.
        kind: Of the program: none, its own, the stream.
        truth: (monotonic time, q) of each servo step.
    """

    def __init__(self) -> None:
        """Listen; nothing runs."""
        self.q, self.speed = list(HOME), [0.0] * len(HOME)
        self.state, self.kind = ABORTED, NONE
        self.truth: list[tuple[float, tuple[float, ...]]] = []
        self._target = list(HOME)
        self._way: list[tuple[float, ...]] = []
        self._waits = 0
        self._words = dict.fromkeys(range(11000, 11500), 0)
        self._put_floats(SETPOINT, HOME)
        self._words[11070], self._words[OVERRIDE] = 100, 100
        self._levels = {"hold": True, "cstopi": False, "reset": False, "start": False}
        self._levels["rsr1"] = False
        self._since: dict[str, float] = {}
        self._beat, self._beaten = 0, time.monotonic()
        self._silent = False
        self._lock = threading.Lock()
        self._ended = threading.Event()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._threads = [
            threading.Thread(target=work, daemon=True) for work in (self._accept, self._servo)
        ]

    def __enter__(self) -> HoldOnlyRobot:
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for thread in self._threads:
            thread.join(2.0)

    def run_program(self) -> None:
        """Select and start its own program, as a person at its pendant does."""
        with self._lock:
            assert self.state == ABORTED, "another program is there"
            self.state, self.kind, self._way = RUNNING, PROGRAM, list(WAY)

    def abort(self) -> None:
        """End what is paused, as a person at its pendant does."""
        with self._lock:
            self.state, self.kind, self._way = ABORTED, NONE, []

    def go_on(self) -> None:
        """Press START at its pendant."""
        with self._lock:
            self._start()

    @property
    def standing(self) -> bool:
        """Whether no axis moves."""
        return not any(self.speed)

    def _servo(self) -> None:
        due = time.monotonic()
        while not self._ended.wait(max(0.0, due - time.monotonic())):
            due += PERIOD_S
            with self._lock:
                self._step(time.monotonic())
                self.truth.append((time.monotonic(), tuple(self.q)))

    def _step(self, now: float) -> None:
        """Go on for one period: watchdog, pulses, program, axes."""
        if self._beat and now - self._beaten > SILENT_S:
            self._silent = True
            self._pause()
        if self._levels["rsr1"] and now - self._since.get("rsr1", now) >= SHORTEST_PULSE_S:
            self._since.pop("rsr1", None)
            self._request()
        if not self._levels["hold"]:
            self._pause()
        percent = self._words[OVERRIDE] * 0.01
        if self.state == RUNNING and self.kind == STREAM:
            self._target = self._floats(SETPOINT, len(HOME))
            percent *= self._words[11070] * 0.01
        elif self.state == RUNNING:
            self._go_its_way()
            percent *= PROGRAM_PERCENT * 0.01
        for k in range(len(HOME)):
            self._move(k, percent if self.state == RUNNING else 0.0)

    def _go_its_way(self) -> None:
        if self._way:
            self._target = list(self._way[0])
            if self.standing and math.dist(self.q, self._target) < 1e-3:
                self._way.pop(0)
        if not self._way:
            self.state, self.kind = ABORTED, NONE
            if self._waits:
                self._waits -= 1
                self._request()

    def _move(self, k: int, percent: float) -> None:
        """Let an axis go towards its target so that it can always stop there."""
        acceleration, error = 8.0 * SPEED[k], self._target[k] - self.q[k]
        # As fast as the brakes allow, one period ahead.
        allowed = math.sqrt(2.0 * acceleration * abs(error)) - 0.5 * acceleration * PERIOD_S
        wanted = math.copysign(min(max(allowed, 0.0), SPEED[k] * percent), error)
        if abs(error) < 1e-4:
            wanted = 0.0
        elif percent and not wanted:
            wanted = 0.5 * error / PERIOD_S
        change = acceleration * PERIOD_S
        self.speed[k] = min(max(wanted, self.speed[k] - change), self.speed[k] + change)
        if abs(self.speed[k]) < 1e-3:
            self.speed[k] = 0.0
        self.q[k] = min(max(self.q[k] + self.speed[k] * PERIOD_S, LOWEST[k]), HIGHEST[k])

    def _pause(self) -> None:
        if self.state == RUNNING:
            self.state = PAUSED

    def _request(self) -> None:
        """RSR1: the stream program, at once or behind the one that runs or is paused."""
        if self.state != ABORTED:
            self._waits += 1
        elif self._levels["hold"] and not self._silent:
            self.state, self.kind = RUNNING, STREAM

    def _start(self) -> None:
        if self.state == PAUSED and self._levels["hold"] and not self._silent:
            self.state = RUNNING

    def _write_coil(self, at: int, on: bool) -> None:
        name, now = COILS.get(at, ""), time.monotonic()
        if name not in self._levels or self._levels[name] == on:
            return
        self._levels[name] = on
        if on:
            self._since[name] = now
        elif name == "start" and now - self._since.pop(name, now) >= SHORTEST_PULSE_S:
            self._start()
        if name == "cstopi" and on:
            self._waits = 0
        if name == "reset" and not on:
            self._silent = False

    def _show(self) -> None:
        """Bring the readable words up to date."""
        words = self._words
        self._put_floats(POSITION, self.q)
        words[11018] = 1
        high, low = divmod(time.monotonic_ns() // 1_000_000 % 2**31, 2**16)
        words[11019], words[11020] = low, high
        self._put_floats(11021, self.speed)
        words[11039] = self.kind if self.state != ABORTED else NONE
        words[11040] = self._words[11070] if self.kind == STREAM else round(PROGRAM_PERCENT)
        words[11041], words[11042] = self._beat, 2 if self._silent else int(self._beat > 0)
        words[11043] = words[OVERRIDE]
        name = {NONE: b"", PROGRAM: b"ITSOWN", STREAM: b"FOLLOW"}[self.kind].ljust(16, b"\0")
        for k, word in enumerate(struct.unpack(">8H", name)):
            words[PRG + k] = words[PRG + 10 + k] = word
        words[PRG + 8], words[PRG + 9] = 1, self.state

    def _outputs(self) -> int:
        lit = {
            "cmdenbl": self._levels["hold"] and not self._silent,
            "sysrdy": True,
            "progrun": self.state == RUNNING,
            "paused": self.state == PAUSED,
            "held": not self._levels["hold"],
            "fault": self._silent,
        }
        return sum(1 << k for k, name in enumerate(OUTPUTS) if lit[name])

    def _put_floats(self, at: int, values: object) -> None:
        for k, value in enumerate(values):  # type: ignore[call-overload]
            low, high = struct.unpack("<2H", struct.pack("<f", value))
            self._words[at + 2 * k], self._words[at + 2 * k + 1] = low, high

    def _floats(self, at: int, count: int) -> list[float]:
        packed = struct.pack(f"<{2 * count}H", *(self._words[at + k] for k in range(2 * count)))
        return list(struct.unpack(f"<{count}f", packed))

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                line, _ = self._listener.accept()
                line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                threading.Thread(target=self._serve, args=(line,), daemon=True).start()

    def _serve(self, line: socket.socket) -> None:
        with contextlib.suppress(OSError), line:
            while header := line.recv(7, socket.MSG_WAITALL):
                transaction, _, length, device = struct.unpack(">HHHB", header)
                request = line.recv(length - 1, socket.MSG_WAITALL)
                with self._lock:
                    pdu = self._answer(request)
                line.sendall(struct.pack(">HHHB", transaction, 0, len(pdu) + 1, device) + pdu)

    def _answer(self, request: bytes) -> bytes:
        function, at, count = struct.unpack(">BHH", request[:5])
        if function == 3:
            self._show()
            words = [self._words.get(at + k, 0) for k in range(count)]
            return struct.pack(f">BB{count}H", 3, 2 * count, *words)
        if function in (1, 2):
            bits = self._outputs() >> max(0, at - 6000) if function == 2 else self._lit(at, count)
            size = (count + 7) // 8
            packed = (bits & (1 << count) - 1).to_bytes(size, "little")
            return bytes([function, size]) + packed
        if function == 5:
            self._write_coil(at, count == 0xFF00)
        elif function == 6:
            self._take(at, [count])
        elif function == 16:
            self._take(at, struct.unpack(f">{count}H", request[6:]))
        else:
            return bytes([function | 0x80, 1])
        return request[:5]

    def _lit(self, at: int, count: int) -> int:
        names = [COILS.get(at + k, "") for k in range(count)]
        return sum(1 << k for k, name in enumerate(names) if self._levels.get(name, True))

    def _take(self, at: int, words: object) -> None:
        """Store what a client writes; a heartbeat that changes wakes the watchdog."""
        for k, word in enumerate(words):  # type: ignore[call-overload]
            self._words[at + k] = word
            if at + k == 11069 and word != self._beat:
                self._beat, self._beaten = word, time.monotonic()
