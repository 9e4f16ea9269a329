"""The worst moment: what a picture of it shows is what the verdict says."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from harness.running.thorough import thorough
from harness.second_world.followed_page import programs
from harness.yaml_files import CONFIG
from PIL import Image
from scara_control.joint_motion import JointMotion, Setpoints
from what_if.cell_files_io import find_program
from what_if.geometry.bodies import Kind
from what_if.geometry.distances import Distances
from what_if.judging import judge
from what_if.motions import JointTarget, Motion, ToolTarget
from what_if.showing.moment import Moment, worst_moment
from what_if.showing.moment_picture_io import HEIGHT, MARKED, WIDTH, picture_of
from what_if.world import Obstacle, World

FREE = JointTarget((0.4, -0.3, -0.1, 0.2), 50.0)
INTO_A_PART = ToolTarget(0.65, 0.0, -0.02)


def moment_of(world: World, motion: Motion) -> Moment:
    """Judge a motion and return its worst moment."""
    found = worst_moment(world, motion, judge(world, motion))
    assert found is not None
    return found


def names(moment: Moment) -> list[str]:
    """Return the marked bodies."""
    return [moment.bodies[k].name for k in moment.marked]


def apart_mm(moment: Moment) -> float:
    """Return the distance of the marked bodies, asked of the library itself."""
    one, other = moment.marked
    return 1e3 * Distances(moment.bodies).between(0, moment.poses, one, other)


def test_refused_motion_shows_the_two_bodies_where_they_meet(world: World) -> None:
    """The reason's own time, bodies and place; they are as near as what counts as a hit."""
    verdict, moment = judge(world, INTO_A_PART), moment_of(world, INTO_A_PART)
    first = verdict.reasons[0]
    assert moment.time == first.time_s
    tool = world.cell.robot.tool_frame
    assert names(moment)[0] == tool and names(moment)[1].startswith("part_")
    assert first.text == f"the nozzle would hit {names(moment)[1]}"
    assert first.place_mm is not None
    assert moment.place == pytest.approx([1e-3 * value for value in first.place_mm])
    assert apart_mm(moment) <= world.cell.config.nearer_mm + 0.5


def test_moment_behind_a_switch_has_the_part_in_hand(world: World, tmp_path: Path) -> None:
    """The program of docs/what_if.md comes nearest at the instant at which it has gripped."""
    file = tmp_path / "CARRY_HIGH.LS"
    file.write_text(programs()[file.name], encoding="utf-8")
    motion = find_program(world.cell, str(file), CONFIG)
    near, moment = judge(world, motion).clearance, moment_of(world, motion)
    assert near is not None
    assert moment.bodies[moment.marked[0]].kind is Kind.HELD
    assert apart_mm(moment) == pytest.approx(near.distance_mm, abs=0.2)


@pytest.mark.parametrize("name", ["", "ARTICLE", *thorough("PALLETISE")])
def test_free_motion_shows_where_bodies_come_nearest(world: World, name: str) -> None:
    """The clearance of the verdict; in PALLETISE parts are carried by then."""
    motion = find_program(world.cell, name, CONFIG) if name else FREE
    near, moment = judge(world, motion).clearance, moment_of(world, motion)
    assert near is not None and moment.time == near.time_s
    assert apart_mm(moment) == pytest.approx(near.distance_mm, abs=0.2)
    one, other = Distances(moment.bodies).points(moment.poses, *moment.marked)
    assert moment.place == pytest.approx(0.5 * (one + other), abs=1e-9)


def test_part_in_hand_is_where_the_arm_has_carried_it(world: World) -> None:
    """A post where the first part of PALLETISE is set down; both are marked."""
    tree = world.cell.tree
    home = tree.poses(np.array([world.q]))[0, tree.index["pallet"], :3, 3]
    post = Obstacle("post", "cylinder", (0.01, 0.3), (float(home[0]), float(home[1]), 0.1))
    blocked = replace(world, obstacles=(post,))
    motion = find_program(world.cell, "PALLETISE", CONFIG)
    verdict, moment = judge(blocked, motion), moment_of(blocked, motion)
    assert verdict.outcome.value == "REFUSED"
    assert "post" in names(moment)
    assert verdict.reasons[0].text.endswith("would hit post")


def test_what_has_no_place_is_shown_at_the_tool(world: World) -> None:
    """A joint that would be too fast is nowhere else."""
    motion = Setpoints(("joint_1",), (JointMotion((2.0,), (), (), 0.1),))
    moment = moment_of(world, motion)
    bodies = zip(moment.bodies, moment.poses)
    tool = next(pose for body, pose in bodies if body.link == world.cell.robot.tool_frame)
    assert moment.place == pytest.approx(tool[:3, 3])


def test_motion_that_cannot_be_planned_has_no_moment(world: World) -> None:
    """Out of reach there is no way to show."""
    far = ToolTarget(0.9, 0.0, 0.1)
    assert worst_moment(world, far, judge(world, far)) is None


def test_picture_shows_both_bodies_and_the_words(world: World) -> None:
    """From near, both colours are to be seen; the caption is not empty."""
    moment = moment_of(world, INTO_A_PART)
    data = picture_of(moment, ["REFUSED at 0.36 s: the nozzle would hit part_3"], CONFIG)
    picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(float)
    assert picture.shape[1] == 2 * WIDTH and picture.shape[0] > HEIGHT
    near = picture[:HEIGHT, WIDTH:]
    for colour in MARKED:
        # Its share of the light: whatever is darker by shadow keeps it.
        shares = near / np.maximum(near.sum(axis=2, keepdims=True), 1.0)
        alike = np.abs(shares - np.array(colour) / sum(colour)).max(axis=2) < 0.06
        assert np.count_nonzero(alike) > 200, colour
    assert np.count_nonzero(picture[HEIGHT:].min(axis=2) < 100.0) > 300


def test_zone_and_person_do_not_hide_what_is_behind(world: World) -> None:
    """A person around the tool: the arm inside is seen, tinted."""
    tree = world.cell.tree
    x, y, _ = tree.poses(np.array([FREE.q]))[0, tree.index[world.cell.robot.tool_frame], :3, 3]
    crowded = replace(world, people=((float(x), float(y), 0.0),))
    moment = moment_of(crowded, FREE)
    assert names(moment)[1] == "person 1"
    data = picture_of(moment, ["a person"], CONFIG)
    near = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))[:HEIGHT, WIDTH:]
    assert len(np.unique(near.reshape(-1, 3), axis=0)) > 50
