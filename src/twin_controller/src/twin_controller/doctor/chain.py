"""The screws that a URDF has, to be held against those of robot.yaml: read from the text, without a physics engine."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import msgspec
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class DescriptionError(ValueError):
    """The text is no URDF of a robot with that tool frame."""


class DescribedJoint(msgspec.Struct, frozen=True):
    """A movable joint of a URDF.

    Attributes:
        kind: ``revolute``, ``prismatic`` or another URDF type.
        screw: Unit screw (omega, v) in the root's frame with all joints at 0.
        lower, upper: Limits [rad] or [m].
        velocity, effort: Largest ones.
        moves_tool: It is on the way from the root to the tool frame.
    """

    kind: str
    screw: tuple[float, ...]
    lower: float
    upper: float
    velocity: float
    effort: float
    moves_tool: bool


class Description(msgspec.Struct, frozen=True):
    """What of a URDF can be held against a profile.

    Attributes:
        joints: Movable joints by name.
        links: Names of all links.
        massless: Links without mass.
        tool_pose: Pose of the tool frame in the root's with all joints at 0, row by row.
    """

    joints: dict[str, DescribedJoint]
    links: frozenset[str]
    massless: tuple[str, ...]
    tool_pose: tuple[tuple[float, ...], ...]


def read_description(text: str, tool_frame: str) -> Description:
    """Read a URDF.

    Raises:
        DescriptionError: No XML, no link of the name ``tool_frame``, a joint without parent, child or limit.
    """
    try:
        root = ElementTree.fromstring(text)
        links = frozenset(link.attrib["name"] for link in root.findall("link"))
        holding = {_of(joint, "child", "link"): joint for joint in root.findall("joint")}
        if tool_frame not in links:
            raise DescriptionError(f"it has no link {tool_frame}")
        poses: dict[str, FloatArray] = {}
        chain = _chain(tool_frame, holding)
        joints = {
            joint.attrib["name"]: _joint(joint, _pose(child, holding, poses), joint in chain)
            for child, joint in holding.items()
            if joint.attrib["type"] != "fixed"
        }
        tool = _pose(tool_frame, holding, poses)
    except (ElementTree.ParseError, KeyError, ValueError) as error:
        raise error if isinstance(error, DescriptionError) else DescriptionError(f"it cannot be read: {error!r}") from error
    massless = [link.attrib["name"] for link in root.findall("link") if link.find("inertial/mass") is None]
    return Description(joints, links, tuple(massless), tuple(tuple(row) for row in tool.tolist()))


def _chain(link: str, holding: dict[str, ElementTree.Element]) -> list[ElementTree.Element]:
    """Return the joints from ``link`` to the root."""
    found: list[ElementTree.Element] = []
    while link in holding and len(found) <= len(holding):
        found.append(holding[link])
        link = _of(holding[link], "parent", "link")
    return found


def _pose(link: str, holding: dict[str, ElementTree.Element], poses: dict[str, FloatArray]) -> FloatArray:
    """Return where a link's frame is in the root's."""
    if link not in holding:
        return np.eye(4)
    if link not in poses:
        joint = holding[link]
        poses[link] = _pose(_of(joint, "parent", "link"), holding, poses) @ _origin(joint.find("origin"))
    return poses[link]


def _origin(element: ElementTree.Element | None) -> FloatArray:
    """Return the transform of an ``<origin>``: rpy about the fixed x, then y, then z."""
    pose = np.eye(4)
    if element is None:
        return pose
    roll, pitch, yaw = (float(word) for word in element.get("rpy", "0 0 0").split())
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, 3] = [float(word) for word in element.get("xyz", "0 0 0").split()]
    return pose


def _joint(joint: ElementTree.Element, pose: FloatArray, moves_tool: bool) -> DescribedJoint:
    axis = joint.find("axis")
    words = (axis.get("xyz", "1 0 0") if axis is not None else "1 0 0").split()
    direction = pose[:3, :3] @ np.array([float(word) for word in words])
    direction /= np.linalg.norm(direction)
    sliding = joint.attrib["type"] == "prismatic"
    screw = [*np.zeros(3), *direction] if sliding else [*direction, *np.cross(pose[:3, 3], direction)]
    limit = joint.find("limit")
    if limit is None:
        raise DescriptionError(f"joint {joint.attrib['name']} has no limit")
    lower, upper, velocity, effort = (float(limit.get(key, "0")) for key in ("lower", "upper", "velocity", "effort"))
    values = tuple(float(value) for value in screw)
    return DescribedJoint(joint.attrib["type"], values, lower, upper, velocity, effort, moves_tool)


def _of(joint: ElementTree.Element, tag: str, key: str) -> str:
    element = joint.find(tag)
    if element is None:
        raise DescriptionError(f"joint {joint.get('name')} has no {tag}")
    return element.attrib[key]
