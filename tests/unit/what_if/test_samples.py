"""Samples of a motion: they show what the verdict says, and no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from harness.yaml_files import CONFIG
from what_if.cell_files_io import find_program
from what_if.errors import WhatIfError
from what_if.judging import judge
from what_if.motions import JointTarget, Motion, ToolTarget
from what_if.showing.samples import MOST, samples_of
from what_if.world import Obstacle, World

FREE = JointTarget((0.4, -0.3, -0.1, 0.2), 50.0)


def motion_of(world: World, name: str) -> Motion:
    """Return a move, or a program by its name."""
    return find_program(world.cell, name, CONFIG) if name else FREE


@pytest.mark.parametrize("name", ["", "ARTICLE", "PALLETISE"])
def test_samples_agree_with_the_verdict(world: World, name: str) -> None:
    """The same length, the same end; no sample is nearer or faster than the verdict says."""
    motion = motion_of(world, name)
    verdict, samples = judge(world, motion), samples_of(world, motion, 300)
    assert samples is not None and verdict.clearance is not None
    assert samples.way.times[0] == 0.0
    assert samples.way.times[-1] == pytest.approx(verdict.duration_s)
    assert samples.way.points[0].q == pytest.approx(world.q, abs=1e-9)
    assert samples.way.points[-1].q == pytest.approx(verdict.target, abs=1e-6)
    assert samples.clearance.min() >= 1e-3 * verdict.clearance.at_least_mm - 1e-5
    nearest = 1e-3 * verdict.clearance.distance_mm
    assert samples.clearance.min() == pytest.approx(nearest, abs=1e-4)
    assert samples.speed.max() <= 1e-3 * verdict.tool_speed_mm_s * 1.001


def test_tool_speed_is_the_way_of_the_tool_in_time(world: World) -> None:
    """By another route: the length of the tool's way over the time between two samples."""
    samples = samples_of(world, FREE, MOST)
    assert samples is not None
    tree = world.cell.tree
    q = np.array([point.q for point in samples.way.points])
    tool = tree.poses(q)[:, tree.index[world.cell.robot.tool_frame], :3, 3]
    way = np.linalg.norm(np.diff(tool, axis=0), axis=1) / np.diff(samples.way.times)
    between = 0.5 * (samples.speed[1:] + samples.speed[:-1])
    assert np.abs(way - between).max() < 0.02 * samples.speed.max()


def test_motion_that_is_refused_shows_where_it_comes_too_near(world: World) -> None:
    """A post in the way: the motion goes on in the picture, and the curve is 0 where it hits."""
    middle = tuple(0.5 * (a + b) for a, b in zip(world.q, FREE.q))
    tree = world.cell.tree
    x, y, z = tree.poses(np.array([middle]))[0, tree.index[world.cell.robot.tool_frame], :3, 3]
    post = Obstacle("post", "cylinder", (0.005, 0.4), (float(x), float(y), float(z)))
    blocked = replace(world, obstacles=(post,))
    verdict, samples = judge(blocked, FREE), samples_of(blocked, FREE, 300)
    assert verdict.outcome.value == "REFUSED" and samples is not None
    first = samples.way.times[int(np.argmax(samples.clearance < 1e-3))]
    assert first == pytest.approx(verdict.reasons[0].time_s, abs=0.05)
    assert samples.way.points[-1].q == pytest.approx(FREE.q, abs=1e-6)


def test_motion_that_cannot_be_planned_has_no_samples(world: World) -> None:
    """Out of reach there is no way to show."""
    assert samples_of(world, ToolTarget(0.9, 0.0, 0.1), 100) is None


@pytest.mark.parametrize("count", [1, MOST + 1])
def test_count_out_of_range_is_refused(world: World, count: int) -> None:
    """A message stays small."""
    with pytest.raises(WhatIfError, match=f"samples = {count}: allowed are 0"):
        samples_of(world, FREE, count)
