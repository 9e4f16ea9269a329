"""Where the robot stands, as a position of a program; and back as the joints of the twin."""

from __future__ import annotations

from collections.abc import Mapping

from scara_config import Robot
from scara_config.programs.files import axis_names, is_cartesian, joint_values
from scara_config.programs.tp.listing import Coordinate, GroupPosition, Position

from operator_panel.teach.draft import TeachError

DIGITS = 6
"""Behind the point [deg or mm], as the programs that come with the robots have them."""
FRAME, TOOL = "0", "1"


def position_of(robot: Robot, now: Mapping[str, float], comment: str = "") -> Position:
    """Return a position of joints; its number is chosen where it is put.

    Args:
        robot: Its joints.
        now: Their positions [rad or m] by name; a joint that the twin lacks and that is not given
            stands at 0.
        comment: Its name.
    """
    coordinates = []
    for name, joint in axis_names(robot).items():
        value = round(now[joint.name] if joint.twin else now.get(joint.name, 0.0), 12)
        coordinates.append(Coordinate(name, round(value / joint.scale, DIGITS) + 0.0, joint.unit))
    return Position(1, comment, (GroupPosition(1, FRAME, TOOL, "", tuple(coordinates)),))


def twin_target(robot: Robot, position: Position) -> list[float]:
    """Return where a position leads the twin: [rad or m], in the order of its joints.

    Raises:
        TeachError: It says where the tool is, not the joints.
    """
    if is_cartesian(position):
        raise TeachError(f"P[{position.number}] is Cartesian: touch it up to step to it")
    values = joint_values(position, robot)
    return [value for joint, value in zip(robot.joints, values) if joint.twin]
