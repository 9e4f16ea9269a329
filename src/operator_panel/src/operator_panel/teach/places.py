"""Where the robot stands, as a position of a program; and back as the joints of the twin."""

from __future__ import annotations

from collections.abc import Mapping

from scara_config import Robot
from scara_config.programs.files import axis_names, is_cartesian, joint_values
from scara_config.programs.tp.listing import Coordinate, GroupPosition, Position

from operator_panel.control.steps import StepError, positions_now
from operator_panel.teach.draft import TeachError
from operator_panel.view.snapshot import Snapshot

DIGITS = 6
"""Behind the point [deg or mm], as the programs that come with the robots have them."""
FRAME, TOOL = "0", "1"


def stands_at(robot: Robot, snapshot: Snapshot) -> dict[str, float]:
    """Return where all joints are [rad or m]: of the twin, what it lacks of the real robot.

    Raises:
        TeachError: The sides move or disagree, or a joint is not known.
    """
    state, package = snapshot.state, snapshot.package
    if state is None or not (state.twin_standing_still and state.real_standing_still):
        raise TeachError("a position is taken while both robots stand still: wait, or STOP")
    if state.diverged:
        raise TeachError("the tools are apart: Align first, so that both stand there")
    try:
        now = positions_now(robot, snapshot)
    except StepError as error:
        raise TeachError(str(error)) from error
    shown = dict(zip(package.name, package.position)) if package is not None else {}
    for joint in robot.joints:
        if not joint.twin and joint.name not in shown:
            raise TeachError(f"where {joint.name} is, is not known: the robot does not tell it")
        now.setdefault(joint.name, shown.get(joint.name, 0.0) * joint.scale)
    return now


def position_of(robot: Robot, now: Mapping[str, float], comment: str = "") -> Position:
    """Return a position of joints; its number is chosen where it is put.

    Args:
        robot: Its joints.
        now: Their positions [rad or m] by name.
        comment: Its name.
    """
    coordinates = []
    for name, joint in axis_names(robot).items():
        value = round(now[joint.name] / joint.scale, DIGITS)
        coordinates.append(Coordinate(name, value + 0.0, joint.unit))
    return Position(1, comment, (GroupPosition(1, FRAME, TOOL, "", tuple(coordinates)),))


def twin_target(robot: Robot, position: Position) -> list[float]:
    """Return where a position leads the twin: [rad or m], in the order of its joints.

    Raises:
        TeachError: It says where the tool is, not the joints.
    """
    if is_cartesian(position):
        raise TeachError(f"P[{position.number}] is Cartesian: its joints are not known")
    values = joint_values(position, robot)
    return [value for joint, value in zip(robot.joints, values) if joint.twin]
