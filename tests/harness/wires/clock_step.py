"""A clock that is put forward or back: the robot's, in its answers on the wire."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from harness.wires.damage import Piece
from harness.wires.noise import STATE_BYTES

CLOCK_WORD = 19
"""Place of clock_ms in the state block (modbus_map.yaml: 11020 of 11001..), low word first."""
WRAPS_MS = 2**31


@dataclass
class ClockStep:
    """Show a robot whose clock was put by ``step_ms``, in each of its states."""

    step_ms: int

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        if not answers or len(unit) != 9 + STATE_BYTES or unit[7:9] != bytes((3, STATE_BYTES)):
            return [(0.0, unit)]
        at = 9 + 2 * CLOCK_WORD
        low, high = struct.unpack(">2H", unit[at : at + 4])
        stepped = ((high << 16 | low) + self.step_ms) % WRAPS_MS
        words = struct.pack(">2H", stepped & 0xFFFF, stepped >> 16)
        return [(0.0, unit[:at] + words + unit[at + 4 :])]
