"""What a world derives from its files where none of them tells it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from what_if.world import Cell, World

from scara_description.urdf import Shape, parse_urdf


def bare(world: World, carrier: str) -> Cell:
    """Return a cell without work, all of whose bodies are one box on a link.

    The link is 0.4 m under its carrier and tilted: 0.6 m of the box are upright there, and its
    middle is 0.35 m under the carrier.
    """
    joint = (
        f'<joint name="foot" type="fixed"><parent link="{carrier}"/><child link="pit"/>'
        '<origin xyz="0 0 -0.4" rpy="1.5707963267948966 0 0"/></joint>'
    )
    text = world.cell.robot.description.read_text(encoding="utf-8")
    model = parse_urdf(text.replace("</robot>", f'<link name="pit"/>{joint}</robot>'), seen=False)
    box = Shape("box", (0.1, 0.6, 0.2), (0.0, 0.05, 0.0), (0.0, 0.0, 0.0), "")
    shapes = {link: (box,) if link == "pit" else () for link in model.shapes}
    return replace(world.cell, work=None, description=replace(model, shapes=shapes))


def test_the_floor_that_no_file_tells_is_under_all_that_stands_still(world: World) -> None:
    """What the table carries hangs in the air, and the base is never under the floor."""
    work = world.cell.work
    assert work is not None and world.cell.floor == pytest.approx(1e-3 * work.floor_mm)
    assert bare(world, "base_link").floor == pytest.approx(-0.65)
    assert bare(world, "table_link").floor == 0.0
    shapes = {link: () for link in world.cell.description.shapes}
    above = Shape("sphere", (0.1,), (0.0, 0.0, 0.3), (0.0, 0.0, 0.0), "")
    model = replace(world.cell.description, shapes={**shapes, "base_link": (above,)})
    assert replace(world.cell, work=None, description=model).floor == 0.0
