"""What a bad line does to one unit of data: a fault takes a unit and returns the pieces that come out, each with a delay.

A fault is called for each unit with ``answers`` (it comes from the server). All chance comes from a generator with a seed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random

Piece = tuple[float, bytes]
"""How long [s] it is held back, and what it is."""
Fault = Callable[[bytes, bool], list[Piece]]


def passed(unit: bytes, answers: bool) -> list[Piece]:
    """Let a unit through."""
    return [(0.0, unit)]


@dataclass
class Delayed:
    """Hold each unit back by ``delay`` [s] and up to ``jitter`` more; the order is kept unless ``jitter`` breaks it."""

    delay: float
    jitter: float = 0.0
    rng: Random = field(default_factory=Random)

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        return [(self.delay + self.rng.uniform(0.0, self.jitter), unit)]


@dataclass
class Split:
    """Send every byte by itself, ``pause`` [s] apart."""

    pause: float = 0.0

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        return [(self.pause * k, unit[k : k + 1]) for k in range(len(unit))]


@dataclass
class Sometimes:
    """Do to an answer, with probability ``chance``, one of: duplicate, corrupt, truncate, drop, swap with the one before."""

    rng: Random
    chance: float
    kinds: tuple[str, ...] = ("duplicate", "corrupt", "truncate", "drop", "swap")
    skip: tuple[bytes, ...] = (b"HTTP", b"GET ")
    injected: dict[str, int] = field(default_factory=dict)
    _held: bytes = b""

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        held, self._held = self._held, b""
        if not answers or unit[:4] in self.skip or self.rng.random() >= self.chance:
            return [(0.0, unit + held)] if answers else [(0.0, unit)]
        kind = self.rng.choice(self.kinds)
        self.injected[kind] = self.injected.get(kind, 0) + 1
        if kind == "swap":
            self._held = unit
            return [(0.0, held)] if held else []
        return [(0.0, damaged(kind, unit, self.rng) + held)]


def damaged(kind: str, unit: bytes, rng: Random) -> bytes:
    """Return ``unit`` duplicated, corrupted in one to four bytes, truncated or dropped."""
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
