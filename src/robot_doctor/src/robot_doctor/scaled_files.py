"""What of a new SCARA's other files follows from its joints: programs, start and plants."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from scara_config import Robot
from scara_config.programs.files import axis_names
from scara_config.programs.tp.listing import Coordinate, GroupPosition, Position
from scara_control.kinematics.scara import Elbow
from scara_control.kinematics.tool import tool_kinematics

from robot_doctor.new_scara import HEIGHT_MM, ScaraSize

TWO_POINTS: Mapping[str, Mapping[str, float]] = {
    "A": {"joint_1": -30.0, "joint_2": 60.0, "joint_3": 0.7},
    "B": {"joint_1": 45.0, "joint_2": 20.0, "joint_3": 0.25, "joint_4": 90.0, "table_joint": 60.0},
}
"""Of TWO_POINT: in deg, joint 3 in parts of the stroke from its upper end."""
BLOCK = r"(?:    .*\n)+"
"""Lines of an axis in a plant."""


def positions_of(program: str, robot: Robot, size: ScaraSize) -> tuple[Position, ...]:
    """Return the positions of a program: set positions with one elbow, or two points.

    Raises:
        ScaraControlError: A set position is out of reach or outside the limits.
    """
    found: dict[str, Mapping[str, float]] = {}
    if program == "TWO_POINT":
        for name, values in TWO_POINTS.items():
            height = HEIGHT_MM - values["joint_3"] * size.stroke_mm
            found[name] = {**values, "joint_3": size.lift_mm(height)}
    else:
        tool = tool_kinematics(robot)
        seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
        for name, place in robot.positions_m.items():
            q = tool.inverse(*place, Elbow.RIGHTY, seed).chosen.q
            found[name] = {j.name: value / j.scale for j, value in zip(tool.joints, q)}
    return tuple(
        Position(number, name, (_group(robot, values),))
        for number, (name, values) in enumerate(found.items(), start=1)
    )


def _group(robot: Robot, values: Mapping[str, float]) -> GroupPosition:
    """Return a position by joint values in deg and mm; 0 where none is given."""
    coordinates = tuple(
        Coordinate(axis, round(values.get(joint.name, 0.0), 9) + 0.0, joint.unit)
        for axis, joint in axis_names(robot).items()
    )
    return GroupPosition(1, "0", "1", "", coordinates)


def started(emulator: str, robot: Robot) -> str:
    """Return emulator.yaml with the robot's home as the start of its stand-in."""
    lines = "".join(
        f"  {joint.name}_{joint.unit}: {robot.home.get(joint.name, 0.0):.10g}\n"
        for joint in robot.joints
    )
    return re.sub(r"(?<=\n)(start_position:.*\n)(?:  .*\n)+", rf"\g<1>{lines}", emulator)


def of_joints(plant: str, joints: Sequence[str]) -> str:
    """Return a plant without the axes that the robot has not, of the lengths in robot.yaml."""
    for axis in re.findall(r"(?m)^  (\w+):.*\n(?=    )", plant.partition("\naxes:")[2]):
        if axis not in joints:
            plant = re.sub(rf"(?m)^  {axis}:.*\n{BLOCK}", "", plant)
    return re.sub(
        r"(?m)^geometry:.*\n(?:  .*\n)*", "geometry: null    # as robot.yaml says\n", plant
    )
