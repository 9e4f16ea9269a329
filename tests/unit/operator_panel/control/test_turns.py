"""A turn leads exactly one step further about its axis, and the tool keeps its place."""

from __future__ import annotations

import math

import numpy as np
import pytest
from operator_panel.control.steps import SIZES, StepError
from operator_panel.control.tool_jog import TURNS
from operator_panel.control.turns import LEAVES_M, turn_step, why_no_turns
from scipy.spatial.transform import Rotation
from unit.operator_panel.control.conftest import FOUR, SIX, arm_of

NAMES = [joint.name for joint in SIX.robot.twin_joints]
BENT = dict(zip(NAMES, (0.2, 0.3, -0.4, 0.3, 0.8, 0.1), strict=True))


@pytest.mark.parametrize("axis", TURNS)
@pytest.mark.parametrize("frame", ["world", "tool"])
@pytest.mark.parametrize("size", SIZES)
def test_tool_turns_by_one_step_and_keeps_its_place(axis: str, frame: str, size: float) -> None:
    """About an axis of the base, or of the tool; checked with a second library."""
    begin = SIX.pose(BENT)
    for step in (-size, size):
        end = SIX.pose(dict(zip(NAMES, turn_step(SIX, BENT, axis, step, frame), strict=True)))
        assert end[:3, 3] == pytest.approx(begin[:3, 3], abs=1e-6)
        turn = math.radians(step) * np.eye(3)[TURNS.index(axis)]
        turned = begin[:3, :3].T @ end[:3, :3] if frame == "tool" else end[:3, :3] @ begin[:3, :3].T
        assert Rotation.from_matrix(turned).as_rotvec() == pytest.approx(turn, abs=1e-6)


@pytest.mark.parametrize("frame", ["world", "tool"])
def test_scara_with_its_fourth_joint_turns_its_tool_by_that_alone(frame: str) -> None:
    """About the vertical: the tool's own axis points down."""
    now = {"joint_1": 0.3, "joint_2": 1.4, "joint_3": -0.1, "joint_4": 0.5}
    target = turn_step(FOUR, now, "rz", 10.0, frame)
    turned = math.radians(-10.0 if frame == "tool" else 10.0)
    assert target == pytest.approx((0.3, 1.4, -0.1, 0.5 + turned), abs=1e-6)
    with pytest.raises(StepError, match="4 joints cannot turn the tool"):
        turn_step(FOUR, now, "rx", 10.0, frame)


def test_ten_small_turns_are_one_large_one() -> None:
    """Nothing adds up while somebody presses ten times."""
    now = dict(BENT)
    for _ in range(10):
        now = dict(zip(NAMES, turn_step(SIX, now, "ry", 1.0, "tool"), strict=True))
    assert list(now.values()) == pytest.approx(turn_step(SIX, BENT, "ry", 10.0, "tool"), abs=1e-5)


def test_turn_out_of_a_joints_range_is_refused_with_the_range() -> None:
    """Refused, not shortened."""
    straight_down = dict(zip(NAMES, SIX.robot.home_positions, strict=True))
    last = SIX.robot.joint("joint_6")
    at_end = {**straight_down, "joint_6": last.upper}
    texts = []
    for step in (-1.0, 1.0):
        try:
            turn_step(SIX, at_end, "rz", step, "tool")
        except StepError as error:
            texts.append(str(error))
    assert len(texts) == 1
    assert "joint_6 = " in texts[0] and "is outside -360 to 360 deg" in texts[0]


def test_tool_that_would_leave_its_place_on_the_way_is_refused() -> None:
    """Near a stretched wrist the joints go far, and the tool goes round with them."""
    refused = 0
    for wrist in np.linspace(0.02, 0.3, 15):
        now = {**BENT, "joint_5": float(wrist)}
        try:
            target = turn_step(SIX, now, "rz", 10.0, "world")
        except StepError as error:
            refused += "would leave its place by" in str(error)
            assert "mm on the way" in str(error) or "jog a joint first" in str(error)
            continue
        middle = {name: 0.5 * (now[name] + q) for name, q in zip(NAMES, target, strict=True)}
        apart = np.linalg.norm(SIX.pose(middle)[:3, 3] - SIX.pose(now)[:3, 3])
        assert apart <= LEAVES_M
    assert refused > 0


def test_stretched_wrist_says_what_helps() -> None:
    """Two axes of the wrist are one line: a direction is lost."""
    with pytest.raises(StepError, match="jog a joint first"):
        turn_step(SIX, {**BENT, "joint_5": 0.0}, "rx", 1.0, "world")


@pytest.mark.parametrize("name", ["fanuc_sr6ia", "fanuc_sr3ia"])
def test_scara_without_its_fourth_joint_says_why_it_cannot(name: str) -> None:
    """As in the article: the twin leaves it out."""
    scara = arm_of(name)
    now = dict.fromkeys([joint.name for joint in scara.robot.twin_joints], 0.1)
    with pytest.raises(StepError, match="its twin has no joint_4, which turns the tool"):
        turn_step(scara, now, "rz", 1.0, "world")
    assert why_no_turns(SIX.robot).startswith("Not on this robot: 6 joints cannot turn")
