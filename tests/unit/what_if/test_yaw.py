"""A move that turns the tool is judged as the twin makes it: its wrist turns too."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest
from harness.yaml_files import CONFIG
from scara_config.profile import CHOICE
from what_if.cell_files_io import resting_cell
from what_if.judging import judge
from what_if.motions import ToolTarget
from what_if.verdict import Outcome
from what_if.world import World


@pytest.fixture(scope="module")
def world() -> Iterator[World]:
    """Give a SCARA whose twin has joint 4, at home."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(CHOICE, "scara_4axis")
        with resting_cell(CONFIG) as (found, _):
            yield found


def test_the_wrist_gives_the_yaw_and_keeps_it(world: World) -> None:
    """Asked for it is reached; left out it stays that of home."""
    tool = world.cell.kinematics.tool
    for yaw in (1.2, -2.0, None):
        verdict = judge(world, ToolTarget(0.43, 0.14, 0.1, yaw=yaw))
        assert verdict.outcome is Outcome.OK, verdict
        assert tool.yaw(verdict.target) == pytest.approx(yaw or 0.0, abs=1e-9)
        assert tool.position(verdict.target) == pytest.approx((0.43, 0.14, 0.1), abs=1e-9)


def test_a_yaw_that_is_none_is_refused(world: World) -> None:
    """By the words of the kinematics."""
    verdict = judge(world, ToolTarget(0.43, 0.14, 0.1, yaw=math.nan))
    assert verdict.outcome is Outcome.REFUSED
    assert "target yaw = nan is not finite" in verdict.reasons[0].text
