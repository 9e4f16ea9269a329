"""The vehicle of palletise.yaml as a link of a robot description, where its frame says it stands.

It carries a pallet of the cell's kind; its frame is the middle of that pallet's top.
"""

from __future__ import annotations

import math

from scara_config.frames import FrameTable
from scara_config.palletise import MM, Palletise

from scara_description.taught_frames import frame_of, pose_of
from scara_description.urdf import parse_urdf

VEHICLE = "vehicle"
DECK_M = 0.02
"""Thickness of what parts lie on (our choice)."""
BODY_M = 0.8
"""Length and width of what carries it, as a share of the pallet's (our choice)."""


def with_vehicle(text: str, work: Palletise, frames: FrameTable) -> str:
    """Return a description with the vehicle; as it was if the cell has none, or no frame of it.

    Args:
        text: The URDF.
        work: palletise.yaml.
        frames: frames.yaml.
    """
    vehicle = work.vehicle
    frame = frames.numbered("user").get(vehicle.frame) if vehicle else None
    if vehicle is None or frame is None:
        return text
    pose = pose_of(frame)
    # The frame begins at the first mark, and that lies so far from the middle.
    x, y = vehicle.marks_mm[0]
    pose[:3, 3] -= pose[:3, 0] * x * MM + pose[:3, 1] * y * MM
    stands = frame_of(VEHICLE, pose)
    width, depth = (size * MM for size in work.pallet.size_mm)
    high = (work.pallet.top_mm - work.floor_mm) * MM - DECK_M
    boxes = (
        ((width, depth, DECK_M), -0.5 * DECK_M, "wood"),
        ((BODY_M * width, BODY_M * depth, high), -DECK_M - 0.5 * high, "dark"),
    )
    lines = [f'  <link name="{VEHICLE}">']
    for size, middle, colour in boxes:
        told = " ".join(f"{length:.6g}" for length in size)
        shape = f'<origin xyz="0 0 {middle:.6g}"/><geometry><box size="{told}"/></geometry>'
        lines.append(f'    <visual>{shape}<material name="{colour}"/></visual>')
        lines.append(f"    <collision>{shape}</collision>")
    xyz = " ".join(f"{value * MM:.9g}" for value in stands.xyz_mm)
    turned = " ".join(f"{math.radians(value):.9g}" for value in stands.wpr_deg)
    lines += [
        "  </link>",
        f'  <joint name="vehicle_dock" type="fixed"><parent link="{parse_urdf(text).root}"/>'
        f'<child link="{VEHICLE}"/><origin xyz="{xyz}" rpy="{turned}"/></joint>',
        "</robot>",
    ]
    return text.replace("</robot>", "\n".join(lines))
