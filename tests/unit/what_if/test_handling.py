"""What lies below a part that is let go, and how far."""

from __future__ import annotations

import numpy as np
import pytest
from what_if.handling import PALLET, found_part
from what_if.world import World


def link_of(world: World, rest: str, above: float, aside: float = 0.0) -> str:
    """Return what carries a part whose underside is ``above`` [m] over a rest's top."""
    cell = world.cell
    assert cell.work is not None
    top = cell.tree.poses(np.array([world.q]))[0, cell.tree.index[rest]]
    pose = top.copy()
    pose[:3, 3] += top[:3, :3] @ (aside, 0.0, above + 0.5 * cell.work.parts.height)
    return found_part(cell, "it", pose, world.q, held=False).link


@pytest.mark.parametrize(
    ("heights", "falls", "carried"),
    [
        (0.0, 0.0, True),
        (-0.9, 0.0, True),
        (-1.1, 0.0, False),
        (0.0, 0.9, True),
        (0.0, 1.1, False),
    ],
)
@pytest.mark.parametrize("rest", ["stand_1", PALLET])
def test_a_rest_carries_what_is_in_it_by_less_than_a_part_or_falls_onto_it_by_little(
    world: World, rest: str, heights: float, falls: float, carried: bool
) -> None:
    """What is deeper has the rest above it; what would fall further is dropped.

    Args: heights of a part, and of the fall that is no drop yet.
    """
    work = world.cell.work
    assert work is not None
    above = heights * work.parts.height + falls * work.watch.drop_mm * 1e-3
    assert link_of(world, rest, above) == (rest if carried else world.cell.tree.links[0])


@pytest.mark.parametrize(("part", "carried"), [(0.95, True), (-0.95, True), (1.05, False)])
def test_a_rest_carries_a_part_whose_middle_is_above_it(
    world: World, part: float, carried: bool
) -> None:
    """Else it tips over."""
    work = world.cell.work
    assert work is not None
    aside = part * work.table.stand_radius_mm * 1e-3
    assert (link_of(world, "stand_1", 0.0, aside) == "stand_1") is carried
