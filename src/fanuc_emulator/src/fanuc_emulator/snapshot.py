"""What can be read of the robot at one instant."""

from __future__ import annotations

from enum import IntEnum

import msgspec
from scara_config.map_entries import MODE_BITS

from fanuc_emulator.alarms import Alarm
from fanuc_emulator.tp.executor import ProgramState
from fanuc_emulator.uop import Outputs


class ControlType(IntEnum):
    """What the register ``control_type`` says."""

    NONE = 0
    PROGRAM = 1
    STREAM = 2


class WatchdogState(IntEnum):
    """What the register ``watchdog_state`` says, R[9] of the background program."""

    DISARMED = 0
    ARMED = 1
    EXPIRED = 2


class Snapshot(msgspec.Struct, frozen=True):
    """Everything a client can read, true at one instant.

    Positions in the order of robot.yaml [rad or m].

    Attributes:
        clock_ms: Stamp of the readings.
        plain_clock_ms: The controller's clock, whatever the readings are.
        mode: At what the mode switch stands.
        tp_enabled: The teach pendant's switch is on.
        torques: Of the motors [percent].
    """

    tick: int
    clock_ms: int
    plain_clock_ms: int
    measured_positions: tuple[float, ...]
    measured_velocities: tuple[float, ...]
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    control_type: ControlType
    program_speed: int
    override: int
    general_override: int
    heartbeat: int
    watchdog_state: WatchdogState
    program_name: str
    program_line: int
    program_state: ProgramState
    alarm: Alarm | None
    outputs: Outputs
    inputs: frozenset[str]
    ring_read: int = 0
    ring_underruns: int = 0
    mode: str = "AUTO"
    tp_enabled: bool = False
    torques: tuple[float, ...] = ()

    @property
    def mode_b0(self) -> int:
        """SI[8]."""
        return MODE_BITS[self.mode][0]

    @property
    def mode_b1(self) -> int:
        """SI[9]."""
        return MODE_BITS[self.mode][1]
