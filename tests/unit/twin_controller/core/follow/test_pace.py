"""The twin is never faster than what is not known of the robot's delay allows."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, idle_pair
from scara_control.joint_motion import JointMotion, Setpoints
from twin_controller.core.events import TwinPlan
from twin_controller.core.follow.memory import Follow, RealFollows
from twin_controller.core.follow.pace import follower_pace
from twin_controller.core.follow.response import Response
from twin_controller.core.safety.fastest import Cap
from twin_controller.core.sides.measure import speed_shares
from twin_controller.core.sides.side import Sides

SLOWEST_PERCENT = 4.0
replace = msgspec.structs.replace
JOINTS = len(HOME)
LIMIT, STREAM = SETUP.config.limit, SETUP.config.stream


def response(doubt: tuple[float, ...], pace: float = 100.0) -> Response:
    """Return a robot whose delays are known so well [s]."""
    delay = (0.1, *(0.08,) * (JOINTS - 1))
    return Response(delay, (0.0,) * JOINTS, doubt, pace)


def of(follow: Follow, sides: Sides, cap: float = 100.0, now: float = 0.0) -> Cap:
    """Return the pace under an operator's cap."""
    return follower_pace(SETUP, follow, sides, cap, now)


def moving(pair: Pair, way: tuple[float, ...]) -> Sides:
    """Return the sides of a pair whose twin announces a move along ``way`` [SI]."""
    sides = pair.state.sides
    points = (JointMotion.at_rest(HOME), JointMotion.at_rest(tuple(map(sum, zip(HOME, way)))))
    stamp = sides.twin.clock.to_remote(pair.now)
    plan = TwinPlan(pair.now, stamp, Setpoints.due(SETUP.names, (0.0, 1.0), points))
    twin = replace(sides.twin, plan=plan, shares=speed_shares(plan, SETUP.velocity))
    return replace(sides, twin=twin)


@pytest.mark.parametrize("doubt", [0.003, 0.006])
def test_what_is_not_known_of_a_delay_costs_a_part_of_the_reach(doubt: float) -> None:
    """By the arm's own lever: a stretched tool on joint 1 alone, shape (1,)."""
    pair = idle_pair()
    sides = moving(pair, (0.3, *(0.0,) * (JOINTS - 1)))
    found = of(Follow(response=response((doubt,) * JOINTS)), sides, now=pair.now)
    speed = 1e-2 * found.percent * SETUP.velocity[0] * SETUP.reach_mm
    assert doubt * speed == pytest.approx(
        1e-2 * SETUP.config.response.doubt_percent * SETUP.reach_mm, rel=1e-6
    )
    assert "about 100 ms" in found.reason


def test_each_joint_moves_the_tool_by_its_longest_lever() -> None:
    """About the two vertical axes by what is left of the arm, along the slide by the slide."""
    (first, second, slide, _), arm = SETUP.tool_speeds, SETUP.robot.geometry
    assert arm is not None
    assert first == pytest.approx(1e-3 * (arm.l1_mm + arm.l2_mm) * SETUP.velocity[0])
    assert second == pytest.approx(1e-3 * arm.l2_mm * SETUP.velocity[1])
    assert slide == pytest.approx(SETUP.velocity[2])


def test_only_the_joints_that_move_count() -> None:
    """A joint that has never moved holds up no other; where nobody says, any may move."""
    pair = idle_pair()
    known_but_last = response((*(0.0005,) * (JOINTS - 1), 0.02))
    first = moving(pair, (0.3, *(0.0,) * (JOINTS - 1)))
    last = moving(pair, (*(0.0,) * (JOINTS - 1), 0.3))
    follow = Follow(response=known_but_last)
    fast, slow = (of(follow, sides, now=pair.now).percent for sides in (first, last))
    unsaid = of(follow, pair.state.sides, now=pair.now).percent
    assert unsaid <= slow < fast


def test_a_robot_that_nobody_knows_is_led_slowly_but_moves() -> None:
    """Standing still would show nothing."""
    assert of(Follow(response=response((0.1,) * JOINTS)), Sides()).percent == SLOWEST_PERCENT


def test_set_points_on_their_way_to_a_new_delay_count_as_doubt() -> None:
    """What was measured just now is not what the robot was told by."""
    sure = response((0.0005,) * JOINTS)
    told = Follow(response=sure, real=RealFollows(delay=(0.092,) * JOINTS))
    assert of(told, Sides()).percent < 0.2 * of(Follow(response=sure), Sides()).percent


@pytest.mark.parametrize(("cap", "most"), [(100.0, LIMIT.told_percent), (20.0, 20.0)])
def test_set_point_after_set_point_needs_room(cap: float, most: float) -> None:
    """A robot with places for set points ahead needs none: their time is told."""
    pair = idle_pair()
    follow = Follow(response=response((0.0,) * JOINTS))
    sides = pair.state.sides
    flags = sides.real.flags
    assert flags is not None
    alone, ring = (
        replace(sides, real=replace(sides.real, flags=replace(flags, ring_places=places)))
        for places in (0, 10)
    )
    assert of(follow, alone, cap).percent == pytest.approx(1e-2 * STREAM.alone_percent * most)
    assert of(follow, ring, cap).percent == 100.0
