"""What a bad line does to one unit of data.

A fault takes a unit and returns the pieces that come out, each with a delay.

A fault is called for each unit with ``answers`` (it comes from the server). All chance comes from a
generator with a seed.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random

Piece = tuple[float, bytes]
"""How long [s] it is held back, and what it is."""
LATE_S = 0.03
Fault = Callable[[bytes, bool], list[Piece]]


def passed(unit: bytes, answers: bool) -> list[Piece]:
    """Let a unit through."""
    return [(0.0, unit)]


@dataclass
class Delayed:
    """Hold each unit back by ``delay`` [s] and up to ``jitter`` more.

    The order is kept unless ``jitter`` breaks it.
    """

    delay: float
    jitter: float = 0.0
    rng: Random = field(default_factory=Random)

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        return [(self.delay + self.rng.uniform(0.0, self.jitter), unit)]


@dataclass
class Split:
    """Send the first ``alone`` bytes each by itself, and the rest in two parts."""

    alone: int = 16
    rng: Random = field(default_factory=Random)

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        cut = self.rng.randrange(len(unit))
        places = [*range(min(self.alone, len(unit))), max(cut, self.alone), len(unit)]
        return [(0.0, unit[a:b]) for a, b in itertools.pairwise(places) if unit[a:b]]


@dataclass
class Sometimes:
    """Do to an answer, with probability ``chance``, one of.

    Duplicate, corrupt, truncate, drop, swap with the one before; hold back by 30 ms (late), or say
    by Modbus that the server is busy.
    """

    rng: Random
    chance: float
    kinds: tuple[str, ...] = ("duplicate", "corrupt", "truncate", "drop", "swap")
    skip: tuple[bytes, ...] = (b"HTTP", b"GET ")
    report: dict[str, float] = field(default_factory=dict)
    _held: bytes = b""

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        if not answers:
            return [(0.0, unit)]
        held, self._held = self._held, b""
        if unit[:4] in self.skip:
            return [(0.0, unit)]  # what was held is lost with the connection before
        if self.rng.random() >= self.chance:
            return [(0.0, unit + held)]
        kind = self.rng.choice(self.kinds)
        self.report[kind] = self.report.get(kind, 0.0) + 1.0
        if kind == "swap":
            self._held = unit
            return [(0.0, held)] if held else []
        delay = LATE_S if kind == "late" else 0.0
        return [(delay, damaged(kind, unit, self.rng) + held)]


@dataclass
class Tap:
    """Let everything pass and remember when a question last held ``pattern``.

    ``report["seen"]`` tells it (ROS time).
    """

    pattern: bytes
    report: dict[str, float] = field(default_factory=dict)

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        if not answers and self.pattern in unmasked(unit):
            self.report["seen"] = time.time()
            self.report["times"] = self.report.get("times", 0.0) + 1.0
        return [(0.0, unit)]


def unmasked(unit: bytes) -> bytes:
    """Return the payload of a client's web-socket text frame in clear.

    Anything else as it is (RFC 6455 sec. 5.3).
    """
    if unit[:1] not in (b"\x81", b"\x82") or len(unit) < 6 or not unit[1] & 0x80:
        return unit
    size = unit[1] & 0x7F
    at = 2 + (2 if size == 126 else 8 if size == 127 else 0)
    mask, body = unit[at : at + 4], unit[at + 4 :]
    key = int.from_bytes((mask * (len(body) // 4 + 1))[: len(body)], "big")
    return (int.from_bytes(body, "big") ^ key).to_bytes(len(body), "big")


def damaged(kind: str, unit: bytes, rng: Random) -> bytes:
    """Return ``unit`` duplicated, corrupted in one to four bytes, truncated, dropped, or as it is.

    One of Modbus may be turned into exception 6.
    """
    if kind == "late":
        return unit
    if kind == "busy":
        return unit[:5] + bytes([3, unit[6], unit[7] | 0x80, 6])
    if kind == "duplicate":
        return unit + unit
    if kind == "truncate":
        return unit[: rng.randrange(len(unit))]
    if kind == "drop":
        return b""
    changed = bytearray(unit)
    for _ in range(rng.randint(1, 4)):
        changed[rng.randrange(len(changed))] ^= rng.randrange(1, 256)
    return bytes(changed)
