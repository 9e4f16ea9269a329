"""Read emulator.yaml and config/programs/*.yaml, checked against robot.yaml."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from ruamel.yaml import YAML
from scara_config import ConfigError, Robot, load, locate

from fanuc_emulator.plant.config import Plant, load_plant
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


class EmulatorFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The file emulator.yaml: how the robot was set up."""

    host: str
    port: Annotated[int, Meta(ge=1, le=65535)]
    start_position: dict[str, float]
    cold_start_override_percent: Annotated[int, Meta(ge=1, le=100)]
    safety_speed_percent: Annotated[int, Meta(ge=1, le=100)]
    heartbeat_timeout_ms: Annotated[int, Meta(ge=10, le=10000)]
    gripper_timeout_ms: Annotated[int, Meta(ge=10, le=10000)]
    stream_program: Annotated[str, Meta(pattern=r"^[A-Z][A-Z0-9_]{0,15}$")]
    desk_heartbeat_timeout_ms: Annotated[int, Meta(ge=10, le=10000)] | None = None


class PendantPageFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file pendant_page.yaml: where the pendant's page is served."""

    host: str
    port: Annotated[int, Meta(ge=1, le=65535)]


class EmulatorConfig(EmulatorFile, frozen=True, kw_only=True):
    """The file emulator.yaml, and the plant that says how the robot moves."""

    plant: Plant

    @property
    def dt(self) -> float:
        """Servo period: the stand-in's step [s]."""
        return self.plant.dt


def load_emulator(
    robot: Robot, directory: Path | str | None = None, plant: str | None = None
) -> EmulatorConfig:
    """Read emulator.yaml and a plant of ``directory`` (default: the package scara_config).

    Args:
        robot: robot.yaml.
        directory: Folder with all YAML files.
        plant: Its name; default: what ``SCARA_PLANT`` says, else ``ideal``.

    Raises:
        ConfigError: A file is missing or wrong, or the start position is out of range.
    """
    path = locate("emulator.yaml", directory)
    file = load(path, EmulatorFile)
    joint_positions(file.start_position, robot, lambda _: f"{path}: start_position")
    fields = {name: getattr(file, name) for name in EmulatorFile.__struct_fields__}
    return EmulatorConfig(plant=load_plant(robot, directory, plant), **fields)


def on_a_desk(config: EmulatorConfig) -> EmulatorConfig:
    """Return the configuration for a stand-in whose client runs on the same machine."""
    patience = max(config.heartbeat_timeout_ms, config.desk_heartbeat_timeout_ms or 0)
    return msgspec.structs.replace(config, heartbeat_timeout_ms=patience)


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


def load_pendant_page(directory: Path | str | None = None) -> PendantPageFile:
    """Read pendant_page.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or a value does not fit.
    """
    return load(locate("pendant_page.yaml", directory), PendantPageFile)
