"""Read emulator.yaml and config/programs/*.yaml, checked against robot.yaml."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from ruamel.yaml import YAML
from scara_config import ConfigError, Joint, Robot, load, locate
from scara_config.percent import AccelerationPercent

from fanuc_emulator.axis import AxisParameters
from fanuc_emulator.program import (
    GripperLine,
    GripperStep,
    MoveStep,
    Program,
    ProgramFile,
    WaitLine,
    WaitStep,
    unroll,
)

Positive = Annotated[float, Meta(gt=0.0, le=1e9)]


class ClockFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The controller's own clock."""

    boot_offset_ms: Annotated[int, Meta(ge=0, lt=2**31)]
    drift_ppm: Annotated[float, Meta(ge=-500.0, le=500.0)]


class AxisFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Servo model of one axis; percent of the acceleration in robot.yaml."""

    program_acceleration_percent: AccelerationPercent
    command_acceleration_percent: AccelerationPercent
    servo_acceleration_percent: AccelerationPercent
    estop_deceleration_percent: AccelerationPercent
    natural_frequency_hz: Annotated[float, Meta(gt=0.0, le=100.0)]
    damping: Annotated[float, Meta(gt=0.0, le=5.0)]
    velocity_feedforward: Annotated[float, Meta(ge=0.0, le=1.0)]
    encoder_counts_per_turn: Annotated[int, Meta(ge=1, le=2**26)]
    travel_per_turn_deg: Positive | None = None
    travel_per_turn_mm: Positive | None = None


class EmulatorConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file emulator.yaml."""

    host: str
    port: Annotated[int, Meta(ge=1, le=65535)]
    clock: ClockFile
    start_position: dict[str, float]
    interpolation_period_ms: Annotated[int, Meta(ge=1, le=10)]
    servo_substeps: Annotated[int, Meta(ge=1, le=16)]
    filter_ms: Annotated[
        list[Annotated[int, Meta(ge=10, le=500, multiple_of=10)]], Meta(min_length=1, max_length=4)
    ]
    start_delay_ms: Annotated[int, Meta(ge=0, le=1000)]
    answer_delay_ms: Annotated[float, Meta(ge=0.0, le=1000.0)]
    fine_tolerance_deg: Positive
    fine_tolerance_mm: Positive
    axes: dict[str, AxisFile]
    cold_start_override_percent: Annotated[int, Meta(ge=1, le=100)]
    safety_speed_percent: Annotated[int, Meta(ge=1, le=100)]
    heartbeat_timeout_ms: Annotated[int, Meta(ge=10, le=10000)]
    gripper_timeout_ms: Annotated[int, Meta(ge=10, le=10000)]
    stream_program: Annotated[str, Meta(pattern=r"^[A-Z][A-Z0-9_]{0,15}$")]
    desk_heartbeat_timeout_ms: Annotated[int, Meta(ge=10, le=10000)] | None = None

    @property
    def dt(self) -> float:
        """Interpolation period [s]."""
        return self.interpolation_period_ms / 1000.0

    @property
    def filter_lengths(self) -> tuple[int, ...]:
        """Moving averages in interpolation periods."""
        return tuple(length // self.interpolation_period_ms for length in self.filter_ms)


def load_emulator(robot: Robot, directory: Path | str | None = None) -> EmulatorConfig:
    """Read emulator.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, an axis is missing or unknown, the start position
            is out of range, a period does not divide another.
    """
    path = locate("emulator.yaml", directory)
    config = load(path, EmulatorConfig)
    names = [joint.name for joint in robot.joints]
    for name in sorted(set(names) ^ set(config.axes)):
        what = "is missing" if name in names else f"is no joint of robot.yaml ({', '.join(names)})"
        raise ConfigError(f"{path}: axes.{name}: {what}")
    if 10 % config.interpolation_period_ms:
        raise ConfigError(
            f"{path}: interpolation_period_ms = {config.interpolation_period_ms}: must divide 10"
        )
    for joint in robot.joints:
        axis = config.axes[joint.name]
        wanted, other = (
            f"travel_per_turn_{joint.unit}",
            "travel_per_turn_mm" if joint.unit == "deg" else "travel_per_turn_deg",
        )
        if getattr(axis, wanted) is None or getattr(axis, other) is not None:
            raise ConfigError(f"{path}: axes.{joint.name}: needs {wanted} and not {other}")
    joint_positions(config.start_position, robot, lambda _: f"{path}: start_position")
    return config


def on_a_desk(config: EmulatorConfig) -> EmulatorConfig:
    """Return the configuration for a stand-in whose client runs on the same machine."""
    patience = max(config.heartbeat_timeout_ms, config.desk_heartbeat_timeout_ms or 0)
    return msgspec.structs.replace(config, heartbeat_timeout_ms=patience)


def axis_parameters(config: EmulatorConfig, joint: Joint) -> AxisParameters:
    """Return one axis' limits and dynamics in SI."""
    axis = config.axes[joint.name]
    percent = joint.acceleration / 100.0
    return AxisParameters(
        lower=joint.lower,
        upper=joint.upper,
        velocity=joint.velocity,
        program_acceleration=axis.program_acceleration_percent * percent,
        command_acceleration=axis.command_acceleration_percent * percent,
        servo_acceleration=axis.servo_acceleration_percent * percent,
        estop_deceleration=axis.estop_deceleration_percent * percent,
        natural_frequency=2.0 * math.pi * axis.natural_frequency_hz,
        damping=axis.damping,
        velocity_feedforward=axis.velocity_feedforward,
        resolution=getattr(axis, f"travel_per_turn_{joint.unit}")
        * joint.scale
        / axis.encoder_counts_per_turn,
        tolerance=getattr(config, f"fine_tolerance_{joint.unit}") * joint.scale,
    )


def joint_positions(
    values: Mapping[str, float], robot: Robot, source: Callable[[str], str]
) -> tuple[float, ...]:
    """Convert positions with units in their keys to joint positions.

    ``{joint_1_deg: .., joint_3_mm: ..}`` becomes [rad or m] in the order of robot.yaml.

    Args:
        values: One value for each joint of robot.yaml.
        robot: The joints and their ranges.
        source: Names the place of a key in the file, for errors.

    Raises:
        ConfigError: A joint is missing or unknown, or its value outside the range.
    """
    keys = {f"{joint.name}_{joint.unit}": joint for joint in robot.joints}
    for key in values:
        if key not in keys:
            raise ConfigError(
                f"{source(key)}.{key} = {values[key]}: unknown, allowed are {', '.join(keys)}"
            )
    positions = []
    for key, joint in keys.items():
        if key not in values:
            raise ConfigError(f"{source(key)}.{key}: is missing")
        position = values[key] * joint.scale
        if not joint.lower <= position <= joint.upper:
            low, high = round(joint.lower / joint.scale, 6), round(joint.upper / joint.scale, 6)
            raise ConfigError(
                f"{source(key)}.{key} = {values[key]}: outside [{low}, {high}] {joint.unit}"
            )
        positions.append(position)
    return tuple(positions)


def load_programs(robot: Robot, directory: Path | str | None = None) -> dict[int, Program]:
    """Read all files of programs/ in ``directory`` and return them by RSR number.

    Raises:
        ConfigError: A file is wrong, a position is out of range or unknown, a name or RSR number
            occurs twice.
    """
    programs: dict[int, Program] = {}
    for path in sorted(locate("programs", directory).glob("*.yaml")):
        program = _load_program(path, robot)
        for other in programs.values():
            if other.rsr == program.rsr or other.name == program.name:
                raise ConfigError(
                    f"{path}: name {program.name}, rsr {program.rsr}: taken by {other.name}, "
                    f"rsr {other.rsr}"
                )
        programs[program.rsr] = program
    return programs


def _load_program(path: Path, robot: Robot) -> Program:
    """Read one program."""
    file = load(path, ProgramFile)
    positions = {
        name: joint_positions(values, robot, partial(_place, path, name))
        for name, values in file.positions.items()
    }
    steps: list[MoveStep | WaitStep | GripperStep] = []
    for number, line in unroll(file.lines):
        if isinstance(line, WaitLine):
            steps.append(WaitStep(number, line.wait_s))
        elif isinstance(line, GripperLine):
            steps.append(GripperStep(number, line.value == "on"))
        elif line.position in positions:
            steps.append(
                MoveStep(
                    number, positions[line.position], line.speed_percent, line.termination == "fine"
                )
            )
        else:
            raise ConfigError(
                f"{path}: line {number}: position {line.position!r} is unknown, there are "
                f"{', '.join(positions)}"
            )
    return Program(file.name, file.rsr, tuple(steps))


def _place(path: Path, position: str, key: str) -> str:
    """Return file, line and section of ``key``.

    If the key is not there, return those of the position.
    """
    section = YAML(typ="rt").load(path)["positions"]
    line = (
        section[position].lc.key(key)[0]
        if key in section[position]
        else section.lc.key(position)[0]
    )
    return f"{path}, line {line + 1}: positions.{position}"
