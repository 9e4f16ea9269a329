"""Where the robot stands, as a position of a program; and back as the joints of the twin."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from scara_config import Robot
from scara_config.programs.files import axis_names, is_cartesian, joint_values
from scara_config.programs.tp.listing import Coordinate, GroupPosition, Position, Program

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
    state = snapshot.state
    if state is None or not (state.twin_standing_still and state.real_standing_still):
        raise TeachError("a position is taken while both robots stand still: wait, or STOP")
    if state.diverged:
        raise TeachError("the tools are apart: Align first, or take the place of one of them")
    return twin_at(robot, snapshot)


def twin_at(robot: Robot, snapshot: Snapshot) -> dict[str, float]:
    """Return where all joints of the twin are [rad or m]; what it lacks, of the real robot.

    Raises:
        TeachError: A joint is not known.
    """
    try:
        now = positions_now(robot, snapshot)
    except StepError as error:
        raise TeachError(str(error)) from error
    return real_at(robot, snapshot, {joint.name for joint in robot.joints if not joint.twin}) | now


def real_at(robot: Robot, snapshot: Snapshot, names: Collection[str] = ()) -> dict[str, float]:
    """Return where joints of the real robot are [rad or m]; without names all of them.

    Raises:
        TeachError: One is not known.
    """
    package = snapshot.package
    shown = dict(zip(package.name, package.position)) if package is not None else {}
    wanted = [joint for joint in robot.joints if joint.name in names or not names]
    for joint in wanted:
        if joint.name not in shown:
            raise TeachError(f"where {joint.name} is, is not known: the robot does not tell it")
    return {joint.name: shown[joint.name] * joint.scale for joint in wanted}


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


def joints_of(robot: Robot, program: Program, number: int) -> dict[str, float]:
    """Return where a position leads all joints [rad or m].

    Raises:
        TeachError: It says where the tool is, not the joints.
    """
    position = next(each for each in program.positions if each.number == number)
    if is_cartesian(position):
        raise TeachError(f"P[{number}] is Cartesian: touch it up first")
    return dict(zip((joint.name for joint in robot.joints), joint_values(position, robot)))


def twin_target(robot: Robot, position: Position) -> list[float]:
    """Return where a position leads the twin: [rad or m], in the order of its joints.

    Raises:
        TeachError: It says where the tool is, not the joints.
    """
    if is_cartesian(position):
        raise TeachError(f"P[{position.number}] is Cartesian: its joints are not known")
    values = joint_values(position, robot)
    return [value for joint, value in zip(robot.joints, values) if joint.twin]
