"""What lies below a part that is let go, and how far."""

from __future__ import annotations

import numpy as np
import pytest
from what_if.handling import PALLET, found_part, switch
from what_if.world import Part, World


def link_of(world: World, rest: str, above: float, aside: tuple[float, float] = (0.0, 0.0)) -> str:
    """Return what carries a part whose underside is ``above`` [m] over a rest's top."""
    cell = world.cell
    assert cell.work is not None
    top = cell.tree.poses(np.array([world.q]))[0, cell.tree.index[rest]]
    pose = top.copy()
    pose[:3, 3] += top[:3, :3] @ (*aside, above + 0.5 * cell.work.parts.height)
    return found_part(cell, "it", pose, world.q, held=False).link


@pytest.mark.parametrize(
    ("heights", "falls", "carried"),
    [(0.0, 0.0, True), (-0.9, 0.0, True), (-1.1, 0.0, False), (0.0, 0.9, True), (0.0, 1.1, False)],
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
    assert (link_of(world, "stand_1", 0.0, (aside, 0.0)) == "stand_1") is carried
    for side in (0, 1):
        out = [0.0, 0.0]
        out[side] = 0.5 * part * work.pallet.size_mm[side] * 1e-3
        assert (link_of(world, PALLET, 0.0, (out[0], out[1])) == PALLET) is carried


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_part_is_gripped_within_the_bellows_and_their_stroke(world: World, sign: float) -> None:
    """To each side, in the air and pressed; what is missed is told with how far it is."""
    work, tool, root = world.cell.work, world.cell.robot.tool_frame, world.cell.tree.links[0]
    nozzle = world.cell.tree.poses(np.array([world.q]))[0, world.cell.tree.index[tool]]
    for aside, gap, gripped in ((0.9, 0.9, True), (1.1, 0.0, False), (0.0, 1.1, False)):
        mm = np.array((aside * work.gripper.offset_mm, 0.0, gap * work.gripper.reach_mm))
        pose = nozzle.copy()
        pose[:3, 3] += sign * 1e-3 * mm - (0.0, 0.0, 0.5 * work.parts.height)
        done = switch(world.cell, [Part("it", root, pose)], world.q, on=True)
        far = f"there is nothing to grip: the nearest part is {np.linalg.norm(mm):.0f} mm away"
        assert (done.parts[0].link, done.missed) == ((tool, "") if gripped else (root, far))


def test_a_part_that_is_let_go_falls_onto_the_rest_or_is_dropped(world: World) -> None:
    """By little it lies on it then; by more it is no longer there."""
    cell, work = world.cell, world.cell.work
    poses, half = cell.tree.poses(np.array([world.q]))[0], 0.5 * work.parts.height
    top, nozzle = (poses[cell.tree.index[name]] for name in (PALLET, cell.robot.tool_frame))
    for falls, heights in ((0.9, [half]), (1.1, [])):
        pose = top.copy()
        pose[2, 3] += half + falls * work.watch.drop_mm * 1e-3
        held = Part("it", cell.robot.tool_frame, np.linalg.inv(nozzle) @ pose)
        done = switch(cell, [held], world.q, on=False)
        assert [part.pose[2, 3] for part in done.parts] == pytest.approx(heights)
        assert (done.placed == "") is (done.dropped != "") is (not heights)
