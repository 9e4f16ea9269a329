"""The tool keeps to its line while its button is held, within what the joints may do."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np
import pytest
from operator_panel.control.jog import DeadMan, Held, JogError, JointHeld
from operator_panel.control.tool_jog import BRAKING_S, LINES, TURNS, ToolArm
from unit.operator_panel.control.conftest import FOUR, LIMIT_PERCENT, SCARA, SIX

from scara_description.urdf import origin_transform

PERIOD = 0.05
BENT = {"joint_1": 0.3, "joint_2": 1.4, "joint_3": -0.1, "table_joint": 0.0}
FOUR_BENT = {"joint_1": 0.3, "joint_2": 1.4, "joint_3": -0.075, "joint_4": 0.5}
SIX_BENT = dict(zip((j.name for j in SIX.joints), (0.2, 0.3, -0.4, 0.3, 0.8, 0.1)))


def travel(
    arm: ToolArm, way: object, start: Mapping[str, float], seconds: float
) -> list[dict[str, float]]:
    """Return where the joints come to while a button is held."""
    places = [dict(start)]
    held = way.begun(lambda: places[-1])  # type: ignore[attr-defined]
    for _ in range(round(seconds / PERIOD)):
        velocities = held.velocities(lambda: places[-1])
        moved = {name: q + PERIOD * velocities.get(name, 0.0) for name, q in places[-1].items()}
        places.append(moved)
    return places


@pytest.mark.parametrize("axis", LINES)
@pytest.mark.parametrize("frame", ["world", "tool", "1 box"])
@pytest.mark.parametrize(("arm", "start"), [(SCARA, BENT), (FOUR, FOUR_BENT), (SIX, SIX_BENT)])
def test_tool_goes_straight_along_its_axis(
    arm: ToolArm, start: dict[str, float], axis: str, frame: str
) -> None:
    """A second of fast: at most 80 mm along the line, within 0.5 mm of it, in each frame."""
    box = origin_transform((0.0, 0.0, 0.0), (0.1, -0.2, 0.5))[:3, :3]
    arm = dataclasses.replace(arm, frames={"1 box": box})
    begin = arm.pose(start)
    axes = {"world": np.eye(3), "tool": begin[:3, :3], "1 box": box}
    along = axes[frame][:, LINES.index(axis)]
    places = travel(arm, arm.held(axis, frame, -1, True), start, 1.0)
    for place in places:
        way = arm.pose(place)[:3, 3] - begin[:3, 3]
        assert np.linalg.norm(way - along * (along @ way)) < 5e-4
    assert -0.081 < along @ way < -0.05


def test_a_frame_that_is_taken_away_ends_what_goes_along_it() -> None:
    """Taught anew its axes count from now; away, nothing goes along those of the base instead."""
    turned, other = (
        origin_transform((0.0, 0.0, 0.0), (0.0, 0.0, yaw))[:3, :3] for yaw in (0.5, -0.5)
    )
    arm = dataclasses.replace(SCARA, frames={"1 box": turned, "2 rack": turned})
    held = arm.held("x", "1 box", 1, True).begun(lambda: BENT)
    before = held.velocities(lambda: BENT)
    arm.set_frames({"1 box": other, "3 bin": turned})
    assert list(arm.frames) == ["1 box", "3 bin"]
    assert held.velocities(lambda: BENT) != pytest.approx(before)
    arm.set_frames({"3 bin": turned})
    with pytest.raises(JogError, match="frame = '1 box': it is not there any longer"):
        held.velocities(lambda: BENT)
    with pytest.raises(JogError, match="frame = '1 box': there are world, tool, 3 bin"):
        arm.held("x", "1 box", 1, True)


@pytest.mark.parametrize(("arm", "start"), [(FOUR, FOUR_BENT), (SIX, SIX_BENT)])
def test_arm_with_a_wrist_keeps_its_tool_turned_as_it_was(
    arm: ToolArm, start: dict[str, float]
) -> None:
    """As a hand expects."""
    places = travel(arm, arm.held("x", "world", 1, True), start, 1.0)
    turned = arm.pose(start)[:3, :3].T @ arm.pose(places[-1])[:3, :3]
    assert turned == pytest.approx(np.eye(3), abs=2e-3)


@pytest.mark.parametrize(
    ("arm", "start", "axis"),
    [*((SIX, SIX_BENT, axis) for axis in TURNS), (FOUR, FOUR_BENT, "rz")],
)
def test_turn_keeps_the_tool_where_it_is(arm: ToolArm, start: dict[str, float], axis: str) -> None:
    """About its own axis, 15 degrees in a second, and its point does not move."""
    begin = arm.pose(start)
    places = travel(arm, arm.held(axis, "tool", 1, True), start, 1.0)
    end = arm.pose(places[-1])
    assert end[:3, 3] == pytest.approx(begin[:3, 3], abs=5e-4)
    turned = begin[:3, :3].T @ end[:3, :3]
    angle = math.acos(min(1.0, 0.5 * (np.trace(turned) - 1.0)))
    assert math.degrees(angle) == pytest.approx(15.0, rel=0.05)
    index = TURNS.index(axis)
    assert turned[index, index] == pytest.approx(1.0, abs=1e-3)


def test_arm_without_a_wrist_offers_no_turn() -> None:
    """Its tool cannot turn and stay; that of a SCARA with one turns about the vertical."""
    assert SCARA.axes == LINES and SIX.axes == LINES + TURNS
    assert FOUR.axes == (*LINES, "rz")


def test_no_joint_is_faster_than_its_share_and_all_slow_down_together() -> None:
    """Near its stretched pose joint_2 would race: the tool gets slower and stays on its line."""
    near = {**BENT, "joint_1": 0.0, "joint_2": 0.12}
    held = SCARA.held("x", "world", 1, True).begun(lambda: near)
    velocities = held.velocities(lambda: near)
    shares = {joint.name: abs(velocities[joint.name]) / joint.velocity for joint in SCARA.joints}
    assert max(shares.values()) == pytest.approx(0.099)
    tool = np.diff(
        [
            SCARA.pose({n: q + t * velocities.get(n, 0.0) for n, q in near.items()})[:3, 3]
            for t in (0.0, 1e-5)
        ],
        axis=0,
    )[0]
    assert tool[0] > 0.0 and abs(tool[1]) < 1e-3 * tool[0]


@pytest.mark.parametrize("bend", [0.0, 0.002])
def test_stretched_arm_says_that_the_tool_cannot_go_this_way(bend: float) -> None:
    """A hand that gets no motion wants to know why."""
    stretched = {**BENT, "joint_1": 0.0, "joint_2": bend}
    held = SCARA.held("x", "world", 1, True).begun(lambda: stretched)
    with pytest.raises(JogError, match=r"stretched out or folded here.*jog a joint first"):
        held.velocities(lambda: stretched)


def test_tool_comes_to_rest_before_the_end_of_a_joints_range() -> None:
    """All joints together, not one after the other; then it says which one."""
    upper = SCARA.robot.joint("joint_3").upper
    near = {**BENT, "joint_3": upper - 0.004}
    held = SCARA.held("z", "world", 1, True).begun(lambda: near)
    assert held.velocities(lambda: near)["joint_3"] == pytest.approx(0.004 / BRAKING_S)
    there = {**near, "joint_3": upper - 1e-5}
    with pytest.raises(JogError, match=r"joint_3 = .* mm is at the end of its range"):
        held.velocities(lambda: there)


@pytest.mark.parametrize(
    ("axis", "frame", "direction", "why"),
    [
        ("rz", "world", 1, "axis = 'rz': the tool has x, y, z"),
        ("x", "base", 1, "frame = 'base': there are world, tool"),
        ("x", "world", 2, "direction = 2: it is 1 or -1"),
    ],
)
def test_wrong_way_is_refused(axis: str, frame: str, direction: int, why: str) -> None:
    """What comes from a browser is not trusted."""
    with pytest.raises(JogError, match=why):
        SCARA.held(axis, frame, direction, False)


def test_press_that_the_machine_let_die_never_moves_the_tool_again() -> None:
    """Signs that come after a pause of 0.25 s belong to a press that is over."""
    dead_man = DeadMan(SCARA.robot, LIMIT_PERCENT, 0.25)
    way = SCARA.held("y", "world", 1, False)
    dead_man.hold_way("a", 1, way, 0.0)
    moving = dead_man.tick(0.05, lambda: BENT)
    assert set(moving) == {"joint_1", "joint_2", "joint_3"} and any(moving.values())
    assert dead_man.tick(0.26, lambda: BENT) == dict.fromkeys(moving, 0.0)
    for now in (0.27, 0.30, 0.60):
        dead_man.hold_way("a", 1, way, now)
        assert dead_man.tick(now, lambda: BENT) == {}
    dead_man.hold_way("a", 2, way, 1.0)
    assert any(dead_man.tick(1.0, lambda: BENT).values()), "a new press counts"


def test_press_that_could_not_go_on_ends_with_zeros_and_says_why_at_each_sign() -> None:
    """It does not begin again when the joint has moved on; the hand must."""
    dead_man = DeadMan(SCARA.robot, LIMIT_PERCENT, 0.25)
    way = SCARA.held("x", "world", 1, False)
    dead_man.hold_way("a", 1, way, 0.0)
    moving = dead_man.tick(0.0, lambda: BENT)
    stretched = {**BENT, "joint_2": 0.0}
    assert dead_man.tick(0.05, lambda: stretched) == dict.fromkeys(moving, 0.0)
    assert dead_man.tick(0.10, lambda: BENT) == {}
    with pytest.raises(JogError, match="stretched"):
        dead_man.hold_way("a", 1, way, 0.1)
    assert dead_man.tick(0.15, lambda: BENT) == {}


def test_choice_of_another_axis_while_held_moves_nothing_else() -> None:
    """A second finger on the choice of the axes must not turn the motion under the first."""
    dead_man = DeadMan(SCARA.robot, LIMIT_PERCENT, 0.25)
    dead_man.hold_way("a", 1, SCARA.held("x", "world", 1, False), 0.0)
    moving = dead_man.tick(0.0, lambda: BENT)
    with pytest.raises(JogError, match=r"x tool \+: this press moves x world \+"):
        dead_man.hold_way("a", 1, SCARA.held("x", "tool", 1, False), 0.05)
    assert any(moving.values()) and dead_man.tick(0.05, lambda: BENT) == moving


@pytest.mark.parametrize(
    ("slow", "fast"),
    [
        tuple(SCARA.held("x", "world", 1, fast) for fast in (False, True)),
        tuple(JointHeld("joint_1", velocity) for velocity in (0.01, 0.08)),
    ],
)
def test_press_is_as_fast_as_its_newest_sign_says(slow: Held, fast: Held) -> None:
    """Eight times as fast, and slow again, the same way."""
    dead_man = DeadMan(SCARA.robot, LIMIT_PERCENT, 0.25)
    moving = []
    for way in (slow, fast, slow):
        dead_man.hold_way("a", 1, way, 0.0)
        moving.append(dead_man.tick(0.0, lambda: BENT))
    assert any(moving[0].values()) and moving[2] == pytest.approx(moving[0])
    assert moving[1] == pytest.approx({name: 8.0 * v for name, v in moving[0].items()})
