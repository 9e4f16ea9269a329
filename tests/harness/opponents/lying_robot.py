"""A Modbus TCP server that lies: for each answer the truth is known, and so is every lie.

The robot swings; what it says about an instant follows from its clock alone, so that any sample can
be checked against the truth by its own clock. It lies often, but never twice in a row about the
same thing: a robot that goes on telling the same lie cannot be found out.
"""

from __future__ import annotations

import contextlib
import math
import socket
import struct
import threading
import time
from collections import Counter
from collections.abc import Callable
from random import Random

from scara_config import Robot, load_robot
from scara_config.modbus_map import ModbusMap, load_modbus_map

from harness.wires.state_answer import BLOCK, place_of
from harness.workspace import ROOT

ROBOT: Robot = load_robot(ROOT / "config")
LAYOUT: ModbusMap = load_modbus_map(ROOT / "config")
SHARE = 0.35
"""Of the positive half of each joint's range.

The robot swings between 20 % and 90 % of it, so a sign is always wrong.
"""
PERIOD_S = 2.0
LIES_EACH = 0.5

Lie = Callable[[Random, bytearray], bytes | None]
"""Takes a whole ADU with its answer, changes it; None sends nothing."""


def truth(clock_ms: int) -> tuple[list[float], list[float]]:
    """Return the joints' positions and speeds in their border units at an instant."""
    q, qdot = [], []
    for k, joint in enumerate(ROBOT.joints):
        half = (joint.upper if joint.upper > 0.0 else joint.lower) / joint.scale
        phase = 2.0 * math.pi * (clock_ms * 1e-3 / PERIOD_S + 0.13 * k)
        q.append(half * (0.55 + SHARE * math.sin(phase)))
        qdot.append(half * SHARE * math.cos(phase) * 2.0 * math.pi / PERIOD_S)
    return q, qdot


class LyingRobot:
    """Serves FC2, FC3, FC5 and FC16 on a free port; a context manager.

    ``lies`` counts what was told; ``told`` holds each clock, and whether there was a lie at it.
    """

    def __init__(self, seed: int) -> None:
        """Lie with probability ``LIES_EACH``."""
        self.lies: Counter[str] = Counter()
        self.told: dict[float, bool] = {}
        self.answers = 0
        self.honest = False
        self._rng, self._rate, self._before = Random(seed), LIES_EACH, b""
        self._clock_ms = 0
        self._lied = {True: False, False: False}
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> LyingRobot:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                line, _ = self._listener.accept()
                line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._serve(line)

    def _serve(self, line: socket.socket) -> None:
        with contextlib.suppress(OSError), line:
            while header := line.recv(7, socket.MSG_WAITALL):
                transaction, _, length, device = struct.unpack(">HHHB", header)
                pdu = self._answer(line.recv(length - 1, socket.MSG_WAITALL))
                adu = struct.pack(">HHHB", transaction, 0, len(pdu) + 1, device) + pdu
                data = self._perhaps_lie(adu) if pdu[0] in (2, 3) else adu
                self._before = adu
                if data is None:
                    return
                line.sendall(data)

    def _answer(self, request: bytes) -> bytes:
        function, address, count = struct.unpack(">BHH", request[:5])
        if function == 3:
            words = self._words() if address == BLOCK.offset else [0] * 400
            return struct.pack(f">BB{count}H", 3, 2 * count, *words[:count])
        if function == 2:
            packed = (0b11).to_bytes((count + 7) // 8, "little")
            return bytes([2, len(packed)]) + packed
        return request[:5]

    def _words(self) -> list[int]:
        clock_ms = int(time.monotonic() * 500.0) * 2 % (1 << 31)
        self._clock_ms = clock_ms
        q, qdot = truth(clock_ms)
        axes, speeds = [0.0] * 9, [0.0] * 9
        for joint, position, speed in zip(ROBOT.joints, q, qdot):
            axes[joint.axis_number - 1], speeds[joint.axis_number - 1] = position, speed
        return [
            # Motor torques.
            *([0] * (11000 - BLOCK.offset)),
            *_floats(axes),
            1,
            *struct.unpack("<2H", struct.pack("<i", clock_ms)),
            *_floats(speeds),
            *(1, 50, 7, 1, 80),
            *(12, 0, 1, 1),
        ]

    def _perhaps_lie(self, adu: bytes) -> bytes | None:
        self.answers += 1
        state = adu[7] == 3 and len(adu) > 90
        lies = (
            not self.honest
            and not self._lied[state]
            and self._rng.random() < self._rate * (1.0 if state else 0.2)
        )
        self._lied[state] = lies
        if state:
            self.told[self._clock_ms] = lies or self.told.get(self._clock_ms, False)
        if not lies:
            return adu
        kinds = {**FRAMING, **VALUES} if state else FRAMING
        name = (
            self._rng.choice(sorted(VALUES))
            if state and self._rng.random() < 0.9
            else self._rng.choice(sorted(kinds))
        )
        self.lies[name] += 1
        if name == "answer of the request before":
            return self._before
        return kinds[name](self._rng, bytearray(adu))


def _floats(values: list[float]) -> tuple[int, ...]:
    return struct.unpack(f"<{2 * len(values)}H", struct.pack(f"<{len(values)}f", *values))


def _put_words(adu: bytearray, first: int, *words: int) -> bytes:
    """Write registers into a state answer, from the address ``first`` on."""
    at = place_of(first)
    adu[at : at + 2 * len(words)] = struct.pack(f">{len(words)}H", *words)
    return bytes(adu)


def _put_float(adu: bytearray, first: int, value: float) -> bytes:
    return _put_words(adu, first, *struct.unpack("<2H", struct.pack("<f", value)))


def _float_at(adu: bytearray, first: int) -> float:
    at = place_of(first)
    value: float = struct.unpack("<f", struct.pack("<2H", *struct.unpack(">2H", adu[at : at + 4])))[
        0
    ]
    return value


def _axis(rng: Random, base: int) -> int:
    """Return the register of a random joint's float in the block that begins at ``base``."""
    return base + 2 * (rng.choice(ROBOT.joints).axis_number - 1)


def _any_float(value: Callable[[Random], float]) -> Lie:
    return lambda rng, adu: _put_float(adu, _axis(rng, rng.choice((11001, 11022))), value(rng))


def _flipped_sign(base: int) -> Lie:
    def lie(rng: Random, adu: bytearray) -> bytes:
        at = _axis(rng, base)
        return _put_float(adu, at, -_float_at(adu, at))

    return lie


def _beyond(rng: Random, adu: bytearray) -> bytes:
    joint = rng.choice(ROBOT.joints)
    bound = rng.choice((joint.lower, joint.upper)) / joint.scale
    outside = bound + math.copysign(
        0.01 + 0.5 * rng.random(), 1.0 if bound == joint.upper / joint.scale else -1.0
    ) * ((joint.upper - joint.lower) / joint.scale)
    return _put_float(adu, 11001 + 2 * (joint.axis_number - 1), outside)


def _flipped_bit(rng: Random, adu: bytearray) -> bytes:
    """Flip one bit of one joint's position or speed: sometimes it is too small to be noticed."""
    at = place_of(_axis(rng, rng.choice((11001, 11022)))) + rng.randrange(4)
    adu[at] ^= 1 << rng.randrange(8)
    return bytes(adu)


def _swapped(rng: Random, adu: bytearray) -> bytes:
    """Exchange the words of one joint's position: the other word order."""
    at = place_of(_axis(rng, 11001))
    adu[at : at + 4] = adu[at + 2 : at + 4] + adu[at : at + 2]
    return bytes(adu)


def _shifted_clock(rng: Random, adu: bytearray) -> bytes:
    at = place_of(11020)
    clock = struct.unpack("<i", struct.pack("<2H", *struct.unpack(">2H", adu[at : at + 4])))[0]
    shifted = (clock + rng.choice((-3_600_000, 3_600_000, -86_400_000, 400, -400))) % (1 << 31)
    return _put_words(adu, 11020, *struct.unpack("<2H", struct.pack("<i", shifted)))


def _resized(rng: Random, adu: bytearray, change: int) -> bytes:
    """Answer with fewer or more registers than asked for, consistently."""
    pdu = adu[7:]
    size = max(pdu[1] + change, 0)
    body = bytes(pdu[2 : 2 + size]) + bytes(max(size - len(pdu) + 2, 0))
    pdu = bytearray((pdu[0], size)) + body
    return bytes(adu[:4] + struct.pack(">H", len(pdu) + 1) + adu[6:7] + pdu)


def _header(at: int) -> Lie:
    def lie(rng: Random, adu: bytearray) -> bytes:
        adu[at] ^= rng.randrange(1, 256)
        return bytes(adu)

    return lie


FRAMING: dict[str, Lie] = {
    "wrong transaction": _header(1),
    "wrong protocol": _header(3),
    "wrong length": lambda rng, adu: bytes(
        adu[:4] + struct.pack(">H", rng.choice((0, 1, 3, 700, 65535))) + adu[6:]
    ),
    "wrong unit": _header(6),
    "wrong function": _header(7),
    "wrong byte count": _header(8),
    "fewer registers": lambda rng, adu: _resized(rng, adu, -2 if adu[7] == 3 else -1),
    "more registers": lambda rng, adu: _resized(rng, adu, 2),
    "no registers": lambda rng, adu: _resized(rng, adu, -1000),
    "exception": lambda rng, adu: bytes(
        adu[:4] + b"\0\3" + adu[6:7] + bytes((adu[7] | 0x80, rng.randint(1, 11)))
    ),
    "truncated": lambda rng, adu: bytes(adu[: rng.randrange(1, len(adu))]),
    "twice": lambda rng, adu: bytes(adu + adu),
    "garbage": lambda rng, adu: rng.randbytes(rng.randint(1, 300)),
    "silence and end": lambda rng, adu: None,
    "answer of the request before": lambda rng, adu: bytes(adu),
}
VALUES: dict[str, Lie] = {
    "NaN": _any_float(lambda rng: math.nan),
    "infinite": _any_float(lambda rng: rng.choice((math.inf, -math.inf))),
    "huge": _any_float(lambda rng: rng.choice((-1, 1)) * 10.0 ** rng.uniform(5, 38)),
    "65535": lambda rng, adu: _put_words(adu, rng.randint(11001, 11043), 65535, 65535),
    "all 65535": lambda rng, adu: _put_words(adu, 11001, *(65535,) * 46),
    "all zero": lambda rng, adu: _put_words(adu, 11001, *(0,) * 46),
    "sign of a position": _flipped_sign(11001),
    "sign of a speed": _flipped_sign(11022),
    "beyond the range": _beyond,
    "other word order": _swapped,
    "one bit": _flipped_bit,
    "position not valid": lambda rng, adu: _put_words(adu, 11019, rng.choice((0, 2, 65535))),
    "unknown control type": lambda rng, adu: _put_words(adu, 11040, rng.randint(3, 65535)),
    "unknown watchdog state": lambda rng, adu: _put_words(adu, 11043, rng.randint(3, 65535)),
    "percent beyond 100": lambda rng, adu: _put_words(
        adu, rng.choice((11041, 11044)), rng.randint(101, 65535)
    ),
    "negative clock": lambda rng, adu: _put_words(adu, 11021, rng.randint(0x8000, 0xFFFF)),
    "shifted clock": _shifted_clock,
}
