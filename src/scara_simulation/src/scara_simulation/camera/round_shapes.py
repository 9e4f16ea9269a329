"""Round cylinders for a renderer that draws them with few edges.

The description stays the same, with meshes in their place.
"""

from __future__ import annotations

import math
from xml.etree import ElementTree

NAME = "cylinder.obj"


def cylinder_mesh(edges: int) -> str:
    """Return a cylinder of radius 1 and length 1 around z as Wavefront OBJ.

    It is smooth around and flat at its ends.
    """
    lines: list[str] = []
    for z in (-0.5, 0.5):
        for k in range(edges):
            angle = 2.0 * math.pi * k / edges
            lines.append(f"v {math.cos(angle):.9f} {math.sin(angle):.9f} {z}")
    for k in range(edges):
        angle = 2.0 * math.pi * k / edges
        lines.append(f"vn {math.cos(angle):.9f} {math.sin(angle):.9f} 0")
    lines += ["vn 0 0 -1", "vn 0 0 1"]
    bottom, top = edges + 1, edges + 2
    for k in range(edges):
        a, b = k + 1, (k + 1) % edges + 1
        c, d = a + edges, b + edges
        lines += [f"f {a}//{a} {b}//{b} {d}//{b}", f"f {a}//{a} {d}//{b} {c}//{a}"]
        # Each end is a fan of triangles about its first corner.
        if 0 < k < edges - 1:
            lines += [f"f 1//{bottom} {b}//{bottom} {a}//{bottom}"]
            lines += [f"f {edges + 1}//{top} {c}//{top} {d}//{top}"]
    return "\n".join(lines) + "\n"


def with_round_shapes(description: str) -> str:
    """Return a robot description whose visible cylinders are the mesh ``NAME``.

    Collisions are left out.

    Args:
        description: URDF.

    Raises:
        xml.etree.ElementTree.ParseError: It is no XML.
    """
    robot = ElementTree.fromstring(description)
    for link in robot.iter("link"):
        # The camera's world only draws: nothing touches in it.
        for collision in link.findall("collision"):
            link.remove(collision)
        for geometry in link.iter("geometry"):
            cylinder = geometry.find("cylinder")
            if cylinder is None:
                continue
            radius, length = cylinder.get("radius", ""), cylinder.get("length", "")
            geometry.remove(cylinder)
            ElementTree.SubElement(
                geometry, "mesh", {"filename": NAME, "scale": f"{radius} {radius} {length}"}
            )
    return ElementTree.tostring(robot, encoding="unicode")
