"""What the real robot may be told: the invalid is rejected, only speed is limited, and said."""

from __future__ import annotations

import math
import re

import pytest
from harness.pair import HOME, SETUP, shifted
from hypothesis import given
from hypothesis import strategies as st
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import RobotSetpoint
from twin_controller.core.follow.limit import (
    Rejected,
    check_setpoint,
    judge_setpoint,
    slow_setpoint,
)
from twin_controller.core.follow.memory import RealFollows
from twin_controller.core.follow.real import bounds_of, judged, reckon, setpoint_spacing
from twin_controller.core.follow.response import Response
from twin_controller.core.follow.schedule import SendSlot
from twin_controller.core.sides.side import Sides, TwinSide

BELOW = 0.995
BOUNDS = bounds_of(SETUP)
DT, FRESH, AGE_LIMIT = 0.01, 0.0, 0.1
SURE = (0.0,) * 4
Q = tuple(0.5 * (low + high) for low, high in zip(BOUNDS.lower, BOUNDS.upper))


def replaced(joint: int, value: float) -> tuple[float, ...]:
    """Return the middle position with one joint changed."""
    return tuple(value if k == joint else q for k, q in enumerate(Q))


@pytest.mark.parametrize(
    "q",
    [Q, HOME, BOUNDS.lower, BOUNDS.upper, replaced(0, BOUNDS.upper[0] + 0.9 * BOUNDS.tolerance[0])],
)
def test_set_points_within_the_limits_are_valid(q: tuple[float, ...]) -> None:
    """Limits included, and numeric noise beyond them."""
    assert check_setpoint(q, BOUNDS) == ""


@pytest.mark.parametrize(
    ("q", "text"),
    [
        (Q[:3], r"3 positions for 4 joints"),
        ((*Q, 0.0), r"5 positions for 4 joints"),
        ((), r"0 positions for 4 joints"),
        (replaced(0, math.nan), r"joint_1 = nan is not finite"),
        (replaced(1, math.inf), r"joint_2 = inf is not finite"),
        (replaced(3, -math.inf), r"table_joint = -inf is not finite"),
        (replaced(0, 2.6), r"joint_1 = 2.6 rad is outside \[-2.58309, 2.58309\]"),
        (replaced(1, -2.7), r"joint_2 = -2.7 rad is outside"),
        (replaced(2, 0.001), r"joint_3 = 0.001 m is outside \[-0.21, 0\]"),
        (replaced(2, -0.3), r"joint_3 = -0.3 m is outside"),
    ],
)
def test_invalid_set_points_are_rejected_with_joint_value_and_range(
    q: tuple[float, ...], text: str
) -> None:
    """Never clamped, never repaired."""
    assert re.search(text, check_setpoint(q, BOUNDS))
    verdict = judge_setpoint(q, Q, DT, SURE, FRESH, AGE_LIMIT, BOUNDS)
    assert isinstance(verdict, Rejected) and re.search(text, verdict.reason)


def test_noise_beyond_a_limit_is_sent_as_the_limit() -> None:
    """The robot itself refuses a set point outside its limits."""
    q = replaced(0, BOUNDS.upper[0] + 0.9 * BOUNDS.tolerance[0])
    asked = judge_setpoint(q, None, 0.0, SURE, FRESH, AGE_LIMIT, BOUNDS)
    assert asked == replaced(0, BOUNDS.upper[0])


@pytest.mark.parametrize(
    ("age", "passes"),
    [(0.0, True), (AGE_LIMIT, True), (AGE_LIMIT + 1e-6, False), (math.inf, False)],
)
def test_a_set_point_made_of_old_data_is_rejected(age: float, passes: bool) -> None:
    """Stale data never move the robot."""
    verdict = judge_setpoint(Q, None, 0.0, SURE, age, AGE_LIMIT, BOUNDS)
    assert (verdict == Q) is passes
    if isinstance(verdict, Rejected):
        assert re.search(r"the twin's data are .* ms old, allowed are 100 ms", verdict.reason)


@pytest.mark.parametrize(
    ("part", "slack", "passes"),
    [(0.0, 0.0, True), (1.0, 0.0, True), (1.19, 0.0, True), (1.21, 0.0, False), (1.21, 0.1, True)],
)
@pytest.mark.parametrize("joint", range(4))
def test_a_step_that_no_twin_makes_is_rejected(
    joint: int, part: float, slack: float, passes: bool
) -> None:
    """The largest speed with a margin; a prediction may be off by a little more."""
    v = BOUNDS.velocity[joint]
    q = replaced(joint, Q[joint] + part * v * DT)
    off = tuple(slack * v * DT if k == joint else 0.0 for k in range(4))
    verdict = judge_setpoint(q, Q, DT, off, FRESH, AGE_LIMIT, BOUNDS)
    assert isinstance(verdict, Rejected) is not passes
    if isinstance(verdict, Rejected):
        step = f"{abs(part * v * DT):.4f} {BOUNDS.units[joint]} in 10.0 ms"
        said = f"{BOUNDS.names[joint]} would step {step}, more than 1.2 times its largest speed"
        assert verdict.reason == said


@pytest.mark.parametrize(
    ("part", "limited"), [(0.0, False), (0.78, False), (0.8, True), (1.0, True), (50.0, True)]
)
@pytest.mark.parametrize("joint", range(4))
def test_a_set_point_goes_no_faster_than_it_may(joint: int, part: float, limited: bool) -> None:
    """Without a margin, however far the twin is ahead: what is left is made up for later."""
    step = part * BOUNDS.velocity[joint] * DT
    passed, why = slow_setpoint(replaced(joint, Q[joint] + step), Q, DT, 0.79, BOUNDS)
    assert bool(why) is limited
    text = rf"{BOUNDS.names[joint]} at .* % of its largest speed, allowed 79 %"
    assert bool(re.search(text, why)) is limited
    moved = abs(passed[joint] - Q[joint]) / (BOUNDS.velocity[joint] * DT)
    assert moved == pytest.approx(0.79 if limited else part, abs=1e-9)


def test_the_first_set_point_is_sent_as_it_is() -> None:
    """It is where the robot stands; there is nothing to be faster than."""
    assert slow_setpoint(Q, None, 0.0, 0.79, BOUNDS) == (Q, "")


@given(
    steps=st.tuples(*[st.floats(-20.0, 20.0)] * 4),
    share=st.floats(0.01, 1.0),
    dt=st.floats(1e-4, 0.1),
)
def test_what_passes_is_slow_enough_and_on_the_way(
    steps: tuple[float, ...], share: float, dt: float
) -> None:
    """A limited step has the direction of the wanted one: all joints are slowed alike."""
    q = tuple(p + part * v * dt for p, part, v in zip(Q, steps, BOUNDS.velocity))
    passed, _ = slow_setpoint(q, Q, dt, share, BOUNDS)
    done = [a - b for a, b in zip(passed, Q)]
    wanted = [a - b for a, b in zip(q, Q)]
    assert all(abs(step) <= v * dt * share + 1e-12 for step, v in zip(done, BOUNDS.velocity))
    ratio = max((abs(a) for a in done), default=0.0) / max(max(abs(b) for b in wanted), 1e-300)
    assert done == pytest.approx([ratio * step for step in wanted], abs=1e-12)


def test_the_bounds_are_those_of_the_robot_profile() -> None:
    """Names, limits and speeds come from robot.yaml."""
    assert BOUNDS.names == ("joint_1", "joint_2", "joint_3", "table_joint")
    assert check_setpoint(shifted(HOME, 147.9, 149.9, 159.9, 179.9), BOUNDS) == ""
    assert check_setpoint(shifted(HOME, 148.2), BOUNDS) != ""


@pytest.mark.parametrize(("share", "passes"), [(0.8, True), (1.2, False)])
def test_a_twin_without_a_plan_may_speed_up_within_its_delay(share: float, passes: bool) -> None:
    """It is carried on at constant velocity over the robot's delay, in which it can speed up."""
    now, dt, delay, ahead = 10.0, 0.01, 0.1, 0.02
    still = (0.0,) * 4
    sample = JointMotion.measured(Q, still, now)
    sides = Sides(twin=TwinSide(history=(sample,), seen=now))
    follows = RealFollows(told=(RobotSetpoint(Q, t=now, asked=Q),), delay=(delay,) * 4)
    slot = SendSlot(now + ahead, now + dt)
    # The way at the largest speed with its margin, and by how much the guess may be wrong.
    sure = BOUNDS.step_margin * BOUNDS.velocity[0] * dt
    unsure = 2.0 * dt * (ahead + delay) * SETUP.acceleration[0]
    asked = replaced(0, Q[0] + sure + share * unsure)
    found = judged(SETUP, follows, sides, slot, asked, 100.0, now)
    assert isinstance(found, Rejected) != passes, found


def test_a_twin_that_was_never_seen_is_as_old_as_can_be() -> None:
    """Nothing is made of what nobody has seen."""
    sides = Sides(twin=TwinSide(history=(JointMotion.at_rest(Q),)))
    slot, follows = SendSlot(10.0, 10.01), RealFollows(delay=SURE)
    found = judged(SETUP, follows, sides, slot, Q, 100.0, 10.0)
    assert isinstance(found, Rejected) and "the twin's data are" in found.reason
    seen = Sides(twin=TwinSide(history=(JointMotion.at_rest(Q),), seen=10.0))
    assert not isinstance(judged(SETUP, follows, seen, slot, Q, 100.0, 10.0), Rejected)


@pytest.mark.parametrize(("after", "counts"), [(0.25, 0.25), (1.0, 1.0), (5.0, 1.0)])
def test_a_set_point_goes_as_far_as_the_time_since_the_last_one_allows(
    after: float, counts: float
) -> None:
    """In parts of a spacing; where set points were left out the robot has stood meanwhile."""
    now, sides = 10.0, Sides(twin=TwinSide(history=(JointMotion.at_rest(Q),), seen=10.0))
    spacing = setpoint_spacing(SETUP, sides.real) or 0.0
    # What the twin asks for stays where it is, far from what the robot was told.
    there = replaced(0, Q[0] + 1.0)
    told = RealFollows(told=(RobotSetpoint(Q, t=now, asked=there),), delay=SURE)
    slot = SendSlot(now, now + after * spacing)
    found = judged(SETUP, told, sides, slot, there, 50.0, now)
    assert not isinstance(found, Rejected)
    step = found[0].q[0] - Q[0]
    assert step == pytest.approx(BELOW * 0.5 * BOUNDS.velocity[0] * counts * spacing)


def test_what_a_set_point_reckons_with_changes_by_a_part_of_the_time_that_has_passed() -> None:
    """A jump of the delay would be a jump of the set points; without one before all is taken."""
    found = Response(delay=(0.3,) * 4, smoothing=(1.0,) * 4, doubt=SURE, pace=100.0)
    last = RobotSetpoint(Q, t=10.0, asked=Q)
    follows = RealFollows(told=(last,), delay=(0.1,) * 4, smoothing=(0.0,) * 4)
    most = 1e-2 * SETUP.config.response.change_percent
    later = reckon(SETUP, follows, 10.5, found)
    assert later.delay == pytest.approx((0.1 + 0.5 * most,) * 4)
    # Two milliseconds squared for each second: a smoothing of 50 ms comes within 1.3 s.
    assert later.smoothing == pytest.approx((0.001,) * 4)
    for first in (RealFollows(), RealFollows(told=(last,)), RealFollows(delay=(0.1,) * 4)):
        taken = reckon(SETUP, first, 10.5, found)
        assert (taken.delay, taken.smoothing) == (found.delay, found.smoothing)
