"""The second group: is the simulated robot the one of the profile, joint by joint."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scara_config import Joint, Robot

from robot_doctor.chain import DescribedArm, DescribedJoint
from robot_doctor.finding import Finding, Group, Places, fine, or_fine, write_urdf, wrong

RELATIVE = 1e-6
PLACE_TOLERANCE = 1e-6


def check_description(robot: Robot, urdf: DescribedArm, places: Places) -> Iterator[Finding]:
    """Hold a URDF against the profile.

    Args:
        robot: The profile.
        urdf: What the URDF says.
        places: Of the files.
    """
    names = [joint.name for joint in robot.twin_joints]
    for name in sorted(set(names) ^ set(urdf.joints)):
        what = "the URDF does not move" if name in names else "the URDF moves and the twin does not"
        advice = (
            f"set `twin` of {name} in {places.robot}, or its type in {places.body or places.urdf}, "
            "so that both move the same joints"
        )
        if name not in {joint.name for joint in robot.joints}:
            advice = f'this robot has no {name}: type="fixed" in {places.body or places.urdf}'
        yield wrong(Group.SIMULATION, f"{name}: {what}", advice)
    joints = [joint for joint in robot.twin_joints if joint.name in urdf.joints]
    for joint in joints:
        yield from or_fine(
            [
                *_wrong_limits(joint, urdf.joints[joint.name], places.agree(robot.name)),
                *_wrong_axis(joint, urdf.joints[joint.name], places, robot.name),
            ],
            Group.SIMULATION,
            f"{joint.name}: axis, limits, speed and effort are those of the URDF",
        )
    yield from or_fine(
        _wrong_tool(robot, urdf, places),
        Group.SIMULATION,
        "the tool frame at zero joints is that of home_pose",
    )
    for link in urdf.massless:
        yield wrong(
            Group.SIMULATION,
            f"link {link} has no mass",
            f"give it an inertial in {places.body or places.urdf}: a physics engine assumes 1 kg",
        )


def check_gains(robot: Robot, gains: Any) -> Iterator[Finding]:
    """Check that pid_gains.yaml names the twin's joints.

    Args:
        robot: The profile.
        gains: The parsed file.
    """
    held, names = (
        set(gains) if isinstance(gains, Mapping) else set(),
        {joint.name for joint in robot.twin_joints},
    )
    for name in sorted(held ^ names):
        what = "is missing" if name in names else "is no joint of the twin"
        advice = (
            "each joint that the twin moves needs a position and a velocity loop: "
            f"rosrun scara_simulation propose_gains --robot {robot.name} --overwrite"
        )
        yield wrong(Group.SIMULATION, f"pid_gains.yaml: {name} {what}", advice)
    if held == names:
        yield fine(Group.SIMULATION, "pid_gains.yaml has both loops of each joint")


def _wrong_limits(joint: Joint, described: DescribedJoint, agree: str) -> Iterator[Finding]:
    kind = "prismatic" if joint.si_unit == "m" else "revolute"
    if described.kind != kind:
        yield wrong(
            Group.SIMULATION,
            f"{joint.name} is {kind}, in the URDF {described.kind}",
            agree,
        )
        return
    for key, unit in (("lower", ""), ("upper", ""), ("velocity", "/s")):
        ours, theirs = getattr(joint, key) / joint.scale, getattr(described, key) / joint.scale
        if abs(ours - theirs) > RELATIVE * max(1.0, abs(ours)):
            beyond = {"lower": ours < theirs, "upper": ours > theirs, "velocity": ours > theirs}[
                key
            ]
            what = (
                f"{joint.name}: {key} {ours:g} {joint.unit}{unit} is "
                f"{'beyond' if beyond else 'not'} the URDF's {theirs:g}"
            )
            yield wrong(Group.SIMULATION, what, agree)
    if abs(joint.effort - described.effort) > RELATIVE * joint.effort:
        what = f"{joint.name}: effort {joint.effort:g}, in the URDF {described.effort:g}"
        yield wrong(Group.SIMULATION, what, agree)


def _wrong_axis(
    joint: Joint, described: DescribedJoint, places: Places, name: str
) -> Iterator[Finding]:
    if joint.screw_axis is None:
        if described.moves_tool:
            yield wrong(
                Group.SIMULATION,
                f"{joint.name} moves the tool in the URDF",
                f"give it a screw_axis in {places.robot}",
            )
        return
    ours, theirs = np.array(joint.screw_axis), np.array(described.screw)
    if np.abs(ours - theirs).max() <= PLACE_TOLERANCE:
        return
    if np.abs(ours + theirs).max() <= PLACE_TOLERANCE:
        what = f"{joint.name}: the sign of its axis is the opposite of the URDF's"
        advice = (
            "jog the real joint by a positive value and look: right hand, thumb along omega; "
            f"then correct the wrong one of {places.robot} and {places.urdf}"
        )
        yield wrong(Group.SIMULATION, what, advice)
        return
    shown = ", ".join(f"{value:g}" for value in theirs.round(9))
    what = f"{joint.name}: screw_axis {list(joint.screw_axis)} is not the URDF's ({shown})"
    advice = (
        f"{places.robot}: direction omega and, for a point p of the axis, v = -omega x p in m, "
        "with all joints at 0"
    )
    if places.body:
        advice += (
            f"; {places.body}: at_mm of the link that it moves is such a point, in mm; "
            f"then: {write_urdf(name)}"
        )
    yield wrong(Group.SIMULATION, what, advice)


def _wrong_tool(robot: Robot, urdf: DescribedArm, places: Places) -> Iterator[Finding]:
    ours, theirs = np.array(robot.home_pose, dtype=float), np.array(urdf.tool_pose)
    distance, turned = (
        float(np.linalg.norm(ours[:3, 3] - theirs[:3, 3])),
        float(np.abs(ours[:3, :3] - theirs[:3, :3]).max()),
    )
    if distance > PLACE_TOLERANCE or turned > PLACE_TOLERANCE:
        what = (
            f"home_pose is {distance * 1e3:.3g} mm from the URDF's {robot.tool_frame}, its "
            f"rotation differs by {turned:.3g}"
        )
        advice = f"{places.robot}: home_pose is the tool's pose with all joints at 0, in m"
        then = f"; then: {write_urdf(robot.name)}" if places.body else ""
        yield wrong(Group.SIMULATION, what, f"{advice}{then}")
