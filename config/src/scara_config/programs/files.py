"""Read the robot's programs, ``programs/NAME.LS``, checked against robot.yaml."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import msgspec

from scara_config.loader import ConfigError, load_text
from scara_config.profile import PROGRAM_ENDING, PROGRAMS, locate
from scara_config.programs.configuration import configuration_fault
from scara_config.programs.steps import Step
from scara_config.programs.tp.execution import Flow, flow_of
from scara_config.programs.tp.listing import Position, Program
from scara_config.programs.tp.reader import read
from scara_config.programs.tp.values import POSE_NUMBERS, Pose
from scara_config.programs.walk import check_motions
from scara_config.robot import Joint, Robot

TIP = ("X", "Y", "Z", "W", "P", "R")
"""Coordinates of a Cartesian position; what is left of its numbers is E1 to E3."""
MOST_EXTERNAL = POSE_NUMBERS - len(TIP)


class TaughtPose(msgspec.Struct, frozen=True):
    """A position of a program as it stands in its file.

    Attributes:
        pose: Its numbers.
        frame: UF; None: the one that is selected.
        tool: UT.
    """

    pose: Pose
    frame: int | None
    tool: int | None


class Taught(msgspec.Struct, frozen=True):
    """A program that was read and checked.

    Attributes:
        flow: Its lines.
        positions: Joint positions by number: [rad or m] in the order of robot.yaml, all joints;
            without those that are Cartesian.
        poses: All positions by number, as they stand in the file.
        streams: It is the client's stream: its motion goes on to PR[1] as it is in each period.
    """

    flow: Flow
    positions: dict[int, tuple[float, ...]]
    poses: dict[int, TaughtPose] = {}
    streams: bool = False

    @property
    def name(self) -> str:
        """As the robot calls it."""
        return self.flow.program.name


class ProgramSteps(msgspec.Struct, frozen=True):
    """What a program makes the robot do: its loops are unrolled.

    Attributes:
        name: As the robot calls it.
        steps: In the order of execution.
    """

    name: str
    steps: tuple[Step, ...]


def program_files(directory: Path | str | None = None) -> dict[str, Path]:
    """Return the files of the chosen robot's programs by the program's name.

    Args:
        directory: Folder with all YAML files; default: the package scara_config.

    Raises:
        ConfigError: Two files have the same name but for small letters.
    """
    found: dict[str, Path] = {}
    for path in sorted(locate(PROGRAMS, directory).glob(f"*{PROGRAM_ENDING}")):
        # The robot knows capitals alone; a file system may keep small letters apart.
        if path.stem.upper() in found:
            raise ConfigError(f"{path}: {found[path.stem.upper()].name} is there too; rename one")
        found[path.stem.upper()] = path
    return found


def program_path(name: str, directory: Path | str | None = None) -> Path:
    """Return the file of a program of the robot, by its name or as it is: ``NAME.LS``.

    Raises:
        ConfigError: There is none of that name; the text lists those that exist.
    """
    if name.upper().endswith(PROGRAM_ENDING):
        return Path(name)
    known = program_files(directory)
    if name.upper() not in known:
        raise ConfigError(f"unknown program {name!r}: there are {', '.join(known)}")
    return known[name.upper()]


def read_listing(path: Path) -> Program:
    """Read one file of programs/ as it stands there.

    Raises:
        ConfigError: It cannot be read, is no program, or its program has another name.
    """
    program = read(load_text(path), str(path))
    if program.name != path.stem.upper():
        raise ConfigError(f"{path}: /PROG {program.name}: a file has the name of its program")
    return program


def read_taught(path: Path, robot: Robot) -> Taught:
    """Read one file of programs/.

    Raises:
        ConfigError: The file is wrong, or a position is out of range.
    """
    program = read_listing(path)
    for position in program.positions:
        for coordinate, fault in position_faults(position, robot):
            place = f"{path}{_row_of(path, position.number, coordinate)}"
            raise ConfigError(f"{place}: P[{position.number}].{fault}")
    return taught_of(program, robot, str(path))


def taught_of(program: Program, robot: Robot, source: str) -> Taught:
    """Return a program whose positions have no faults, checked.

    Raises:
        ConfigError: Its lines are wrong; the text begins with ``source``.
    """
    positions = {
        position.number: joint_values(position, robot)
        for position in program.positions
        if not is_cartesian(position)
    }
    poses = {position.number: taught_pose(position, robot) for position in program.positions}
    flow = flow_of(program, source)
    check_motions(flow, poses, source)
    return Taught(flow, positions, poses)


def checked_listing(text: str, robot: Robot, source: str) -> Program:
    """Return a program from its text, held to what a robot can do.

    Raises:
        ConfigError: It is no program, or has a fault; the text begins with ``source``.
    """
    program = read(text, source)
    for position in program.positions:
        for _, fault in position_faults(position, robot):
            raise ConfigError(f"{source}: P[{position.number}].{fault}")
    taught_of(program, robot, source)
    return program


def axis_names(robot: Robot) -> dict[str, Joint]:
    """Return the joints by the names of a position's coordinates.

    The arm's are J1, J2 ..; what does not move the tool is an external axis, E1.
    """
    arm = [joint for joint in robot.joints if joint.screw_axis is not None]
    external = [joint for joint in robot.joints if joint.screw_axis is None]
    return {f"J{joint.axis_number}": joint for joint in arm} | {
        f"E{number}": joint for number, joint in enumerate(external, start=1)
    }


def position_faults(position: Position, robot: Robot) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with a position: the coordinate, and a text that begins with it."""
    for group in position.groups:
        if group.number != 1:
            name = f"GP{group.number}"
            yield name, f"{name}: the robot has motion group 1 alone"
    axes: dict[str, Joint | None] = dict(axis_names(robot))
    if is_cartesian(position):
        external = {name: axis for name, axis in axes.items() if name.startswith("E")}
        axes = dict.fromkeys(TIP) | external
        config = position.groups[0].config
        if fault := configuration_fault(config, robot):
            yield "CONFIG", f"CONFIG : '{config}': {fault}"
        for name in list(external)[MOST_EXTERNAL:]:
            last = f"E{MOST_EXTERNAL}"
            yield name, f"{name}: a Cartesian position has E1 to {last}: teach it in joints"
    given = {each.name: each for each in position.groups[0].coordinates}
    for name in given:
        if name not in axes:
            yield name, f"{name}: unknown, allowed are {', '.join(axes)}"
    for name, joint in axes.items():
        coordinate = given.get(name)
        if coordinate is None or coordinate.value is None:
            yield name, f"{name}: is missing"
            continue
        if joint is None:
            continue
        shown = f"{name} = {coordinate.value:.10g} {coordinate.unit}"
        if coordinate.unit != joint.unit:
            yield name, f"{shown}: {joint.name} is in {joint.unit}"
        elif outside := _outside(joint, coordinate.value):
            yield name, f"{shown}: {outside}"


def is_cartesian(position: Position) -> bool:
    """Tell whether a position says where the tool is."""
    return any(each.name in TIP for each in position.groups[0].coordinates)


def taught_pose(position: Position, robot: Robot) -> TaughtPose:
    """Return a position without faults, with its frames."""
    group = position.groups[0]
    given = {each.name: each.value or 0.0 for each in group.coordinates}
    values = [0.0] * POSE_NUMBERS
    if is_cartesian(position):
        values[: len(TIP)] = [given[name] for name in TIP]
    for name, joint in axis_names(robot).items():
        if name in given:
            # E1 comes behind the six numbers of the tool.
            external = len(TIP) + int(name[1:]) - 1
            values[external if is_cartesian(position) else joint.axis_number - 1] = given[name]
    frame, tool = (int(each) if each.isdigit() else None for each in (group.frame, group.tool))
    config = group.config if is_cartesian(position) else None
    return TaughtPose(Pose(tuple(values), config), frame, tool)


def joint_values(position: Position, robot: Robot) -> tuple[float, ...]:
    """Return a position without faults as joint positions [rad or m], in robot.yaml's order."""
    given = {each.name: each.value or 0.0 for each in position.groups[0].coordinates}
    values = {joint.name: given[name] * joint.scale for name, joint in axis_names(robot).items()}
    return tuple(values[joint.name] for joint in robot.joints)


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
        if outside := _outside(joint, values[key]):
            raise ConfigError(f"{source(key)}.{key} = {values[key]}: {outside}")
        positions.append(values[key] * joint.scale)
    return tuple(positions)


def _outside(joint: Joint, value: float) -> str:
    """Say that a position in the joint's own unit is outside its range, or nothing."""
    if joint.lower <= value * joint.scale <= joint.upper:
        return ""
    low, high = round(joint.lower / joint.scale, 6), round(joint.upper / joint.scale, 6)
    return f"outside [{low}, {high}] {joint.unit}"


def _row_of(path: Path, number: int, coordinate: str) -> str:
    """Return where a position's coordinate stands; if it does not, where the position begins."""
    found = ""
    inside = False
    for row, text in enumerate(load_text(path).splitlines(), start=1):
        if re.match(r"P\[\d+", text):
            inside = bool(re.match(rf"P\[{number}[:\]]", text))
            found = f", line {row}" if inside else found
        elif inside and re.search(rf"\b{coordinate}\s*[=:]", text):
            return f", line {row}"
    return found
