"""A line that is slow in both directions, for the relay of tests/harness.

Each unit is late by a random time, in order.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from random import Random

from harness.wires.damage import Piece


@dataclass
class Late:
    """Hold each unit back by ``least`` to ``most`` [s]; none overtakes another."""

    least: float
    most: float
    rng: Random = field(default_factory=lambda: Random(1))
    _last: dict[bool, float] = field(default_factory=dict)

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return the unit with its delay from now."""
        now = time.monotonic()
        due = max(
            now + self.rng.uniform(self.least, self.most), self._last.get(answers, 0.0) + 1e-6
        )
        self._last[answers] = due
        return [(due - now, unit)]
