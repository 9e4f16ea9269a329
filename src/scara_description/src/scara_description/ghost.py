"""The real robot's description for one picture with the twin.

It has the moving parts once more, as a ghost with frames of its own.

RViz shows two robots by two descriptions. Both hang on the same root frame, so that no frame has
two parents. Joints keep their names: each robot follows joint states of its own.
"""

from __future__ import annotations

from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from scara_description.urdf import without_world

PREFIX = "real/"
COLOUR = "0.18 0.50 0.88 1"
# Where both agree the ghost is inside the twin, and only the twin is seen.
SHRINK = 0.001  # our choice [m]


class DescriptionError(ValueError):
    """The description is no tree of links; the text says why."""


def ghost_of(description: str) -> str:
    """Return the description of the moving parts of ``description``, with prefixed links.

    They have one colour and are a hair smaller.

    Args:
        description: URDF. What hangs on its root by fixed joints only is left out of the ghost's
            shapes.

    Raises:
        DescriptionError: It is no XML, or has not exactly one root.
    """
    try:
        robot = ElementTree.fromstring(without_world(description))
    except ElementTree.ParseError as error:
        raise DescriptionError(f"the robot description is no XML: {error}") from error
    joints = [joint for joint in robot.findall("joint") if joint.find("parent") is not None]
    children = {_link(joint, "child"): joint for joint in joints}
    roots = [
        name for link in robot.findall("link") if (name := link.get("name", "")) not in children
    ]
    if len(roots) != 1:
        raise DescriptionError(
            f"the robot description must have one root, it has {', '.join(roots) or 'none'}"
        )
    # A copy: elements that are removed under way would let others be skipped.
    for element in list(robot):
        if element.tag not in ("link", "joint"):
            robot.remove(element)
    for link in robot.findall("link"):
        _dress(link, _moves(link.get("name", ""), children))
        link.set("name", _own(link.get("name", ""), roots[0]))
    for joint in joints:
        for end in (joint.find("parent"), joint.find("child")):
            if end is not None:
                end.set("link", _own(end.get("link", ""), roots[0]))
    return ElementTree.tostring(robot, encoding="unicode")


def _link(joint: Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _own(link: str, root: str) -> str:
    return link if link == root else PREFIX + link


def _moves(link: str, children: dict[str, Element]) -> bool:
    """Return whether a joint that is not fixed lies between the root and ``link``."""
    while link in children:
        joint = children[link]
        if joint.get("type") != "fixed":
            return True
        link = _link(joint, "parent")
    return False


def _dress(link: Element, moves: bool) -> None:
    """Keep the shapes of a moving link only, in the ghost's colour."""
    for part in list(link):
        if part.tag != "visual" or not moves:
            link.remove(part)
    for visual in link.findall("visual"):
        for old in visual.findall("material"):
            visual.remove(old)
        ElementTree.SubElement(
            ElementTree.SubElement(visual, "material", {"name": "ghost"}), "color", {"rgba": COLOUR}
        )
        for geometry in visual.findall("geometry"):
            for shape in geometry:
                _shrink(shape)


def _shrink(shape: Element) -> None:
    for key, by in (("size", SHRINK), ("radius", SHRINK / 2.0), ("length", SHRINK)):
        if key in shape.attrib:
            # A shape that is hardly larger than that must not vanish or turn over.
            lengths = (
                max(float(word) - by, float(word) / 2.0) for word in shape.get(key, "").split()
            )
            shape.set(key, " ".join(f"{length:g}" for length in lengths))
