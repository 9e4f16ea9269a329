"""A step leads exactly one length further, along the axis that was chosen."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from harness.workspace import ROOT
from operator_panel.control.steps import StepError, joint_step, positions_now, tool_step
from operator_panel.view.snapshot import CellState, Loop, Snapshot
from scara_config import load_robot
from unit.operator_panel.control.conftest import SCARA

from scara_description.urdf import link_pose, origin_transform, parse_urdf

ROBOT = load_robot(ROOT / "config")
MODEL = parse_urdf(ROBOT.description.read_text(encoding="utf-8"))
NAMES = tuple(joint.name for joint in ROBOT.twin_joints)
NOW = dict(zip(NAMES, (0.3, 0.7, -0.1, 0.5), strict=True))


def test_joint_step_moves_one_joint_in_its_unit() -> None:
    """Degrees or millimetres."""
    target = joint_step(ROBOT, NOW, "joint_2", -10.0)
    assert target == pytest.approx([0.3, 0.7 - math.radians(10.0), -0.1, 0.5])
    assert joint_step(ROBOT, NOW, "joint_3", 0.1)[2] == pytest.approx(-0.0999)


def test_joint_step_out_of_its_range_is_refused_with_the_range() -> None:
    """Refused, not shortened."""
    limit = ROBOT.twin_joints[0].upper
    with pytest.raises(StepError, match=r"joint_1 = .* deg is outside .* to .* deg"):
        joint_step(ROBOT, {**NOW, "joint_1": limit}, "joint_1", 0.1)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("frame", ["world", "tool", "1 box"])
def test_tool_step_goes_one_length_along_its_axis(axis: str, frame: str) -> None:
    """In base_link, as the tool is turned, or as a user frame is."""
    pose = link_pose(MODEL, ROBOT.tool_frame, NOW)
    box = origin_transform((0.0, 0.0, 0.0), (0.1, -0.2, 0.5))[:3, :3]
    arm = dataclasses.replace(SCARA, frames={"1 box": box})
    target = tool_step(arm, NOW, axis, -10.0, frame)
    moved = np.array(list(target.values())) - pose[:3, 3]
    index = "xyz".index(axis)
    along = {"world": np.eye(3), "tool": pose[:3, :3], "1 box": box}[frame][:, index]
    assert moved == pytest.approx(-0.01 * along, abs=1e-12)
    assert list(target) == ["x", "y", "z"]


def test_positions_are_those_of_the_loops_else_the_rounded_ones() -> None:
    """A step of 0.1 mm is less than the rounding at the tool."""
    state = CellState("IDLE", name=NAMES, twin_position=(17.19, 40.11, -100.0, 28.65))
    told = (("joint_1", 0.3, 0.300012), ("joint_2", 0.7, math.nan))
    loops = {name: Loop(wanted, measured, 0.0, 0.0, 0.0) for name, wanted, measured in told}
    found = positions_now(ROBOT, Snapshot(state=state, loops=loops))
    assert found["joint_1"] == 0.300012
    assert found["joint_2"] == pytest.approx(math.radians(40.11))
    assert found["joint_3"] == pytest.approx(-0.1)


def test_position_of_a_loop_that_a_jog_has_opened_is_old() -> None:
    """A step after a jog would lead back to where the jog began."""
    state = CellState("IDLE", name=NAMES, twin_position=(30.0, 40.11, -100.0, 28.65))
    loops = {"joint_1": Loop(0.3, 0.3, 0.0, 0.0, 0.0)}
    found = positions_now(ROBOT, Snapshot(state=state, loops=loops))
    assert found["joint_1"] == pytest.approx(math.radians(30.0))


@pytest.mark.parametrize("state", [None, CellState("OFFLINE", name=NAMES)])
def test_unknown_position_is_said(state: CellState | None) -> None:
    """Nobody steps from nowhere."""
    with pytest.raises(StepError, match="where joint_1 is, is not known"):
        positions_now(ROBOT, Snapshot(state=state))
