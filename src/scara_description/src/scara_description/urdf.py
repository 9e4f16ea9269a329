"""Shapes and joints of a robot description, and where they are; no file is read here.

Boxes, cylinders and spheres with their colours, the tree of joints, forward kinematics.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree

import numpy as np

Vector = tuple[float, float, float]
GREY = "#b0b0b0"
KINDS = ("fixed", "revolute", "continuous", "prismatic")


WORLD = "world"
# The lines of in_world as they are: a world that somebody else wrote stays.
_IN_WORLD = re.compile(r'^ *<link name="world"/>\n *<joint name="fixed_to_world".*</joint>\n', re.M)


class UrdfError(ValueError):
    """The description cannot be shown; the text says what is wrong with it."""


@dataclass(frozen=True)
class Shape:
    """One visual shape in the frame of its link.

    Attributes:
        kind: box, cylinder (along z) or sphere.
        size: box: lengths in x, y, z; cylinder: radius, length; sphere: radius [m].
        xyz: Middle of the shape [m].
        rpy: Rotation about fixed x, y, z [rad].
        colour: ``#rrggbb``.
    """

    kind: str
    size: tuple[float, ...]
    xyz: Vector
    rpy: Vector
    colour: str


@dataclass(frozen=True)
class JointFrame:
    """How a child link hangs on its parent.

    Attributes:
        kind: fixed, revolute, continuous or prismatic.
        xyz: Origin of the joint's frame in the parent [m].
        rpy: Its rotation [rad].
        axis: Unit vector in the joint's frame.
        limit: Lower, upper [rad] or [m], largest velocity and effort; None without ``<limit>``.
    """

    name: str
    kind: str
    parent: str
    child: str
    xyz: Vector
    rpy: Vector
    axis: Vector
    limit: tuple[float, float, float, float] | None = None

    @property
    def moves(self) -> bool:
        """Whether it has a position at all."""
        return self.kind != "fixed"


@dataclass(frozen=True)
class Model:
    """Links with their shapes and the joints between them, parents first."""

    root: str
    shapes: Mapping[str, tuple[Shape, ...]]
    joints: tuple[JointFrame, ...]

    def chain(self, link: str) -> tuple[JointFrame, ...]:
        """Return the joints from the root to ``link``, in order.

        Raises:
            UrdfError: There is no such link.
        """
        if link not in self.shapes:
            raise UrdfError(f"no link {link!r}: there are {', '.join(self.shapes)}")
        by_child = {joint.child: joint for joint in self.joints}
        found: list[JointFrame] = []
        while link != self.root:
            found.append(by_child[link])
            link = found[-1].parent
        return tuple(reversed(found))


def in_world(root: str) -> list[str]:
    """Return the lines that fix a description's root to the world: else Gazebo lets it fall."""
    joint = f'<parent link="{WORLD}"/><child link="{root}"/>'
    return [
        f'  <link name="{WORLD}"/>',
        f'  <joint name="fixed_to_world" type="fixed">{joint}</joint>',
    ]


def without_world(text: str) -> str:
    """Return a description without the lines of :func:`in_world`.

    Who reads a robot reckons from its own root, and holds that fast by means of its own.
    """
    return _IN_WORLD.sub("", text)


def parse_urdf(text: str, seen: bool = True) -> Model:
    """Read a robot description with its shapes.

    Args:
        text: The URDF.
        seen: Take the shapes that are seen (``visual``); else those that collide.

    Raises:
        UrdfError: It is no XML, a shape is of another kind, or the joints are no tree.
    """
    robot = parse_robot(text)
    tag = "visual" if seen else "collision"
    colours = {m.get("name", ""): material_colour(m) for m in robot.findall("material")}
    shapes = {
        link.get("name", ""): tuple(shape_of(shape, colours) for shape in link.findall(tag))
        for link in robot.findall("link")
    }
    return tree_of(robot, shapes)


def parse_robot(text: str) -> ElementTree.Element:
    """Read a robot description as XML, without the world that it stands in.

    Raises:
        UrdfError: It is no XML.
    """
    try:
        return ElementTree.fromstring(without_world(text))
    except ElementTree.ParseError as error:
        raise UrdfError(f"the robot description is no XML: {error}") from error


def tree_of(robot: ElementTree.Element, shapes: Mapping[str, tuple[Shape, ...]]) -> Model:
    """Return the tree of a robot's joints; ``shapes`` names all its links.

    Raises:
        UrdfError: The joints are no tree, or one is of another kind or has no direction.
    """
    joints = [_joint(joint) for joint in robot.findall("joint") if joint.find("parent") is not None]
    return _ordered(shapes, joints)


def joint_transform(joint: JointFrame, q: float) -> np.ndarray:
    """Return the pose of the child in the parent, shape ``(4, 4)``.

    Args:
        joint: How the child hangs on the parent.
        q: Joint position [rad] or [m].
    """
    moved = np.eye(4)
    if joint.kind == "prismatic":
        moved[:3, 3] = q * np.array(joint.axis)
    elif joint.moves:
        moved[:3, :3] = _rotation_about(joint.axis, q)
    return origin_transform(joint.xyz, joint.rpy) @ moved


def origin_transform(xyz: Vector, rpy: Vector) -> np.ndarray:
    """Return the homogeneous transform of an origin: turned about fixed x, y, z, then moved."""
    roll, pitch, yaw = (_rotation_about(axis, angle) for axis, angle in zip(np.eye(3), rpy))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = yaw @ pitch @ roll, xyz
    return pose


def rpy_of(rotation: np.ndarray) -> Vector:
    """Return roll, pitch and yaw [rad] of a rotation, about the fixed x, then y, then z.

    Where pitch is straight up or down, roll is 0.
    """
    pitch = math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0]))
    if math.hypot(rotation[0, 0], rotation[1, 0]) < 1e-9:
        return 0.0, pitch, math.atan2(-rotation[0, 1], rotation[1, 1])
    return (
        math.atan2(rotation[2, 1], rotation[2, 2]),
        pitch,
        math.atan2(rotation[1, 0], rotation[0, 0]),
    )


def link_pose(model: Model, link: str, positions: Mapping[str, float]) -> np.ndarray:
    """Return the pose of ``link`` in the root, shape ``(4, 4)``.

    Joints without a position count as 0.
    """
    pose = np.eye(4)
    for joint in model.chain(link):
        pose = pose @ joint_transform(joint, positions.get(joint.name, 0.0))
    return pose


def _rotation_about(axis: np.ndarray | Vector, angle: float) -> np.ndarray:
    """Return the rotation matrix of a turn about a unit vector (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: np.ndarray = (
        np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    )
    return turned


def _ordered(shapes: Mapping[str, tuple[Shape, ...]], joints: list[JointFrame]) -> Model:
    children = {joint.child for joint in joints}
    roots = [link for link in shapes if link not in children]
    unknown = {link for joint in joints for link in (joint.parent, joint.child)} - set(shapes)
    if len(roots) != 1 or unknown or len(children) != len(joints):
        raise UrdfError(f"the joints are no tree: roots {roots}, unknown links {sorted(unknown)}")
    placed, ordered, rest = {roots[0]}, [], list(joints)
    while rest:
        ready = [joint for joint in rest if joint.parent in placed]
        if not ready:
            raise UrdfError(
                f"the joints are no tree: {', '.join(joint.name for joint in rest)} form a ring"
            )
        ordered += ready
        placed |= {joint.child for joint in ready}
        rest = [joint for joint in rest if joint.child not in placed]
    return Model(roots[0], shapes, tuple(ordered))


def _joint(element: ElementTree.Element) -> JointFrame:
    parent, child = element.find("parent"), element.find("child")
    name, kind = element.get("name", ""), element.get("type", "fixed")
    if kind not in KINDS:
        raise UrdfError(f"joint {name} is {kind}: it must be one of {', '.join(KINDS)}")
    xyz, rpy = origin_of(element)
    return JointFrame(
        name=name,
        kind=kind,
        parent="" if parent is None else parent.get("link", ""),
        child="" if child is None else child.get("link", ""),
        xyz=xyz,
        rpy=rpy,
        axis=_axis(name, element.find("axis")),
        limit=_limit(element.find("limit")),
    )


def _axis(name: str, element: ElementTree.Element | None) -> Vector:
    """Return a joint's direction with length 1."""
    # URDF's default is x.
    x, y, z = (1.0, 0.0, 0.0) if element is None else _vector(element.get("xyz", "1 0 0"))
    length = math.hypot(x, y, z)
    if not 0.0 < length < math.inf:
        raise UrdfError(f"the axis of joint {name} has no direction: {x:g} {y:g} {z:g}")
    return x / length, y / length, z / length


def _limit(element: ElementTree.Element | None) -> tuple[float, float, float, float] | None:
    if element is None:
        return None
    try:
        lower, upper, velocity, effort = (
            float(element.get(key, "0")) for key in ("lower", "upper", "velocity", "effort")
        )
    except ValueError as error:
        raise UrdfError(f"a limit cannot be read: {error}") from error
    return lower, upper, velocity, effort


def shape_of(visual: ElementTree.Element, colours: Mapping[str, str]) -> Shape:
    """Return a ``<visual>`` or ``<collision>`` as a shape.

    Args:
        visual: The element.
        colours: ``#rrggbb`` of the materials that have a name.

    Raises:
        UrdfError: Its geometry is missing, of another kind, or without its lengths.
    """
    geometry, colour = visual.find("geometry"), colour_of(visual, colours)
    xyz, rpy = origin_of(visual)
    for element in geometry if geometry is not None else ():
        if element.tag == "box":
            return Shape("box", _finite(element.get("size", "")), xyz, rpy, colour)
        if element.tag == "cylinder":
            size = (_length(element, "radius"), _length(element, "length"))
            return Shape("cylinder", size, xyz, rpy, colour)
        if element.tag == "sphere":
            return Shape("sphere", (_length(element, "radius"),), xyz, rpy, colour)
        raise UrdfError(f"a shape of kind {element.tag} cannot be shown: box, cylinder, sphere can")
    raise UrdfError("a shape has no geometry")


def _length(element: ElementTree.Element, key: str) -> float:
    text = element.get(key, "")
    try:
        length = float(text)
    except ValueError:
        length = math.nan
    if not math.isfinite(length):
        raise UrdfError(f"{element.tag} {key} = {text!r}: Expected a finite number")
    return length


def colour_of(visual: ElementTree.Element, colours: Mapping[str, str]) -> str:
    """Return ``#rrggbb`` of what is seen; ``colours`` has those of the named materials."""
    material = visual.find("material")
    if material is None:
        return GREY
    own = material.find("color") is not None
    return material_colour(material) if own else colours.get(material.get("name", ""), GREY)


def origin_of(element: ElementTree.Element) -> tuple[Vector, Vector]:
    """Return where an element stands: xyz [m], rpy [rad]; 0 without an ``<origin>``."""
    origin = element.find("origin")
    if origin is None:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return _finite(origin.get("xyz", "0 0 0")), _finite(origin.get("rpy", "0 0 0"))


def _vector(text: str) -> Vector:
    try:
        x, y, z = (float(word) for word in text.split())
    except ValueError as error:
        raise UrdfError(f"{text!r} is no vector of three numbers") from error
    return x, y, z


def _finite(text: str) -> Vector:
    """Return a vector of finite numbers; an axis says of itself that it has no direction."""
    x, y, z = _vector(text)
    if not all(map(math.isfinite, (x, y, z))):
        raise UrdfError(f"{text!r} is no vector of three finite numbers")
    return x, y, z


def material_colour(material: ElementTree.Element) -> str:
    """Return ``#rrggbb`` of a material; grey if it has no colour of its own."""
    colour = material.find("color")
    if colour is None:
        return GREY
    rgba = colour.get("rgba", "")
    parts = _finite(" ".join(rgba.split()[:3]))
    red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in parts)
    return f"#{red:02x}{green:02x}{blue:02x}"
