"""The arm's body as boxes that hold it in every pose, from a URDF that must fit the profile."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import msgspec
import numpy as np
import numpy.typing as npt
from scara_config import ConfigError, Joint, Robot
from scara_config.loader import load_text

from scara_description.urdf import Model, Shape, UrdfError, link_pose, origin_transform, parse_urdf

FloatArray = npt.NDArray[np.float64]
Place = tuple[float, float, float]
CELL = 0.075
"""Longest piece into which a box is cut where it turns [m]: our choice, a hand's width."""
AGREE = 1e-3
"""So far profile and URDF may differ [m], and their directions [1]."""


class BodyPart(msgspec.Struct, frozen=True):
    """A piece of a link.

    Attributes:
        link: Its name.
        carried_by: The last joint of the arm that moves it.
        middle: Where it is with all joints at 0, in the base frame [m].
        half: Half edges of a box along the base frame that holds it in every pose [m].
    """

    link: str
    carried_by: str
    middle: Place
    half: Place


def read_body(robot: Robot) -> Model:
    """Read the URDF of a profile.

    Raises:
        ConfigError: It is missing, cannot be read, or is another robot's: its tool or an axis is
            elsewhere, or nothing of it would be seen beyond a joint.
    """
    try:
        model = parse_urdf(load_text(robot.description), seen=False)
        tool = link_pose(model, robot.tool_frame, {})[:3, 3]
    except UrdfError as error:
        raise ConfigError(f"{robot.urdf}: cannot be read: {error}") from error
    ours = np.array([row[3] for row in robot.home_pose[:3]])
    if np.linalg.norm(ours - tool) > AGREE:
        raise ConfigError(
            f"robot.yaml: home_pose: the tool at ({_mm(ours)}) mm: Expected ({_mm(tool)}) mm, "
            f"where {robot.tool_frame} of {robot.urdf} is with all joints at 0"
        )
    by_name = {joint.name: joint for joint in model.joints if joint.moves}
    for joint in robot.arm_joints:
        if joint.name not in by_name:
            raise ConfigError(f"{robot.urdf}: {joint.name}: is missing: Expected as in robot.yaml")
        frame = by_name[joint.name]
        pose = link_pose(model, frame.child, {})
        _check_axis(robot, joint, pose[:3, :3] @ np.array(frame.axis), pose[:3, 3])
    return model


def body_parts(robot: Robot, model: Model) -> tuple[BodyPart, ...]:
    """Return the pieces of all links that the arm's joints move.

    Args:
        robot: The profile.
        model: Its URDF with the shapes that collide.

    Raises:
        ConfigError: Behind a joint there is no shape before the next joint.
    """
    joints = {joint.name: joint for joint in robot.arm_joints}
    found: list[BodyPart] = []
    for link, shapes in model.shapes.items():
        carriers = [each.name for each in model.chain(link) if each.name in joints]
        if carriers and shapes:
            pose = link_pose(model, link, {})
            axis = _common_axis([joints[name] for name in carriers])
            for shape in shapes:
                boxes = _pieces(pose @ origin_transform(shape.xyz, shape.rpy), shape, axis)
                found += [BodyPart(link, carriers[-1], middle, half) for middle, half in boxes]
    for name in joints:
        if not any(part.carried_by == name for part in found):
            raise ConfigError(
                f"{robot.urdf}: no <collision> of what {name} moves: "
                "Expected boxes or cylinders around the link, or zones do not see it"
            )
    return tuple(found)


def _check_axis(robot: Robot, joint: Joint, direction: FloatArray, place: FloatArray) -> None:
    """Refuse a screw axis that is not the URDF's, sign and place."""
    screw = np.array(joint.screw_axis)
    turns = joint.si_unit == "rad"
    # A turning screw's v is p x omega, so an axis that is parallel but elsewhere is seen as well.
    theirs = np.array([*direction, *np.cross(place, direction)])
    if not turns:
        theirs = np.array([*np.zeros(3), *direction])
    if np.abs(screw - theirs).max() > AGREE:
        # Adding 0.0 makes 0.0 of -0.0: the text is there to be copied into robot.yaml.
        shown = ", ".join(f"{value:.6g}" for value in theirs.round(9) + 0.0)
        raise ConfigError(
            f"robot.yaml: joints.{joint.name}.screw_axis = {[*map(float, screw)]}: "
            f"Expected [{shown}], its axis in {robot.urdf}"
        )


def _common_axis(carriers: Sequence[Joint]) -> int | None:
    """Return along which axis of the base frame all turns are; None: along none."""
    turns = [np.abs(joint.screw_axis[:3]) for joint in carriers if joint.screw_axis]
    turns = [turn for turn in turns if turn.any()]
    for axis in range(3):
        # The cosine of a small lean differs from 1 by half of the lean's square.
        if all(turn[axis] > 1.0 - AGREE**2 for turn in turns):
            return axis
    return None


def _pieces(pose: FloatArray, shape: Shape, axis: int | None) -> Iterator[tuple[Place, Place]]:
    """Yield middles and half edges of what holds a shape that turns about one axis or about any.

    A ball, and a cylinder along the axis, are their own circle. Another shape is cut: about one
    axis a piece keeps its extent along it; across it stays within a circle.
    """
    size = np.array(shape.size)
    if shape.kind == "box":
        half = 0.5 * size
    elif shape.kind == "cylinder":
        half = np.array([size[0], size[0], 0.5 * size[1]])
    else:
        half = np.full(3, size[0])
    # Half edges of the box along the base frame around the shape as it stands with joints at 0.
    half = np.abs(pose[:3, :3]) @ half
    along = axis is not None and abs(pose[axis, 2]) > 1.0 - AGREE**2
    if shape.kind == "sphere" or (shape.kind == "cylinder" and along):
        yield _place(pose[:3, 3]), _place(half)
        return
    turned = np.array([k != axis for k in range(3)])
    count = np.ones(3, dtype=int)
    # Only the longest edge is cut: each piece is one more point that is watched all the time.
    longest = int(np.argmax(np.where(turned, half, 0.0)))
    # Rounding must not add a piece to a box that is just so many cells long.
    count[longest] = math.ceil(2.0 * half[longest] / CELL - 1e-9)
    cell = 2.0 * half / count
    # However the link turns, a piece stays within half of its diagonal around its middle.
    held = np.where(turned, 0.5 * np.linalg.norm(cell[turned]), 0.5 * cell)
    for number in np.ndindex(*count.tolist()):
        yield _place(pose[:3, 3] - half + (np.array(number) + 0.5) * cell), _place(held)


def _place(values: FloatArray) -> Place:
    x, y, z = values.tolist()
    return x, y, z


def _mm(place: FloatArray) -> str:
    return ", ".join(f"{value:.1f}" for value in 1e3 * place + 0.0)
