"""The tool of a SCARA with a wrist, in virtual time: both sides turn it, and keep it turned."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest
from harness.plants.trials import run_trial
from harness.plants.variants import FIELD, IDEAL, Variant
from harness.virtual_cell.cell import CellError, VirtualCell

POINTS = {"P2": (0.43, 0.14, 0.10), "P3": (0.43, -0.14, 0.15)}
NEAR_RAD = math.radians(0.05)


@pytest.fixture(scope="module")
def cell() -> Iterator[VirtualCell]:
    """Align a pair that turns its tool."""
    with VirtualCell("scara_4axis") as built:
        built.connect()
        yield built


def yaws(cell: VirtualCell) -> tuple[float, float]:
    """Return how the tool of both sides is turned [rad]."""
    tool = cell.setup.tool
    real, twin = (tool.yaw(side.truth[-1][1]) for side in (cell.real, cell.twin))
    return real, twin


def test_the_twins_own_move_turns_both_tools_and_the_next_keeps_them_turned(
    cell: VirtualCell,
) -> None:
    """``move_to`` with a yaw and without one; the robot follows joint 4 as the others."""
    cell.move_to(POINTS["P2"], 50.0, yaw=1.2)
    cell.wait_still(0.5)
    assert yaws(cell) == pytest.approx((1.2, 1.2), abs=NEAR_RAD)
    cell.move_to(POINTS["P3"], 50.0)
    cell.wait_still(0.5)
    assert yaws(cell) == pytest.approx((1.2, 1.2), abs=NEAR_RAD)


def test_the_operators_move_turns_them_too(cell: VirtualCell) -> None:
    """MOVE of the twin controller, with whole turns that do not count."""
    answer = cell.operate("MOVE", target=POINTS["P2"], yaw=-0.7 + math.tau, speed_percent=50.0)
    assert answer.success, answer.message
    cell.wait_still(0.5)
    assert yaws(cell) == pytest.approx((-0.7, -0.7), abs=NEAR_RAD)


def test_what_the_wrist_cannot_do_is_refused_before_anything_moves(cell: VirtualCell) -> None:
    """By both ways in."""
    with pytest.raises(CellError, match="target yaw = nan is not finite"):
        cell.move_to(POINTS["P2"], 50.0, yaw=math.nan)
    answer = cell.operate("MOVE", target=POINTS["P2"], yaw=math.inf)
    assert not answer.success and "target yaw = inf is not finite" in answer.message


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("leader", "variant"),
    [("real_leads", FIELD), ("twin_leads", FIELD), ("real_leads", IDEAL)],
)
def test_the_articles_experiments_keep_the_tools_turned_alike(
    leader: str, variant: Variant
) -> None:
    """Joint 4 turns by up to 144 deg in a move of the robot's ARTICLE; a move_to keeps the yaw."""
    trial = run_trial("scara_4axis", variant, leader, 50.0)
    assert not trial.ended, trial
    assert trial.path_percent is not None and trial.path_percent <= 1.0, trial
    assert trial.path_deg is not None and trial.path_deg <= 2.0, trial
    assert trial.rest_deg is not None and trial.rest_deg <= 0.05, trial
