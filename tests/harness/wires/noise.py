"""Sensor noise on a wire.

Every position that a side reports is a little off, each time otherwise.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from random import Random
from typing import Any

from scara_config import load_robot

from harness.wires.damage import Piece
from harness.wires.state_answer import bytes_of, is_state
from harness.workspace import ROOT

ROBOT = load_robot(ROOT / "config")
SCALES = {joint.name: joint.scale for joint in ROBOT.joints}


@dataclass
class ModbusNoise:
    """Add up to ``amplitude`` [deg or mm] to each joint position in the robot's answers."""

    rng: Random
    amplitude: float
    report: dict[str, float] = field(default_factory=dict)

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        if not is_state(unit, answers):
            return [(0.0, unit)]
        self.report["noisy"] = self.report.get("noisy", 0.0) + 1.0
        place = bytes_of("position")
        words = struct.unpack(">18H", unit[place])
        # The low word of each number comes first.
        axes = list(struct.unpack("<9f", struct.pack("<18H", *words)))
        for joint in ROBOT.joints:
            axes[joint.axis_number - 1] += self.rng.uniform(-self.amplitude, self.amplitude)
        words = struct.unpack("<18H", struct.pack("<9f", *axes))
        return [(0.0, unit[: place.start] + struct.pack(">18H", *words) + unit[place.stop :])]


@dataclass
class WebNoise:
    """Add up to ``amplitude`` [deg or mm] to each joint position in the twin's joint states."""

    rng: Random
    amplitude: float
    report: dict[str, float] = field(default_factory=dict)

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Return what comes out."""
        # Not the first brace alone: a length of 123 looks like one.
        start = unit.find(b'{"')
        if not answers or start < 0 or b"joint_states" not in unit[:100]:
            return [(0.0, unit)]
        self.report["noisy"] = self.report.get("noisy", 0.0) + 1.0
        packet: dict[str, Any] = json.loads(unit[start:])
        message = packet["msg"]
        message["position"] = [
            q + self.rng.uniform(-self.amplitude, self.amplitude) * SCALES[name]
            for name, q in zip(message["name"], message["position"])
        ]
        body = json.dumps(packet).encode()
        head = (
            bytes((0x81, len(body)))
            if len(body) < 126
            else struct.pack(">BBH", 0x81, 126, len(body))
        )
        return [(0.0, head + body)]
