"""The simulated world: what geometry says happens there, and what it cannot say is found there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from harness.yaml_files import CONFIG, copy_configuration
from scara_config.frames import TaughtFrame, save_frame
from scara_config.programs.files import ProgramSteps
from scara_config.programs.steps import GripperStep, MoveStep, WaitStep
from scara_description.taught_frames import pose_of
from what_if.cell_files_io import find_program, resting_cell
from what_if.errors import WhatIfError
from what_if.judging import judge
from what_if.motions import JointTarget, ToolTarget
from what_if.physics import physics_lines
from what_if.second_world_io import SecondWorld
from what_if.verdict import Outcome
from what_if.world import Part, World

FOLLOWED_MM = 0.5
"""The loops of the simulated twin keep the tool nearer to its plan than this."""


@pytest.fixture(scope="module")
def second(world: World) -> Iterator[SecondWorld]:
    """Give one simulated cell to all tests of this module."""
    with SecondWorld(world, CONFIG) as found:
        yield found


def lines_until_lift(world: World) -> tuple[MoveStep | WaitStep | GripperStep, ...]:
    """Return PALLETISE until its first part is lifted."""
    lines = find_program(world.cell, "PALLETISE", CONFIG).steps
    grip = next(k for k, step in enumerate(lines) if isinstance(step, GripperStep))
    lift = next(k for k in range(grip, len(lines)) if isinstance(lines[k], MoveStep))
    return tuple(lines[: lift + 1])


def test_a_shipped_program_is_made_as_planned(world: World, second: SecondWorld) -> None:
    """ARTICLE: nothing happens to any part, no effort is at its limit."""
    found = second.run(world, find_program(world.cell, "ARTICLE", CONFIG))
    assert found.outcome is Outcome.OK, found.sentence
    assert (found.seen, found.saturated_steps) == ((), 0)
    assert 0.0 < found.strayed_mm < FOLLOWED_MM


def test_a_part_is_gripped_lifted_and_placed(world: World, second: SecondWorld) -> None:
    """The first part of PALLETISE; the world begins anew for each motion, twice the same."""
    steps = find_program(world.cell, "PALLETISE", CONFIG).steps
    switches = [k for k, step in enumerate(steps) if isinstance(step, GripperStep)]
    motion = ProgramSteps("ONE", tuple(steps[: switches[1] + 2]))
    first, again = second.run(world, motion), second.run(world, motion)
    texts = [seen.text for seen in first.seen]
    assert texts == ["part_1 was gripped", "part_1 was let go", "part_1 was placed on pallet"]
    assert [seen.text for seen in again.seen] == texts
    assert first.outcome is Outcome.OK


def test_a_vehicle_is_loaded_where_its_frame_says_it_stands(tmp_path: Path) -> None:
    """By geometry and by physics: the frame was measured, and nothing else of the cell changed."""
    folder = copy_configuration(tmp_path)
    turned = TaughtFrame("vehicle", (-46.0, 346.5, -40.0), (0.0, 0.0, 1.3))
    save_frame(folder, "user", 2, turned)
    with resting_cell(folder) as (world, _), SecondWorld(world, folder) as second:
        program = find_program(world.cell, "VEHICLE", folder).steps
        switches = [k for k, step in enumerate(program) if isinstance(step, GripperStep)]
        motion = ProgramSteps("ONE", program[: switches[1] + 2])
        verdict, found = judge(world, motion), second.run(world, motion)
    place = pose_of(turned) @ (0.04, 0.04, 0.0, 1.0)
    x, y = (1e3 * place[:2]).tolist()
    assert verdict.placed == (f"part_1 on vehicle at ({x:.1f}, {y:.1f}) mm",)
    assert found.seen[-1].text == "part_1 was placed on vehicle"
    assert found.outcome is Outcome.OK, found.sentence


def test_a_part_let_go_in_the_air_falls(world: World, second: SecondWorld) -> None:
    """With its line and time, as the verdict by geometry says beforehand."""
    lines = (*lines_until_lift(world), GripperStep(99, False))
    motion = ProgramSteps("DROP", lines)
    found = second.run(world, motion)
    assert found.outcome is judge(world, motion).outcome is Outcome.REFUSED
    assert "part_1 was dropped" in found.sentence
    assert any("part_1 was dropped" in line for line in physics_lines(found))


def test_what_geometry_calls_a_hit_is_one(world: World, second: SecondWorld) -> None:
    """Down onto a part that stands there."""
    motion = ToolTarget(0.65, 0.0, -0.02)
    found = second.run(world, motion)
    assert found.outcome is judge(world, motion).outcome is Outcome.REFUSED
    assert "the tool is kept" in found.sentence or "hit part_" in found.sentence


def test_a_part_that_was_moved_is_hit_where_it_lies_now(world: World, second: SecondWorld) -> None:
    """The world is put into the state of the cell: no part, no hit."""
    motion = ToolTarget(0.65, 0.0, -0.02)
    aside = np.eye(4)
    aside[:3, 3] = 0.0, 0.0, 0.05
    parts = tuple(
        Part(part.name, "pallet", _shifted(aside, 0.04 * k)) for k, part in enumerate(world.parts)
    )
    moved = second.run(replace(world, parts=parts), motion)
    assert moved.outcome is Outcome.OK, moved.sentence
    assert second.run(world, motion).outcome is Outcome.REFUSED


def _shifted(pose: np.ndarray, by: float) -> np.ndarray:
    found = pose.copy()
    found[0, 3] += by
    return found


def test_what_it_cannot_begin_with_is_said(world: World, second: SecondWorld) -> None:
    """A part in hand at the beginning, and a motion that has no way."""
    tool = world.cell.robot.tool_frame
    held = replace(world, parts=(replace(world.parts[0], link=tool), *world.parts[1:]))
    with pytest.raises(WhatIfError, match="part_1 is in hand at the beginning"):
        second.run(held, JointTarget((0.4, 0.0, -0.1, 0.0)))
    with pytest.raises(WhatIfError, match="there is no way to go"):
        second.run(world, ToolTarget(0.9, 0.0, 0.1))
