"""The second group: is the simulated robot the one of the profile, joint by joint."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from scara_config import Joint, Robot
from scara_config.lengths import place_of
from scara_description.cover import COVER
from scara_description.inertia import ShapeError, ShapeNumberError, body_of, inertial_of

from robot_doctor.chain import DescribedArm, DescribedJoint
from robot_doctor.finding import Finding, Group, Places, fine, or_fine, write_urdf, wrong
from scara_description.urdf import parse_robot, tree_of

RELATIVE = 1e-6
PLACE_TOLERANCE = 1e-6
OTHER_INERTIA = 1.7
"""A body that is not as even as its shapes is less far from them: our choice."""
OTHER_COVERED = 10.0
"""As that, of one whose shapes only hold its mesh: they tell the order of magnitude."""


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
        known = name in {joint.name for joint in robot.joints}
        at = f"robot.yaml joints.{name}.twin" if known else f"URDF {name}"
        yield wrong(Group.SIMULATION, f"{name}: {what}", advice, at)
    if robot.base_frame != urdf.root:
        what = f"base_frame = {robot.base_frame}: the URDF begins with {urdf.root}"
        paste = f"`base_frame: {urdf.root}` in {places.robot}"
        yield wrong(Group.SIMULATION, what, paste, "robot.yaml base_frame")
    joints = [joint for joint in robot.twin_joints if joint.name in urdf.joints]
    lengths = list(_wrong_lengths(robot, urdf, places))
    yield from lengths
    for joint in joints:
        yield from or_fine(
            [
                *_wrong_limits(joint, urdf.joints[joint.name], places.agree(robot.name)),
                *_wrong_axis(joint, urdf.joints[joint.name], places, robot.name, bool(lengths)),
            ],
            Group.SIMULATION,
            f"{joint.name}: axis, limits, speed and effort are those of the URDF",
        )
    if not lengths:
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
            f"URDF {link}",
        )


def check_inertia(urdf: str, places: Places) -> Iterator[Finding]:
    """Hold the inertia that a person typed into a URDF against the link's mass and shapes.

    Args:
        urdf: A description that can be read.
        places: Of the files.
    """
    root = parse_robot(urdf)
    model = tree_of(root, {link.get("name", ""): () for link in root.findall("link")})
    for link in root.findall("link"):
        name = link.get("name", "")
        still = not any(joint.moves for joint in model.chain(name))
        if still or link.find("inertial/mass") is None:
            continue  # What stands has none to feel; without mass that was told.
        try:
            _, mass, _, inertia = body_of(link)
            if mass == 0.0:
                continue
            # The trace is the same however the link's frame is turned.
            computed = float(np.trace(inertial_of(link).inertia))
        except ShapeNumberError as error:
            yield wrong(Group.SIMULATION, f"{error}", f"correct {places.urdf}", f"URDF {name}")
            continue
        except ShapeError:
            continue  # A mesh has no volume here.
        except (KeyError, ValueError, ZeroDivisionError) as error:
            what = f"link {name}: its inertial or a collision shape cannot be read: {error}"
            yield wrong(Group.SIMULATION, what, f"correct {places.urdf}", f"URDF {name}")
            continue
        typed = float(np.trace(inertia))
        covered = any(shape.get("name") == COVER for shape in link.findall("collision"))
        far = OTHER_COVERED if covered else OTHER_INERTIA
        if not 1.0 / far < typed / computed < far:
            what = (
                f"link {name}: the inertia of {typed / 2.0:.4g} kg m^2 is not that of its mass and "
                f"shapes, {computed / 2.0:.4g}"
            )
            advice = f"rosrun scara_description write_inertia {places.urdf}"
            yield wrong(Group.SIMULATION, what, advice, f"URDF {name}")


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
        yield wrong(
            Group.SIMULATION, f"pid_gains.yaml: {name} {what}", advice, f"pid_gains.yaml {name}"
        )
    if held == names:
        yield fine(Group.SIMULATION, "pid_gains.yaml has both loops of each joint")


def _wrong_limits(joint: Joint, described: DescribedJoint, agree: str) -> Iterator[Finding]:
    kind = "prismatic" if joint.si_unit == "m" else "revolute"
    if described.kind != kind:
        yield wrong(
            Group.SIMULATION,
            f"{joint.name} is {kind}, in the URDF {described.kind}",
            agree,
            f"robot.yaml joints.{joint.name}.type",
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
            field = f"{key}_{joint.unit}" + ("_s" if key == "velocity" else "")
            paste = f"{agree}; by the URDF `{field}: {round(theirs, 6):.10g}`"
            yield wrong(Group.SIMULATION, what, paste, f"robot.yaml joints.{joint.name}.{field}")
    if abs(joint.effort - described.effort) > RELATIVE * joint.effort:
        what = f"{joint.name}: effort {joint.effort:g}, in the URDF {described.effort:g}"
        paste = f"{agree}; by the URDF `effort: {described.effort:g}`"
        yield wrong(Group.SIMULATION, what, paste, f"robot.yaml joints.{joint.name}.effort")


def _wrong_lengths(robot: Robot, urdf: DescribedArm, places: Places) -> Iterator[Finding]:
    """Yield the lengths of a SCARA that are not the URDF's, each once."""
    size = robot.geometry
    turning = [j.name for j in robot.arm_joints if j.unit == "deg" and j.name in urdf.joints]
    if size is None or len(turning) < 2:
        return
    tip = [urdf.tool_pose[k][3] for k in range(3)]
    ends = [place_of(urdf.joints[name].screw) for name in turning]
    ends = [*ends, (tip[0], tip[1])][:3]
    theirs = {
        "l1_mm": 1e3 * math.dist(ends[0], ends[1]),
        "l2_mm": 1e3 * math.dist(ends[1], ends[2]),
        "h_mm": 1e3 * tip[2],
    }
    for key, value in theirs.items():
        ours = getattr(size, key)
        if abs(ours - value) > 1e3 * PLACE_TOLERANCE:
            file = places.body or places.urdf
            then = f"; then: {write_urdf(robot.name)}" if places.body else ""
            yield wrong(
                Group.SIMULATION,
                f"geometry.{key} = {ours:g}: the arm of {file} has {value:.6g}",
                f"measure it: `{key}: {value:.6g}` in {places.robot}, or correct {file}{then}",
                f"robot.yaml geometry.{key}",
            )


def _wrong_axis(
    joint: Joint, described: DescribedJoint, places: Places, name: str, lengths: bool
) -> Iterator[Finding]:
    if joint.screw_axis is None:
        if described.moves_tool:
            yield wrong(
                Group.SIMULATION,
                f"{joint.name} moves the tool in the URDF",
                f"give it a screw_axis in {places.robot}",
                f"robot.yaml joints.{joint.name}.screw_axis",
            )
        return
    ours, theirs = np.array(joint.screw_axis), np.array(described.screw)
    at = f"robot.yaml joints.{joint.name}.screw_axis"
    if np.abs(ours - theirs).max() <= PLACE_TOLERANCE:
        return
    if np.abs(ours + theirs).max() <= PLACE_TOLERANCE:
        what = f"{joint.name}: the sign of its axis is the opposite of the URDF's"
        advice = (
            "jog the real joint by a positive value and look: right hand, thumb along omega; "
            f"then correct the wrong one of {places.robot} and {places.urdf}"
        )
        yield wrong(Group.SIMULATION, what, advice, at)
        return
    along, direction = (slice(0, 3), theirs[:3]) if theirs[:3].any() else (slice(3, 6), theirs[3:])
    if lengths and np.abs(np.abs(ours[along]) - np.abs(direction)).max() <= PLACE_TOLERANCE:
        if float(ours[along] @ direction) > 0.0:
            return  # It is elsewhere by the lengths, which were told.
        what = f"{joint.name}: the sign of its axis is the opposite of the URDF's"
        yield wrong(Group.SIMULATION, what, f"correct the sign in {places.robot}", at)
        return
    shown = ", ".join(f"{value + 0.0:g}" for value in theirs.round(9))
    what = f"{joint.name}: screw_axis {list(joint.screw_axis)} is not the URDF's ({shown})"
    advice = (
        f"{places.robot}: direction omega and, for a point p of the axis, v = -omega x p in m, "
        "with all joints at 0"
    )
    if not places.body:
        advice += f"; by the URDF `screw_axis: [{shown}]`"
    if places.body:
        advice += (
            f"; {places.body}: at_mm of the link that it moves is such a point, in mm; "
            f"then: {write_urdf(name)}"
        )
        at = f"body.yaml links.{described.link}.at_mm"
    yield wrong(Group.SIMULATION, what, advice, at)


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
        rows = ", ".join(f"[{', '.join(f'{x + 0.0:.9g}' for x in row)}]" for row in theirs.round(9))
        advice = (
            f"{places.robot}: home_pose is the tool's pose with all joints at 0, in m; by the URDF "
            f"`home_pose: [{rows}]`"
        )
        then = f"; then: {write_urdf(robot.name)}" if places.body else ""
        at = "robot.yaml home_pose" if robot.geometry is None else "robot.yaml geometry"
        yield wrong(Group.SIMULATION, what, f"{advice}{then}", at)
