"""The first group: does the profile agree with itself, and are its units what they say."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping

import numpy as np
from scara_config import ConfigError, Joint, Robot
from scara_config.profile import PROGRAM_ENDING
from scara_config.programs.files import (
    axis_names,
    is_cartesian,
    joint_values,
    position_faults,
)
from scara_config.programs.tp.listing import Position, Program
from scara_control.errors import ScaraControlError
from scara_control.kinematics.scara import Elbow
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_control.kinematics.tool import ScaraTool, ToolKinematics, tool_kinematics

from robot_doctor.finding import Finding, Group, Places, fine, note, or_fine, wrong

SMALL_RANGE = {"deg": 13.0, "mm": 3.0}
"""A joint that is this slow, with limits this small, was given in rad or m: 2 pi is 6.28."""
SLOW = {"deg": 25.0, "mm": 5.0}
SLOWEST_START_S = 3.0
FASTEST_START_S = 0.005
GEOMETRY_TOLERANCE = 1e-6
SAME_PLACE_M = 1e-3
"""A set position of a program further from the one of the same name than that is another; our
choice, below what a report allows at rest."""
POSES_PER_JOINT = 4


def check_robot(robot: Robot, folder: str) -> Iterator[Finding]:
    """Check robot.yaml by itself.

    Args:
        robot: The profile.
        folder: Name of the folder that it stands in; empty for a flat one.
    """
    if folder and folder != robot.name:
        advice = (
            f"give folder and `name` the same text: --robot {folder} would start a cell of "
            f"{robot.name}"
        )
        what = f"robot.yaml in robots/{folder} says name: {robot.name}"
        yield wrong(Group.ROBOT, what, advice, "robot.yaml name")
    yield fine(
        Group.ROBOT,
        f"{robot.name}: {len(robot.joints)} joints, {len(robot.twin_joints)} of them in the twin",
    )
    if not robot.lead:
        text = "lead is false: the twin follows only, and nothing is ever written to the robot"
        yield fine(Group.ROBOT, text)
    for joint in robot.joints:
        yield from _check_units(joint)
    yield from _check_screws(robot)
    yield from check_kinematics(robot)


def check_kinematics(robot: Robot) -> Iterator[Finding]:
    """Check that lengths and screws say the same.

    Check also that home and the set positions can be reached.
    """
    try:
        tool = tool_kinematics(robot)
        chain = ScrewModel.from_robot(robot)
    except ScaraControlError as error:
        yield wrong(
            Group.ROBOT,
            f"kinematics: {error}",
            "correct screw_axis, home_pose or geometry in robot.yaml",
            "robot.yaml geometry",
        )
        return
    if isinstance(tool, ScaraTool):
        worst = _closed_form_error(robot, tool, chain)
        if worst > GEOMETRY_TOLERANCE:
            advice = (
                "measure l1_mm, l2_mm and h_mm; screw_axis of joint_2 is (0, 0, 1, 0, -l1, 0), "
                "home_pose holds l1 + l2 and h"
            )
            yield wrong(
                Group.ROBOT,
                f"geometry and screw axes differ by up to {worst * 1e3:.3g} mm at the tool",
                advice,
                "robot.yaml geometry",
            )
        else:
            yield fine(Group.ROBOT, "geometry and screw axes give the same tool position")
    seed = [robot.home[joint.name] * joint.scale for joint in robot.arm_joints]
    yield from or_fine(
        _unreachable(robot, tool, seed),
        Group.ROBOT,
        f"set positions {', '.join(robot.positions_m)} are within reach",
    )


def check_programs(
    robot: Robot, programs: Mapping[str, Program | ConfigError], places: Places
) -> Iterator[Finding]:
    """Check the joint values of the robot's programs.

    Args:
        robot: The profile.
        programs: By the name of the file, or why one cannot be read.
        places: Of the files.
    """
    if not programs:
        yield note(
            Group.ROBOT,
            f"no programs/*{PROGRAM_ENDING}",
            f"write {places.programs}/ARTICLE{PROGRAM_ENDING}, which ./cell demo runs",
        )
    for file, program in programs.items():
        if isinstance(program, ConfigError):
            at = f"{file} {file}"
            yield wrong(Group.ROBOT, str(program), f"correct {places.programs}/{file}", at)
            continue
        found = [
            (position.number, text)
            for position in program.positions
            for _, text in position_faults(position, robot)
        ]
        for number, text in found:
            yield wrong(
                Group.ROBOT,
                f"{file}: P[{number}].{text}",
                f"correct {places.programs}/{file}: deg for a turning joint, mm for a sliding one",
                f"{file} P[{number}",
            )
        # Two conditions in one chain: several positions, and all of them the same.
        if len(program.positions) > 1 == len({each.groups for each in program.positions}):
            names = " and ".join(f"P[{p.number}:{p.comment}]" for p in program.positions)
            what = f"{file}: {names} are one place: it moves nothing"
            yield note(Group.ROBOT, what, f"teach another place in {places.programs}/{file}")
        if not found:
            said = f"{file}: {len(program.positions)} positions within the joints' limits"
            yield fine(Group.ROBOT, said)


def check_set_positions(
    robot: Robot, programs: Mapping[str, Program | ConfigError], places: Places
) -> Iterator[Finding]:
    """Check that programs go to the set positions whose names their positions have.

    Args:
        robot: The profile.
        programs: By the name of the file.
        places: Of the files.
    """
    try:
        tool = tool_kinematics(robot)
    except ScaraControlError:
        return  # check_kinematics says why
    for file, program in programs.items():
        for position in () if isinstance(program, ConfigError) else program.positions:
            # A Cartesian one counts from frames that only the controller has.
            if position.comment in robot.positions_m and not is_cartesian(position):
                yield from _elsewhere(robot, tool, f"{places.programs}/{file}", position)


def _elsewhere(
    robot: Robot, tool: ToolKinematics, path: str, position: Position
) -> Iterator[Finding]:
    """Yield a program's position that is not the set position of its name."""
    if any(position_faults(position, robot)):
        return  # check_programs says so
    values = dict(zip(robot.joints, joint_values(position, robot)))
    place, wanted = (
        tool.position([values[joint] for joint in tool.joints]),
        robot.positions_m[position.comment],
    )
    apart = float(np.linalg.norm(np.subtract(place, wanted)))
    if apart <= SAME_PLACE_M:
        return
    shown = ", ".join(f"{1e3 * value:.1f}" for value in place)
    what = (
        f"{path.rpartition('/')[2]}: P[{position.number}:{position.comment}] brings the tool to "
        f"({shown}) mm, {1e3 * apart:.1f} mm from positions_m.{position.comment} of robot.yaml"
    )
    advice = f"correct {path}: {_values_for(robot, tool, wanted)}"
    yield wrong(Group.ROBOT, what, advice, f"{path.rpartition('/')[2]} P[{position.number}")


def _values_for(robot: Robot, tool: ToolKinematics, wanted: tuple[float, float, float]) -> str:
    """Return joint values for a set position, or why there are none."""
    names = {joint.name: name for name, joint in axis_names(robot).items()}
    seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
    try:
        solved = tool.inverse(*wanted, _one_elbow(robot, tool, seed), seed).chosen.q
    except ScaraControlError as error:
        return str(error)
    shown = ", ".join(
        f"{names[joint.name]}= {round(value / joint.scale, 6) + 0.0:.10g} {joint.unit}"
        for joint, value in zip(tool.joints, solved, strict=True)
    )
    return f"the tool as at home gets there with {shown}"


def _one_elbow(robot: Robot, tool: ToolKinematics, seed: list[float]) -> Elbow | None:
    """Return the elbow that reaches most of the set positions, so that the arm never turns over.

    None: the arm has none by name.
    """
    if tool.elbow(seed) is None:
        return None

    def reached(elbow: Elbow) -> int:
        count = 0
        for place in robot.positions_m.values():
            try:
                tool.inverse(*place, elbow, seed)
            except ScaraControlError:
                continue
            count += 1
        return count

    return max(Elbow, key=reached)


def _check_units(joint: Joint) -> Iterator[Finding]:
    """Yield what looks like radians or metres, or like an acceleration of another unit."""
    low, high, speed = (
        joint.lower / joint.scale,
        joint.upper / joint.scale,
        joint.velocity / joint.scale,
    )
    if high - low < SMALL_RANGE[joint.unit] and speed < SLOW[joint.unit]:
        yield wrong(
            Group.ROBOT,
            f"{joint.name}: limits [{low:g}, {high:g}] {joint.unit} at {speed:g} {joint.unit}/s "
            f"look like {joint.si_unit}",
            f"give limits and speeds in {joint.unit}: multiply by {1.0 / joint.scale:.6g}; "
            f"lower_{joint.unit}: {low / joint.scale:.4g}",
            f"robot.yaml joints.{joint.name}.lower_{joint.unit}",
        )
    start = joint.velocity / joint.acceleration
    if not FASTEST_START_S <= start <= SLOWEST_START_S:
        yield note(
            Group.ROBOT,
            f"{joint.name} needs {start:.3g} s to its full speed of {speed:g} {joint.unit}/s",
            f"check acceleration_{joint.unit}_s2: {joint.unit}, not {joint.si_unit}",
        )


def _check_screws(robot: Robot) -> Iterator[Finding]:
    """Yield joints whose screw is not that of their type."""
    for joint in robot.joints:
        if joint.screw_axis is None:
            continue
        omega, v = np.array(joint.screw_axis[:3]), np.array(joint.screw_axis[3:])
        turns = bool(omega.any())
        if turns != (joint.si_unit == "rad"):
            advice = (
                "a turning joint has (omega, -omega x p) with |omega| = 1, a sliding one (0, v) "
                "with |v| = 1"
            )
            yield wrong(
                Group.ROBOT,
                f"{joint.name} is {joint.unit}, its screw_axis {list(joint.screw_axis)} is not",
                advice,
                f"robot.yaml joints.{joint.name}.screw_axis",
            )
        elif turns and abs(float(omega @ v)) > 1e-9:
            advice = "v = -omega x p for any point p of the axis is at right angles to omega"
            yield wrong(
                Group.ROBOT,
                f"{joint.name}: screw_axis {list(joint.screw_axis)} has a pitch",
                advice,
                f"robot.yaml joints.{joint.name}.screw_axis",
            )


def _closed_form_error(robot: Robot, tool: ToolKinematics, chain: ScrewModel) -> float:
    """Return the largest distance between the tool of the lengths and that of the screws [m]."""
    axes = [np.linspace(joint.lower, joint.upper, POSES_PER_JOINT) for joint in robot.arm_joints]
    poses = [[float(q) for q in pose] for pose in itertools.product(*axes)]
    return max(
        float(np.linalg.norm(tool.position(q) - forward_kinematics(chain, q)[:3, 3])) for q in poses
    )


def _unreachable(robot: Robot, tool: ToolKinematics, seed: list[float]) -> Iterator[Finding]:
    for name, (x, y, z) in robot.positions_m.items():
        try:
            tool.inverse(x, y, z, None, seed)
        except ScaraControlError as error:
            yield wrong(
                Group.ROBOT,
                f"positions_m.{name}: {error}",
                "move the position, or correct lengths and limits",
                f"robot.yaml positions_m.{name}",
            )
