"""Closed-form SCARA: both elbows, the edge of the reach, limits, choice."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from harness.running.thorough import examples
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scara_config import load_robot
from scara_control.errors import (
    JointLimitError,
    JointVectorError,
    ScaraControlError,
    UnreachableError,
)
from scara_control.kinematics.scara import (
    REACH_TOLERANCE,
    Elbow,
    Scara,
    branches,
    solve,
    solve_elbow,
    tool_position,
)
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_control.kinematics.tool import ScaraTool

ROBOT = load_robot()
SCARA = Scara.from_robot(ROBOT)
ARM = ScrewModel.from_robot(ROBOT)
Q1 = st.floats(SCARA.joints[0].lower, SCARA.joints[0].upper)
Q2 = st.floats(SCARA.joints[1].lower, SCARA.joints[1].upper)
Q3 = st.floats(SCARA.joints[2].lower, SCARA.joints[2].upper)


def limited(joint: int, lower_deg: float, upper_deg: float) -> Scara:
    """Return the same arm with other limits of one joint."""
    joints = list(ROBOT.joints)
    joints[joint] = msgspec.structs.replace(joints[joint], lower_deg=lower_deg, upper_deg=upper_deg)
    return Scara.from_robot(msgspec.structs.replace(ROBOT, joints=joints))


@settings(deadline=None)
@given(Q1, Q2, Q3)
def test_position_is_that_of_the_screw_model(q1, q2, q3):
    """Two routes to the same point: the closed form and the product of exponentials."""
    np.testing.assert_allclose(
        tool_position(SCARA, q1, q2, q3), forward_kinematics(ARM, [q1, q2, q3])[:3, 3], atol=1e-14
    )


def test_straight_arm_reaches_sum_of_links():
    """At zero joints the tool is at (0.65, 0, 0.16)."""
    assert tool_position(SCARA, 0.0, 0.0, 0.0) == pytest.approx((0.65, 0.0, 0.16), abs=1e-15)
    assert SCARA.outer_radius == pytest.approx(0.65)


def test_inner_radius_is_given_by_the_limit_of_joint_2():
    """With |J2| <= 150 deg it is 0.175 m, not L1 - L2 = 0.05 m, and the tool can stand on it."""
    x, y, _ = tool_position(SCARA, 0.3, SCARA.joints[1].upper, 0.0)
    assert SCARA.inner_radius == pytest.approx(0.175, abs=2e-4)
    assert math.hypot(x, y) == pytest.approx(SCARA.inner_radius, abs=1e-15)


@pytest.mark.parametrize("limits_deg", [(-150.0, 100.0), (-100.0, 150.0)])
def test_inner_radius_is_given_by_the_larger_limit_of_joint_2(limits_deg):
    """By the law of cosines with the 30 deg that 150 deg leave between the links."""
    scara = limited(1, *limits_deg)
    left = math.cos(math.radians(30.0))
    expected = math.sqrt(0.35**2 + 0.30**2 - 2.0 * 0.35 * 0.30 * left)
    assert scara.inner_radius == pytest.approx(expected, abs=1e-12)


@settings(deadline=None, max_examples=examples(150, 500))
@given(Q1, Q2, Q3)
def test_point_to_joints_and_back_is_the_point(q1, q2, q3):
    """Within 1e-12 m everywhere, the edge of the reach included."""
    point = tool_position(SCARA, q1, q2, q3)
    for q in branches(SCARA, *point):
        if q is not None:
            assert tool_position(SCARA, *q) == pytest.approx(point, abs=1e-12)


@settings(deadline=None, max_examples=examples(150, 500))
@given(Q1, Q2, Q3)
def test_joints_to_point_and_back_are_the_joints(q1, q2, q3):
    """The solution on the same side is the one it came from, as far as the point still tells it."""
    assume(abs(q2) > 1e-3)
    q = solve_elbow(SCARA, *tool_position(SCARA, q1, q2, q3), Elbow.of(q2))
    assert q == pytest.approx((q1, q2, q3), abs=1e-11)


@pytest.mark.parametrize("inside", [0.0, 1e-17, 1e-16, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("angle_deg", [0.0, 33.0, -77.0, 120.0])
@pytest.mark.parametrize("elbow", Elbow)
def test_edge_of_the_reach_is_reached_to_the_last_digit(inside, angle_deg, elbow):
    """Where an arc cosine loses half of the digits the tool still arrives within 1e-15 m."""
    angle, r = math.radians(angle_deg), 0.65 - inside
    x, y, _ = tool_position(
        SCARA, *solve_elbow(SCARA, r * math.cos(angle), r * math.sin(angle), 0.0, elbow)
    )
    assert math.hypot(x - r * math.cos(angle), y - r * math.sin(angle)) < 1e-15


def test_first_position_of_the_article_is_the_straight_arm():
    """P1 lies on the edge: a bare acos refuses it, here both elbows give zero."""
    for elbow in Elbow:
        assert solve_elbow(SCARA, 0.65, 0.0, 0.0, elbow) == (0.0, 0.0, -0.16)


def test_target_beyond_the_edge_by_rounding_is_put_on_the_edge():
    """The stated tolerance, not more."""
    assert solve(SCARA, 0.65 + 0.9 * REACH_TOLERANCE, 0.0, 0.0).q == (0.0, 0.0, -0.16)
    with pytest.raises(UnreachableError):
        solve(SCARA, 0.65 + 1.1 * REACH_TOLERANCE, 0.0, 0.0)


@pytest.mark.parametrize("below", [0.0, 0.9])
def test_an_arm_that_folds_reaches_the_inner_edge_and_as_far_beyond_it(below):
    """By the tolerance of the outer edge, not more."""
    scara = limited(1, -181.0, 181.0)
    q = solve(scara, 0.05 - below * REACH_TOLERANCE, 0.0, 0.0).q
    assert abs(q[1]) == pytest.approx(math.pi)
    with pytest.raises(UnreachableError):
        solve(scara, 0.05 - 1.1 * REACH_TOLERANCE, 0.0, 0.0)


@pytest.mark.parametrize(
    ("target", "text"),
    [
        ((0.9, 0.0, 0.0), r"at radius 0\.9 m, outside the reach \[0\.175, 0\.65\] m"),
        ((0.6501, 0.0, 0.0), r"at radius 0\.6501 m, outside the reach"),
        ((0.1, 0.1, 0.0), r"at radius 0\.141421 m, outside the reach \[0\.175, 0\.65\] m"),
        ((0.0, 0.0, 0.0), r"at radius 0 m, outside the reach"),
        ((0.03, 0.0, 9.0), r"target \(0\.03, 0\) m is at radius 0\.03 m, outside the reach"),
        ((math.nan, 0.0, 0.0), "target x = nan is not finite"),
        ((0.5, -math.inf, 0.0), "target y = -inf is not finite"),
        ((0.5, 0.0, math.nan), "target z = nan is not finite"),
    ],
)
@pytest.mark.parametrize("elbow", [None, *Elbow])
def test_target_out_of_reach_is_refused_with_radius_and_range(target, text, elbow):
    """What is really out of reach is never clamped."""
    with pytest.raises(UnreachableError, match=text):
        solve(SCARA, *target, elbow)


@pytest.mark.parametrize(
    ("target", "text"),
    [
        ((-0.6, 0.0, 0.1), r"joint_1 = 2\.77772 rad is outside \[-2\.583, 2\.583\]"),
        ((0.5, 0.0, 0.17), r"joint_3 = 0\.01 m is outside \[-0\.21, 0\]"),
        ((0.5, 0.0, -0.06), r"joint_3 = -0\.22 m is outside \[-0\.21, 0\]"),
    ],
)
def test_target_outside_the_limits_is_refused_with_joint_value_and_range(target, text):
    """When both elbows break a limit the text tells one of them."""
    with pytest.raises(JointLimitError, match=text):
        solve(SCARA, *target)


def test_lowest_stroke_is_within_the_limit():
    """-0.05 - 0.16 is -0.21000000000000002; the answer is the limit, which all others accept."""
    assert solve(SCARA, 0.5, 0.0, -0.05).q[2] == SCARA.joints[2].lower


def test_elbow_that_breaks_a_limit_gives_way_to_the_other():
    """Behind the base one elbow needs too much of joint_1; asking for it by name is refused."""
    x, y = 0.3 * math.cos(2.5), 0.3 * math.sin(2.5)
    righty, lefty = branches(SCARA, x, y, 0.0)
    assert righty is not None and lefty is None
    assert solve(SCARA, x, y, 0.0, seed=(2.5, -2.0, 0.0)).elbow is Elbow.RIGHTY
    assert solve(SCARA, x, -y, 0.0).elbow is Elbow.LEFTY
    with pytest.raises(JointLimitError, match=r"joint_1 = -2\.8.*is outside"):
        solve(SCARA, x, y, 0.0, Elbow.LEFTY)


@pytest.mark.parametrize(
    ("seed", "elbow"),
    [
        (None, Elbow.RIGHTY),
        ((-0.25, 1.2, 0.0), Elbow.RIGHTY),
        ((0.86, -1.2, 0.0), Elbow.LEFTY),
        ((0.304, 0.0, 0.0), Elbow.RIGHTY),
    ],
)
def test_without_a_wish_the_elbow_nearer_to_the_seed_is_chosen(seed, elbow):
    """Undecided is righty."""
    assert solve(SCARA, 0.51, 0.16, 0.1, seed=seed).elbow is elbow


def test_straight_arm_is_righty_whatever_the_seed():
    """At P1 both solutions are one; the default decides."""
    assert solve(SCARA, 0.65, 0.0, 0.0, seed=(0.1, -0.5, 0.0)).elbow is Elbow.RIGHTY


@pytest.mark.parametrize("seed", [(0.0, 0.0), (0.0, math.nan, 0.0)])
def test_seed_that_is_no_joint_vector_is_refused(seed):
    """A wrong seed must not decide silently."""
    with pytest.raises(JointVectorError):
        solve(SCARA, 0.51, 0.16, 0.1, seed=seed)


@settings(deadline=None)
@given(st.floats(-175.0, 360.0), Q2)
def test_joint_1_is_turned_into_its_limits(q1_deg, q2):
    """A gamma - alpha beyond half a turn is the same angle less a full one: both are tried."""
    scara = limited(0, -175.0, 360.0)
    point = tool_position(scara, math.radians(q1_deg), q2, 0.0)
    for q in branches(scara, *point):
        assert q is not None
        assert scara.joints[0].lower <= q[0] <= scara.joints[0].upper
        assert tool_position(scara, *q) == pytest.approx(point, abs=1e-12)


@pytest.mark.parametrize(
    ("seed_deg", "expected_deg"), [(350.0, 350.0), (-20.0, -10.0), (169.0, -10.0), (171.0, 350.0)]
)
def test_of_two_turns_the_one_nearer_to_the_seed_is_taken(seed_deg, expected_deg):
    """With a range of more than a turn the arm does not unwind without need."""
    scara = limited(0, -175.0, 360.0)
    x, y, z = tool_position(scara, math.radians(-10.0), 0.5, 0.0)
    q = solve(scara, x, y, z, Elbow.RIGHTY, (math.radians(seed_deg), 0.5, 0.0)).q
    assert math.degrees(q[0]) == pytest.approx(expected_deg)


def test_the_turn_of_joint_1_counts_in_what_is_nearer_to_the_seed():
    """The elbow bends the same way far on both sides; joint_1 alone tells them apart."""
    righty, lefty = branches(SCARA, *tool_position(SCARA, 0.2, 0.7, 0.0))
    assert abs(lefty[0]) > abs(righty[0]) and lefty[1] == pytest.approx(-righty[1])
    point = tool_position(SCARA, *righty)
    assert solve(SCARA, *point, seed=(lefty[0], 0.0, 0.0)).elbow is Elbow.LEFTY
    assert solve(SCARA, *point, seed=(righty[0], 0.0, 0.0)).elbow is Elbow.RIGHTY


def test_both_branches_are_shown_in_the_turn_of_the_seed():
    """Joint 1 of the seed says which; its other joints do not."""
    scara = limited(0, -450.0, 450.0)
    seed = (math.radians(380.0), 0.5, -0.05)
    answer = ScaraTool(scara).inverse(*tool_position(scara, *seed), None, seed)
    assert math.degrees(answer.righty[0]) == pytest.approx(380.0)
    assert math.degrees(answer.lefty[0]) > 300.0


@pytest.mark.parametrize(
    ("lower", "upper", "nearer"), [(-175.0, 360.0, -170.0), (-360.0, 175.0, 170.0)]
)
def test_of_two_turns_the_one_nearer_to_0_is_shown_without_a_seed(lower, upper, nearer):
    """Both elbows are shown as the arm would take them from its zero."""
    scara = limited(0, lower, upper)
    x, y, z = tool_position(scara, math.radians(nearer), 0.5, 0.0)
    q = ScaraTool(scara).inverse(x, y, z, None, None).righty
    assert math.degrees(q[0]) == pytest.approx(nearer)


def test_robot_that_is_no_scara_is_refused():
    """The closed form needs two or three turning joints and a sliding one."""
    with pytest.raises(
        ScaraControlError,
        match="is no SCARA: its arm joints are joint_1, joint_2, expected two or three revolute",
    ):
        Scara.from_robot(msgspec.structs.replace(ROBOT, joints=ROBOT.joints[:2]))
