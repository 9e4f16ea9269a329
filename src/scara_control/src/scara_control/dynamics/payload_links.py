"""Payloads as links of a URDF, and a URDF for dynamics alone."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

from scara_config.payload import Payload


def with_payloads(urdf: str, frame: str, payloads: Sequence[Payload]) -> str:
    """Return a URDF's text with payloads fixed to one of its links.

    A payload without mass is left out, so an empty tool leaves the text as it is.

    Args:
        urdf: The text.
        frame: The link; centres and moments of the payloads are given in its frame.
        payloads: What hangs there, all at once.
    """
    added = "".join(
        _link(number, frame, payload) for number, payload in enumerate(payloads) if payload.mass_kg
    )
    return urdf.replace("</robot>", f"{added}</robot>") if added else urdf


def without_shapes(urdf: str) -> str:
    """Return a URDF's text without what is seen and touched: all that dynamics need."""
    root = ElementTree.fromstring(urdf)
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    return ElementTree.tostring(root, encoding="unicode")


def _link(number: int, frame: str, payload: Payload) -> str:
    name = f"payload_{number}"
    # repr keeps all digits, so the engine has the very numbers that the message had.
    centre = " ".join(map(repr, payload.centre_m))
    xx, yy, zz = payload.inertia_kg_m2
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}" rpy="0 0 0"/>'
        f'<mass value="{payload.mass_kg!r}"/><inertia ixx="{xx!r}" ixy="0" ixz="0" '
        f'iyy="{yy!r}" iyz="0" izz="{zz!r}"/></inertial></link>\n'
        f'<joint name="{name}_joint" type="fixed"><parent link={quoteattr(frame)}/>'
        f'<child link="{name}"/></joint>\n'
    )
