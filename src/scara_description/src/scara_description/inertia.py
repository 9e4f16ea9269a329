"""Inertia of a URDF link from its mass and its collision shapes.

Each shape has the share of the link's mass that it has of the sum of the volumes: one density per
link, and where shapes overlap, as at the joints with their motors and gears, twice of it.

Source: solid box and solid cylinder, any table of moments of inertia; parallel axes by Steiner.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scara_description.urdf import JointFrame, joint_transform, origin_of, parse_robot, tree_of

FloatArray = NDArray[np.float64]
Body = tuple[str, float, FloatArray, FloatArray]
"""Name, mass [kg], centre [m] and inertia about it [kg m^2], in the link's frame."""

LEVELS = 25
"""Positions of each joint from end to end at which the inertia is looked at, beside its 0."""
TERMS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
"""URDF's names of an inertia's terms, in its order, and where they stand in the matrix."""
# Comments are matched too, so that what stands in one is not taken for an element.
_INERTIAL = re.compile(
    r"<!--.*?-->|(?P<element>(?:^(?P<indent>[ \t]*))?<inertial\b.*?</inertial>)",
    re.DOTALL | re.MULTILINE,
)


class ShapeError(ValueError):
    """A link has no mass, no collision shape, or one whose inertia cannot be computed here."""


class ShapeNumberError(ShapeError):
    """A number of a link's inertial or shape is none."""


@dataclass(frozen=True, eq=False)
class Inertial:
    """Mass [kg], centre of mass in the link's frame (3,) [m], inertia about it.

    The inertia is (3, 3), along the link's axes [kg m^2].
    """

    mass: float
    centre: FloatArray
    inertia: FloatArray


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return URDF's rotation: about the fixed x, then y, then z, shape ``(3, 3)``."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    rotation: FloatArray = about_z @ about_y @ about_x
    return rotation


def inertial_of(link: ET.Element) -> Inertial:
    """Compute what the ``<inertial>`` of a URDF link should say.

    Args:
        link: A ``<link>`` with a mass and collision shapes (boxes, cylinders).

    Raises:
        ShapeError: No mass, no collision shape, one that is neither box nor cylinder, or a number
            that is none; the text names the link.
    """
    name = link.get("name")
    mass = link.find("inertial/mass")
    solids = [_solid(name, collision) for collision in link.iter("collision")]
    if mass is None or not solids:
        raise ShapeError(f"link {name} has no {'mass' if mass is None else 'collision shape'}")
    (kilograms,) = _numbers(name, mass, "value", 1)
    volume = sum(solid.mass for solid in solids)
    centre = sum((solid.mass * solid.centre for solid in solids), np.zeros(3)) / volume
    inertia = np.zeros((3, 3))
    for solid in solids:
        arm = solid.centre - centre
        inertia += solid.inertia + solid.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return Inertial(kilograms, centre, inertia * (kilograms / volume))


def with_inertia(urdf: str) -> str:
    """Return the URDF text with every link's inertial computed anew; all else stays as it is.

    Raises:
        ShapeError: See :func:`inertial_of`; or there is an inertial that is no link's only one.
    """
    links = [link for link in ET.fromstring(urdf).iter("link") if link.find("inertial") is not None]
    count = sum(match["element"] is not None for match in _INERTIAL.finditer(urdf))
    if count != len(links):
        raise ShapeError(
            f"{count} <inertial> in {len(links)} links: a <link> has to have one or none, "
            "and there may be none outside of links"
        )
    # Both are in the order of the text.
    blocks = map(inertial_of, links)
    return _INERTIAL.sub(
        lambda match: _block(next(blocks), match["indent"] or "") if match["element"] else match[0],
        urdf,
    )


def _solid(name: str | None, collision: ET.Element) -> Inertial:
    """Return a collision shape as a solid of density 1, in the link's frame."""
    box, cylinder = collision.find("geometry/box"), collision.find("geometry/cylinder")
    if box is not None:
        x, y, z = _numbers(name, box, "size", 3, above=0.0)
        volume = x * y * z
        moments = [(y * y + z * z) / 12.0, (x * x + z * z) / 12.0, (x * x + y * y) / 12.0]
    elif cylinder is not None:
        (radius,) = _numbers(name, cylinder, "radius", 1, above=0.0)
        (length,) = _numbers(name, cylinder, "length", 1, above=0.0)
        volume = np.pi * radius**2 * length
        across = radius**2 / 4.0 + length**2 / 12.0
        moments = [across, across, radius**2 / 2.0]
    else:
        raise ShapeError(f"link {name} has a collision shape that is neither box nor cylinder")
    origin = collision.find("origin")
    centre, rpy = (
        [0.0] * 3 if origin is None else _numbers(name, origin, key, 3, "0 0 0")
        for key in ("xyz", "rpy")
    )
    rotation = rotation_from_rpy(*rpy)
    inertia = rotation @ np.diag(moments) @ rotation.T * volume
    return Inertial(volume, np.array(centre), inertia)


def _numbers(
    name: str | None,
    element: ET.Element,
    key: str,
    count: int,
    usual: str = "",
    above: float = -np.inf,
) -> list[float]:
    """Return the numbers in an attribute of an element, ``usual`` where it has none."""
    text = element.get(key, usual)
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    # NaN is above nothing.
    if len(numbers) != count or not all(above < number < np.inf for number in numbers):
        wanted = f"{count} finite number{'s' if count > 1 else ''}"
        wanted += " above 0" if above == 0.0 else ""
        raise ShapeNumberError(
            f"link {name}: <{element.tag}> has {key} = {text!r}: expected {wanted}"
        )
    return numbers


def _block(inertial: Inertial, indent: str) -> str:
    """Return the ``<inertial>`` element as text, six significant digits, rounding dust as 0."""
    largest = float(np.abs(inertial.inertia).max())

    def number(value: float, scale: float) -> str:
        return "0" if abs(value) < 1e-9 * scale else f"{value:.6g}"

    centre = " ".join(number(value, 1.0) for value in inertial.centre)
    inertia = " ".join(
        f'{key}="{number(inertial.inertia[at], largest)}"' for key, at in TERMS.items()
    )
    lines = (
        "<inertial>",
        f'  <origin xyz="{centre}" rpy="0 0 0"/>',
        f'  <mass value="{inertial.mass:g}"/>',
        f"  <inertia {inertia}/>",
        "</inertial>",
    )
    return "\n".join(f"{indent}{line}" for line in lines)


def largest_inertia(urdf: str, ranges: Mapping[str, tuple[float, float]], name: str) -> float:
    r"""Return the largest inertia that a joint sees with the others held [kg m^2], sliding [kg].

    .. math:: J_k = \max_q \sum_i a_k^T I_i(q) a_k + m_i |a_k \times (c_i(q) - p_k)|^2

    over the bodies :math:`i` that joint k moves; sliding: their mass. Only joints further out
    matter.

    Args:
        urdf: The description as text.
        ranges: Lower and upper limit of each joint that moves, SI.
        name: Of the joint.

    Raises:
        UrdfError: It cannot be read.
    """
    root = parse_robot(urdf)
    model = tree_of(root, {link.get("name", ""): () for link in root.findall("link")})
    joint = next(each for each in model.joints if each.name == name)
    parts = []
    for link in root.findall("link"):
        chain = model.chain(link.get("name", ""))
        if joint in chain and link.find("inertial/mass") is not None:
            parts.append((body_of(link), chain[chain.index(joint) + 1 :]))
    if joint.kind == "prismatic":
        return sum(body[1] for body, _ in parts)
    beyond = sorted({each.name for _, chain in parts for each in chain} & set(ranges))
    q = {each: min(max(0.0, ranges[each][0]), ranges[each][1]) for each in beyond}
    largest, before = _seen(joint, parts, q), -1.0
    # One joint after the other goes where most is seen, until none sees more.
    while largest > before:
        before = largest
        for each in beyond:
            # Where it is now is among them, so that no step makes it less.
            levels = [q[each], *np.linspace(*ranges[each], LEVELS).tolist()]
            seen = [_seen(joint, parts, q | {each: level}) for level in levels]
            largest = max(seen)
            q[each] = levels[seen.index(largest)]
    return largest


def _seen(
    joint: JointFrame, parts: Sequence[tuple[Body, Sequence[JointFrame]]], q: Mapping[str, float]
) -> float:
    """Return the inertia about a joint's axis of what it moves, in one pose."""
    seen = 0.0
    for (_, mass, centre, inertia), chain in parts:
        pose = np.eye(4)
        for each in chain:
            pose = pose @ joint_transform(each, q.get(each.name, 0.0))
        axis = pose[:3, :3].T @ np.array(joint.axis)
        arm = np.cross(joint.axis, pose[:3, :3] @ centre + pose[:3, 3])
        seen += float(axis @ inertia @ axis + mass * (arm @ arm))
    return seen


def body_of(link: ET.Element) -> Body:
    """Return a link's name, mass, centre and inertia about it, along the link's frame.

    Args:
        link: A ``<link>`` with an ``<inertial>``.

    Raises:
        UrdfError: A place is no vector.
        KeyError, ValueError: A number is missing, or is none.
    """
    inertial = link.find("inertial")
    assert inertial is not None
    terms, (place, rpy) = inertial.find("inertia"), origin_of(inertial)
    turn = rotation_from_rpy(*rpy)
    t = {} if terms is None else {key: float(value) for key, value in terms.attrib.items()}
    mass = float(inertial.find("mass").attrib["value"])  # type: ignore[union-attr]
    if not np.isfinite([mass, *t.values()]).all():
        raise ValueError("mass and moments have to be finite")
    xx, xy, xz, yy, yz, zz = (t.get(k, 0.0) for k in TERMS)
    inertia = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    return link.get("name", ""), mass, np.array(place), inertia
