"""Make of somebody's URDF one that the twin can use.

Kept are the root, the links of the arm, what else a joint moves, and what stands around. All other
links hang still on one of these: their shapes and masses become its own. Meshes become boxes and
cylinders that hold them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from xml.etree import ElementTree

import numpy as np
from scara_description.body import transmission
from scara_description.cover import COVER, cover
from scara_description.inertia import TERMS, Body, FloatArray, body_of

from robot_doctor.foreign_urdf import Foreign
from scara_description.urdf import (
    GREY,
    JointFrame,
    Shape,
    UrdfError,
    colour_of,
    link_pose,
    material_colour,
    origin_of,
    origin_transform,
    rpy_of,
    shape_of,
)

NO_MOMENT = 1.02
"""By so much rounding may put one moment of inertia above the sum of the others."""
Meshes = Callable[[str], FloatArray]
"""The triangles of a mesh by its name in a URDF, shape (n, 3, 3)."""


def tidied(foreign: Foreign, name: str, meshes: Meshes) -> str:
    """Return the URDF as the twin needs it: one body for each link, without meshes.

    Args:
        foreign: What was read.
        name: Of the robot.
        meshes: Reads a mesh.

    Raises:
        ConfigError: A link that moves has no mass, inertia or shape, or a mesh cannot be used.
    """
    shapes = {link.get("name", ""): _shapes(foreign, link, meshes) for link in _links(foreign)}
    carriers = _carriers(foreign, shapes)
    robot = ElementTree.Element("robot", name=name)
    file = foreign.file.replace("--", "- -")  # which ends a comment
    robot.append(ElementTree.Comment(f" Made from {file} by robot_doctor: doctor new. "))
    for link in _links(foreign):
        own = link.get("name", "")
        if carriers[own] == own:
            hung = [each for each in shapes if carriers[each] == own]
            robot.append(_link(foreign, own, hung, shapes))
    for joint in foreign.model.joints:
        if carriers[joint.child] == joint.child:
            robot.append(_joint(foreign, joint, carriers))
    ElementTree.indent(robot)
    text = ElementTree.tostring(robot, encoding="unicode")
    motors = "\n".join(line for joint in foreign.moving for line in transmission(joint.name))
    return f'<?xml version="1.0"?>\n{text.replace("</robot>", "")}{motors}\n</robot>\n'


def _links(foreign: Foreign) -> list[ElementTree.Element]:
    return foreign.root.findall("link")


def _movers(foreign: Foreign, link: str) -> list[str]:
    return [joint.name for joint in foreign.model.chain(link) if joint.moves]


def _carriers(foreign: Foreign, shapes: Mapping[str, list[Shape]]) -> dict[str, str]:
    """Return of each link the one whose body it is part of: itself, or one that it hangs on."""
    chain = {foreign.model.root} | {joint.child for joint in foreign.model.chain(foreign.tool)}
    found = {foreign.model.root: foreign.model.root}
    for joint in foreign.model.joints:
        link = joint.child
        stands = shapes[link] and not _movers(foreign, link)
        keeps = link in chain or joint.moves or stands
        found[link] = link if keeps else found[joint.parent]
    return found


def _seen(link: ElementTree.Element) -> list[ElementTree.Element]:
    """Return what of a link collides; without such what is seen of it."""
    return link.findall("collision") or link.findall("visual")


def _shapes(foreign: Foreign, link: ElementTree.Element, meshes: Meshes) -> list[Shape]:
    """Return the shapes of a link, in its frame."""
    name = link.get("name", "")
    try:
        named = {m.get("name", ""): material_colour(m) for m in foreign.root.findall("material")}
        colour = next((colour_of(visual, named) for visual in link.findall("visual")), GREY)
    except UrdfError as error:
        raise foreign.fault("link", name, f"material color: {error}") from error
    found: list[Shape] = []
    for element in _seen(link):
        mesh = element.find("geometry/mesh")
        try:
            if mesh is None:
                shapes = [shape_of(element, {})]
            else:
                scale = np.array([float(x) for x in mesh.get("scale", "1 1 1").split()])
                pose = origin_transform(*origin_of(element))
                corners = meshes(mesh.get("filename", "")) * scale
                shapes = cover(corners @ pose[:3, :3].T + pose[:3, 3])
        except (UrdfError, ValueError) as error:
            raise foreign.fault("link", name, f"{element.tag}: {error}") from error
        found += [Shape(s.kind, s.size, s.xyz, s.rpy, colour) for s in shapes]
    return found


def _link(
    foreign: Foreign, name: str, hung: list[str], shapes: Mapping[str, list[Shape]]
) -> ElementTree.Element:
    """Return a link with its own shapes and mass and those of what hangs still on it."""
    link = ElementTree.Element("link", name=name)
    own = link_pose(foreign.model, name, {})
    bodies = [(np.linalg.solve(own, link_pose(foreign.model, each, {})), each) for each in hung]
    held = list(_inertials(foreign, bodies, shapes))
    elements = {element.get("name", ""): element for element in _links(foreign)}
    for pose, each in bodies:
        meshed = any(e.find("geometry/mesh") is not None for e in _seen(elements[each]))
        for shape in shapes[each]:
            link.append(_shape(ElementTree.Element("visual"), shape, pose))
            # By this name the doctor lets the link's inertia be far from that of its shapes.
            named = {"name": COVER} if meshed else {}
            link.append(_shape(ElementTree.Element("collision", named), shape, pose))
    if held:
        link.append(_inertial(held))
    return link


def _inertials(
    foreign: Foreign, bodies: list[tuple[FloatArray, str]], shapes: Mapping[str, list[Shape]]
) -> Iterator[Body]:
    """Yield mass, centre and inertia of links, in the frame that their poses are in."""
    elements = {link.get("name", ""): link for link in _links(foreign)}
    for pose, name in bodies:
        inertial = elements[name].find("inertial")
        if inertial is None:
            if shapes[name] and _movers(foreign, name):
                what = "inertial: is missing: Expected origin, mass and inertia"
                raise foreign.fault("link", name, what)
            continue
        for key in ("mass", "inertia"):
            if inertial.find(key) is None:
                raise foreign.fault("link", name, f"inertial {key}: is missing")
        try:
            _, mass, centre, inertia = body_of(elements[name])
        except (KeyError, ValueError) as error:
            raise foreign.fault("link", name, f"inertial: cannot be read: {error}") from error
        low, middle, high = np.linalg.eigvalsh(inertia).tolist()
        impossible = low <= 0.0 or high > NO_MOMENT * (low + middle)
        if _movers(foreign, name) and (mass < 0.0 or (mass > 0.0 and impossible)):
            raise foreign.fault(
                "link",
                name,
                f"mass = {mass:g} kg, moments of inertia {low:.4g}, {middle:.4g}, {high:.4g} "
                "kg m^2: Expected all above 0, and none above the sum of the other two",
            )
        yield (
            name,
            mass,
            pose[:3, :3] @ centre + pose[:3, 3],
            pose[:3, :3] @ inertia @ pose[:3, :3].T,
        )


def _inertial(bodies: list[Body]) -> ElementTree.Element:
    """Return one ``<inertial>`` of several bodies."""
    mass = sum(body[1] for body in bodies)
    # Without any mass each place is as good as another.
    share = [body[1] / mass if mass else 1.0 / len(bodies) for body in bodies]
    centre = sum((part * body[2] for part, body in zip(share, bodies)), np.zeros(3))
    inertia = np.zeros((3, 3))
    for _, kilograms, place, own in bodies:
        arm = place - centre
        # Moved to the common centre by Steiner's theorem.
        inertia += own + kilograms * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    element = ElementTree.Element("inertial")
    ElementTree.SubElement(element, "origin", xyz=_numbers(centre), rpy="0 0 0")
    ElementTree.SubElement(element, "mass", value=repr(float(mass)))
    terms = {key: repr(float(inertia[at])) for key, at in TERMS.items()}
    ElementTree.SubElement(element, "inertia", terms)
    return element


def _shape(element: ElementTree.Element, shape: Shape, pose: FloatArray) -> ElementTree.Element:
    """Return ``element`` with a shape of a link, moved by ``pose``."""
    _origin(element, pose @ origin_transform(shape.xyz, shape.rpy))
    geometry = ElementTree.SubElement(element, "geometry")
    size = [repr(float(value)) for value in shape.size]
    if shape.kind == "box":
        ElementTree.SubElement(geometry, "box", size=" ".join(size))
    elif shape.kind == "cylinder":
        ElementTree.SubElement(geometry, "cylinder", radius=size[0], length=size[1])
    else:
        ElementTree.SubElement(geometry, "sphere", radius=size[0])
    if element.tag == "visual":
        material = ElementTree.SubElement(element, "material", name=shape.colour)
        rgb = [int(shape.colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
        rgba = " ".join(f"{part:.4g}" for part in (*rgb, 1.0))
        ElementTree.SubElement(material, "color", rgba=rgba)
    return element


def _joint(foreign: Foreign, joint: JointFrame, carriers: Mapping[str, str]) -> ElementTree.Element:
    """Return a joint as it was; on another parent if its own is part of that one's body."""
    element = next(e for e in foreign.root.findall("joint") if e.get("name") == joint.name)
    made = ElementTree.Element("joint", name=joint.name, type=joint.kind)
    parent = carriers[joint.parent]
    origin = element.find("origin")
    if parent != joint.parent:
        own, its = (link_pose(foreign.model, each, {}) for each in (parent, joint.parent))
        _origin(made, np.linalg.solve(own, its) @ origin_transform(joint.xyz, joint.rpy))
    elif origin is not None:
        made.append(origin)
    ElementTree.SubElement(made, "parent", link=parent)
    ElementTree.SubElement(made, "child", link=joint.child)
    for tag in ("axis", "limit", "dynamics"):
        found = element.find(tag)
        if found is not None and joint.moves:
            made.append(found)
    return made


def _origin(element: ElementTree.Element, pose: FloatArray) -> None:
    rpy = _numbers(np.array(rpy_of(pose[:3, :3])))
    ElementTree.SubElement(element, "origin", xyz=_numbers(pose[:3, 3]), rpy=rpy)


def _numbers(values: FloatArray) -> str:
    return " ".join(repr(float(value) + 0.0) for value in values)
