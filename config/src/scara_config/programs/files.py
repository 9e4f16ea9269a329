"""Read files of config/programs/, checked against robot.yaml."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import msgspec
from ruamel.yaml import YAML

from scara_config.loader import ConfigError, load
from scara_config.programs.lines import (
    GripperLine,
    GripperStep,
    MoveStep,
    ProgramFile,
    WaitLine,
    WaitStep,
    unroll,
)
from scara_config.robot import Robot


class ProgramSteps(msgspec.Struct, frozen=True):
    """A program of a file: its loops are unrolled, its positions are [rad] or [m].

    Attributes:
        name: As the robot calls it.
        rsr: The number of the signal that starts it.
        steps: In the order of execution; joint positions in the order of robot.yaml, all joints.
    """

    name: str
    rsr: int
    steps: tuple[MoveStep | WaitStep | GripperStep, ...]


def read_program(path: Path, robot: Robot) -> ProgramSteps:
    """Read one file of programs/.

    Raises:
        ConfigError: The file is wrong, or a position is out of range or unknown.
    """
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
    return ProgramSteps(file.name, file.rsr, tuple(steps))


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
