"""The screws that a URDF has, to be held against those of robot.yaml.

They are read from the text, without a physics engine.
"""

from __future__ import annotations

import msgspec
import numpy as np
from numpy.typing import NDArray

from scara_description.urdf import JointFrame, UrdfError, link_pose, parse_robot, tree_of

FloatArray = NDArray[np.float64]


class DescribedArmError(ValueError):
    """The text is no URDF of a robot with that tool frame."""


class DescribedJoint(msgspec.Struct, frozen=True):
    """A movable joint of a URDF.

    Attributes:
        kind: ``revolute``, ``prismatic`` or another URDF type.
        screw: Unit screw (omega, v) in the root's frame with all joints at 0.
        lower, upper: Limits [rad] or [m].
        velocity, effort: Largest ones.
        moves_tool: It is on the way from the root to the tool frame.
        link: That it moves.
    """

    kind: str
    screw: tuple[float, ...]
    lower: float
    upper: float
    velocity: float
    effort: float
    moves_tool: bool
    link: str = ""


class DescribedArm(msgspec.Struct, frozen=True):
    """What of a URDF can be held against a profile.

    Attributes:
        joints: Movable joints by name.
        links: Names of all links.
        massless: Links that move, have a body and no mass.
        root: The link in whose frame all is.
        tool_pose: Pose of the tool frame in the root's with all joints at 0, row by row.
    """

    joints: dict[str, DescribedJoint]
    links: frozenset[str]
    massless: tuple[str, ...]
    root: str
    tool_pose: tuple[tuple[float, ...], ...]


def read_description(text: str, tool_frame: str) -> DescribedArm:
    """Read a URDF.

    Raises:
        DescribedArmError: No XML, no tree, no link of the name ``tool_frame``, a joint without
            limit.
    """
    try:
        robot = parse_robot(text)
        links = {link.get("name", ""): link for link in robot.findall("link")}
        if tool_frame not in links:
            raise DescribedArmError(f"it has no link {tool_frame}: it has {', '.join(links)}")
        # Without their shapes: a mesh is no fault here.
        model = tree_of(robot, dict.fromkeys(links, ()))
        on_the_way = model.chain(tool_frame)
        joints = {
            joint.name: _described(joint, link_pose(model, joint.child, {}), joint in on_the_way)
            for joint in model.joints
            if joint.moves
        }
        tool = link_pose(model, tool_frame, {})
    except UrdfError as error:
        raise DescribedArmError(f"it cannot be read: {error}") from error
    moved = {
        joint.child for joint in model.joints if any(j.moves for j in model.chain(joint.child))
    }
    massless = [
        name
        for name, link in links.items()
        # A frame needs none, nor what stands: nothing has to move it.
        if name in moved
        and link.find("collision") is not None
        and link.find("inertial/mass") is None
    ]
    rows = tuple(tuple(row) for row in tool.tolist())
    return DescribedArm(joints, frozenset(links), tuple(massless), model.root, rows)


def _described(joint: JointFrame, pose: FloatArray, moves_tool: bool) -> DescribedJoint:
    """Return a joint as a screw; ``pose`` is its frame in the root's with all joints at 0."""
    if joint.limit is None:
        raise DescribedArmError(f"joint {joint.name} has no limit")
    direction = pose[:3, :3] @ np.array(joint.axis)
    direction /= np.linalg.norm(direction)
    # A turning screw's v is p x omega: where the axis stands.
    screw = [*direction, *np.cross(pose[:3, 3], direction)]
    if joint.kind == "prismatic":
        screw = [*np.zeros(3), *direction]
    values = tuple(float(value) for value in screw)
    return DescribedJoint(joint.kind, values, *joint.limit, moves_tool, joint.child)
