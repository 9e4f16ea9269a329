"""Both tools go along a line, in virtual time: straight, as fast as asked, past its own zones."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest
from harness.running.thorough import thorough
from harness.virtual_cell.cell import VirtualCell
from scara_config import KeepOut

OFF_MM = {"twin": 0.05, "real": 0.2}
"""How far a tool may be off its line in motion, by the loops of both plants: half of it was seen at
full speed."""
BEGIN, END = (0.45, -0.2), (0.45, 0.2)
PILLAR = KeepOut("pillar", (485.0, -30.0, -300.0), (560.0, 30.0, 60.0))
"""It stands where the joint move from BEGIN to END bulges, beside the line."""
POST = KeepOut("post", (420.0, -20.0, -300.0), (480.0, 20.0, 500.0))
"""It stands on the line."""


@pytest.fixture
def cell() -> Iterator[VirtualCell]:
    """A pair whose tools stand where the line begins, without zones."""
    with VirtualCell("fanuc_sr6ia") as built:
        built.setup.keep_out = ()
        built.connect()
        built.real.robot.write_override(100)
        begin(built)
        yield built


def begin(cell: VirtualCell) -> None:
    """Move both tools to the begin."""
    cell.move_to((*BEGIN, height(cell)), 50.0)
    cell.wait_still(0.5)


def height(cell: VirtualCell) -> float:
    """Return z of the twin's tool [m]."""
    return float(places(cell, "twin")[-1, 2])


def places(cell: VirtualCell, side: str, since: int = 0) -> np.ndarray:
    """Return where a side's tool was, shape (m, 3) [m]."""
    tool, names = cell.setup.tool, cell.setup.names
    columns = [names.index(joint.name) for joint in tool.joints]
    rows = getattr(cell, side).truth[since:]
    return np.array([tool.position([q[k] for k in columns]) for _, q, _ in rows])


def operate(cell: VirtualCell, **how: object):
    """Ask for the line as the operator."""
    target = (*END, height(cell))
    return cell.operate("MOVE", target=target, speed_percent=60.0, path="linear", **how)


@pytest.mark.parametrize("mm_s", [*thorough(0.0), 250.0])
def test_both_tools_go_straight(cell: VirtualCell, mm_s: float) -> None:
    """By the ground truth of both plants, from the first motion to the end."""
    since = {side: len(getattr(cell, side).truth) for side in OFF_MM}
    answer = operate(cell, speed_mm_s=mm_s)
    assert answer.success, answer.message
    cell.wait_still(0.5)
    for side, most in OFF_MM.items():
        way = places(cell, side, since[side])
        off = np.hypot(way[:, 0] - END[0], way[:, 2] - way[0, 2])
        assert 1e3 * off.max() < most, side
        assert way[-1, 1] == pytest.approx(END[1], abs=1e-4)
        if mm_s:
            times = [at for at, _, _ in getattr(cell, side).truth[since[side] :]]
            speeds = np.linalg.norm(np.diff(way, axis=0), axis=1) / np.diff(times)
            assert np.percentile(speeds[speeds > 0.9 * speeds.max()], 50) == pytest.approx(
                1e-3 * mm_s, rel=0.01
            )


def test_both_tools_round_a_corner_and_pass_it_as_near_as_asked(cell: VirtualCell) -> None:
    """Along two lines in one order; neither stops in the corner nor leaves a line elsewhere."""
    corner, end, most_mm = (0.55, -0.1), END, 12.0
    since = {side: len(getattr(cell, side).truth) for side in OFF_MM}
    place, target = (joints(cell, x, y) for x, y in (corner, end))
    answer = cell.operate(
        "MOVE_JOINTS",
        target=target,
        via=place,
        corner_mm=most_mm,
        path="linear",
        speed_mm_s=250.0,
        speed_percent=60.0,
    )
    assert answer.success, answer.message
    cell.wait_still(0.5)
    for side, most in OFF_MM.items():
        rows = getattr(cell, side).truth[since[side] :]
        way = 1e3 * places(cell, side, since[side])[:, :2]
        corners = 1e3 * np.array((BEGIN, corner, end))
        off = np.min([aside(way, *pair) for pair in pairwise(corners)], axis=0)
        near = np.linalg.norm(way - corners[1], axis=1)
        assert 0.2 < near.min() < most_mm
        assert off[near > most_mm + most].max() < most, side
        speeds = np.linalg.norm(np.diff(way, axis=0), axis=1) / np.diff([at for at, _, _ in rows])
        assert speeds[near[1:] < most_mm].min() > 20.0, "it does not stop there"
        assert way[-1] == pytest.approx(corners[2], abs=0.1)


def joints(cell: VirtualCell, x: float, y: float) -> tuple[float, ...]:
    """Return the twin's joints with the tool at a place, as high and with the elbow of now."""
    tool, names = cell.setup.tool, cell.setup.names
    columns = [names.index(joint.name) for joint in tool.joints]
    q = list(cell.twin.truth[-1][1])
    seed = [q[k] for k in columns]
    found = tool.inverse(x, y, height(cell), tool.elbow(seed), seed)
    for column, value in zip(columns, found.chosen.q):
        q[column] = value
    return tuple(q)


def aside(way: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return how far places are from a straight piece."""
    whole = end - begin
    along = np.clip((way - begin) @ whole / (whole @ whole), 0.0, 1.0)
    return np.linalg.norm(way - begin - np.outer(along, whole), axis=1)


def test_a_zone_in_a_corner_refuses_the_way(cell: VirtualCell) -> None:
    """As the corner is, before it is rounded."""
    cell.setup.keep_out = (POST,)
    how = {"via": joints(cell, 0.45, 0.0), "corner_mm": 12.0, "path": "linear"}
    refused = cell.operate("MOVE_JOINTS", target=joints(cell, 0.55, -0.1), **how)
    assert not refused.success and "post" in refused.message


def test_a_zone_on_the_line_refuses_it_and_one_beside_it_does_not(cell: VirtualCell) -> None:
    """A joint move with the same end is refused for the other zone."""
    cell.setup.keep_out = (POST,)
    refused = operate(cell)
    assert not refused.success and "post" in refused.message
    cell.setup.keep_out = (PILLAR,)
    target = (*END, height(cell))
    refused = cell.operate("MOVE", target=target, speed_percent=60.0)
    assert not refused.success and "pillar" in refused.message
    begun = len(cell.decisions)
    assert operate(cell).success
    cell.wait_still(0.5)
    assert "KEEP_OUT" not in [decision.trigger for decision in cell.decisions[begun:]]
    assert places(cell, "real")[-1, 1] == pytest.approx(END[1], abs=1e-4)


def test_a_line_of_the_twins_own_stops_before_a_zone_on_it(cell: VirtualCell) -> None:
    """Who leads the twin past the controller's judge is stopped by the announced way."""
    cell.setup.keep_out, since = (POST,), len(cell.real.truth)
    with pytest.raises(Exception, match="post"):
        cell.move_to((*END, height(cell)), 30.0, path="linear")
    assert places(cell, "real", since)[:, 1].max() < -0.02
    assert cell.mode == "STOPPED"


@pytest.mark.thorough
def test_a_line_that_was_paused_goes_on_straight(cell: VirtualCell) -> None:
    """PAUSE stretches its time and leaves its way."""
    since = len(cell.twin.truth)
    assert operate(cell, speed_mm_s=250.0).success
    cell.schedule.run(0.9)
    assert cell.operate("PAUSE").success
    cell.schedule.run(1.0)
    stood = places(cell, "twin")[-1, 1]
    assert BEGIN[1] + 0.02 < stood < END[1] - 0.02
    assert cell.operate("RESUME").success
    cell.wait_still(0.5)
    way = places(cell, "twin", since)
    assert 1e3 * np.hypot(way[:, 0] - END[0], way[:, 2] - way[0, 2]).max() < OFF_MM["twin"]
    assert way[-1, 1] == pytest.approx(END[1], abs=1e-4)


def test_what_is_no_line_is_refused_before_anything_moves(cell: VirtualCell) -> None:
    """By the operator's command; the reason names place and cause."""
    before = places(cell, "twin")[-1]
    answer = cell.operate("MOVE", target=(0.65, 0.0, height(cell)), path="linear")
    assert not answer.success
    assert re.search(r"after 100% of the way, at \(650.0, 0.0, .*singular", answer.message)
    assert not operate(cell, elbow="righty").success
    assert not cell.operate("MOVE", target=(*END, height(cell)), path="arc").success
    cell.schedule.run(0.5)
    assert np.abs(places(cell, "twin")[-1] - before).max() < 1e-6
