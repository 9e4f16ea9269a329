"""A clock that is put forward or back: the robot's, in its answers on the wire."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from harness.wires.damage import Piece
from harness.wires.state_answer import bytes_of, is_state

WRAPS_MS = 2**31


@dataclass
class ClockStep:
    """Show a robot whose clock was put by ``step_ms``, in each of its states."""

    step_ms: int

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        if not is_state(unit, answers):
            return [(0.0, unit)]
        place = bytes_of("clock_ms")
        # The low word comes first.
        low, high = struct.unpack(">2H", unit[place])
        stepped = ((high << 16 | low) + self.step_ms) % WRAPS_MS
        words = struct.pack(">2H", stepped & 0xFFFF, stepped >> 16)
        return [(0.0, unit[: place.start] + words + unit[place.stop :])]
