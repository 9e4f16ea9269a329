"""Paths: together, within the limits, straight from rest, and a stop from any state."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import load_robot
from scara_control.joint_motion import JointMotion
from scara_control.motion.plan import PlanError, plan_move, plan_stop

JOINTS = load_robot().twin_joints
N = len(JOINTS)


def within(share):
    """Draw joint positions within ``share`` of the limits."""
    middles = [0.5 * (j.lower + j.upper) for j in JOINTS]
    halves = [0.5 * share * (j.upper - j.lower) for j in JOINTS]
    return st.tuples(
        *[st.floats(-1.0, 1.0).map(lambda x, m=m, h=h: m + x * h) for m, h in zip(middles, halves)]
    )


def shares_of(attribute, most):
    """Draw velocities or accelerations up to ``most`` of the joint's own."""
    return st.tuples(
        *[st.floats(-most, most).map(lambda x, j=j: x * getattr(j, attribute)) for j in JOINTS]
    )


def sampled(path, count=200):
    """Return arrays of path times, q, qdot and qddot."""
    taus = np.linspace(0.0, path.duration, count)
    motions = [path.at(tau) for tau in taus]
    return taus, *(np.array([getattr(m, what) for m in motions]) for what in ("q", "qdot", "qddot"))


def test_a_move_from_rest_is_as_quick_as_the_jerks_allow():
    """Of joints that go different ways in the same time: the one that needs most sets the pace."""
    start = tuple(0.5 * (j.lower + j.upper) for j in JOINTS)
    target = tuple(
        q + k * 0.01 * (j.upper - j.lower) for k, (j, q) in enumerate(zip(JOINTS, start), 1)
    )
    path = plan_move(JOINTS, JointMotion.at_rest(start), target, 100.0)
    taus, _, _, qddot = sampled(path, 2000)
    jerk = np.abs(np.diff(qddot, axis=0)).max(axis=0) / (taus[1] - taus[0])
    shares = jerk / [joint.jerk for joint in JOINTS]
    assert shares.max() == pytest.approx(1.0, abs=0.01)


@settings(max_examples=60, deadline=None)
@given(within(1.0), within(1.0), st.floats(1.0, 100.0))
def test_the_peak_of_a_move_is_that_of_its_fastest_joint(start, target, percent):
    """To a percent of a joint's largest speed or so."""
    path = plan_move(JOINTS, JointMotion.at_rest(start), target, percent)
    qdot = sampled(path, 2000)[2]
    exact = 100.0 * (np.abs(qdot) / [joint.velocity for joint in JOINTS]).max()
    assert exact - 1.5 <= path.peak_percent(JOINTS) <= exact + 1e-2


@settings(max_examples=60, deadline=None)
@given(within(1.0), within(1.0), st.floats(1.0, 100.0))
def test_a_move_from_rest_is_a_straight_line_that_keeps_all_limits(start, target, percent):
    """They start and end together on a straight line, slower than speed_percent of their speed."""
    path = plan_move(JOINTS, JointMotion.at_rest(start), target, percent)
    _, q, qdot, qddot = sampled(path)
    for k, joint in enumerate(JOINTS):
        assert np.abs(qdot[:, k]).max() <= joint.velocity * percent / 100.0 * (1.0 + 1e-9)
        assert np.abs(qddot[:, k]).max() <= joint.acceleration * (1.0 + 1e-9)
    line = np.array(target) - np.array(start)
    longest = np.abs(line).argmax()
    if abs(line[longest]) > 1e-6:
        share = (q[:, longest] - start[longest]) / line[longest]
        assert np.allclose(
            q, np.array(start) + share[:, None] * line, atol=1e-6 * max(1.0, abs(line[longest]))
        )
    assert path.end == target and path.at(path.duration + 1.0) == JointMotion.at_rest(target)


@settings(max_examples=60, deadline=None)
@given(
    within(0.5),
    shares_of("velocity", 1.0),
    shares_of("acceleration", 1.0),
    within(1.0),
    st.floats(5.0, 100.0),
)
def test_a_move_from_any_state_begins_there_and_ends_at_the_target(q, qdot, qddot, target, percent):
    """The path is continuous with what the joints do already, and its slope is its velocity."""
    start = JointMotion(q, qdot, qddot)
    path = plan_move(JOINTS, start, target, percent)
    first = path.at(0.0)
    assert np.allclose(first.q, q)
    assert np.allclose(first.qdot, qdot)
    assert np.allclose(first.qddot, qddot)
    assert path.at(path.duration) == JointMotion.at_rest(target)
    taus, positions, velocities, _ = sampled(path, 400)
    step = taus[1] - taus[0]
    trapezoid = positions[:-1] + 0.5 * step * (velocities[:-1] + velocities[1:])
    room = np.array([2.0 * joint.acceleration * step**2 + 1e-9 for joint in JOINTS])
    assert (np.abs(positions[1:] - trapezoid) <= room).all()


@pytest.mark.parametrize("percent", [10.0, 20.0])
@pytest.mark.parametrize("going", [0.05, 0.0])
def test_a_move_that_replaces_another_or_begins_at_rest_is_as_fast_as_it_is_told(going, percent):
    """Its fastest joint reaches that part of its largest speed, and none is faster."""
    low, high = ([getattr(joint, end) for joint in JOINTS] for end in ("lower", "upper"))
    slow = tuple(going * joint.velocity for joint in JOINTS)
    path = plan_move(JOINTS, JointMotion(tuple(low), slow, (0.0,) * 4), tuple(high), percent)
    shares = np.abs(sampled(path, 2000)[2]) / [joint.velocity for joint in JOINTS]
    assert shares.max() == pytest.approx(0.01 * percent, rel=1e-6)


@settings(max_examples=60, deadline=None)
@given(within(0.2), shares_of("velocity", 1.0), shares_of("acceleration", 1.0))
def test_a_stop_from_any_state_takes_no_longer_than_the_braking_distance(q, qdot, qddot):
    """Within v t + v^2 / 2a, where t is what its jerk needs to turn the acceleration round."""
    path = plan_stop(JOINTS, JointMotion(q, qdot, qddot))
    for k, joint in enumerate(JOINTS):
        turn = (abs(qddot[k]) + joint.acceleration) / joint.jerk
        fastest = abs(qdot[k]) + abs(qddot[k]) * turn
        braking = fastest * 2.0 * turn + fastest**2 / (2.0 * joint.acceleration)
        assert abs(path.end[k] - q[k]) <= braking + 1e-9
    assert not any(path.at(path.duration).qdot)


@settings(max_examples=60, deadline=None)
@given(within(0.2), shares_of("velocity", 1.0), shares_of("acceleration", 1.0))
def test_a_stop_at_once_gains_no_speed_first(q, qdot, qddot):
    """A follower whose leader was stopped while it gained speed ran on by a hand's breadth."""
    path = plan_stop(JOINTS, JointMotion(q, qdot, qddot), at_once=True)
    for k, joint in enumerate(JOINTS):
        turn = joint.acceleration / (8.0 * joint.jerk)
        braking = abs(qdot[k]) * (2.0 * turn + abs(qdot[k]) / (2.0 * joint.acceleration))
        assert (path.end[k] - q[k]) * math.copysign(1.0, qdot[k]) <= braking + 1e-9
        fastest = np.abs(sampled(path)[2][:, k]).max()
        # A joint that brakes already may swing back a little.
        assert qddot[k] * qdot[k] < 0.0 or fastest <= abs(qdot[k]) + 1e-6


def test_a_stop_near_a_limit_brakes_harder_rather_than_leave_it():
    """At 20 deg from the limit and full speed the usual deceleration is not enough."""
    joint = JOINTS[0]
    near = joint.upper - math.radians(20.0)
    path = plan_stop(
        JOINTS, JointMotion((near, 0.0, -0.1, 0.0), (joint.velocity, 0.0, 0.0, 0.0), (0.0,) * N)
    )
    assert near + joint.velocity**2 / (2.0 * joint.acceleration) > joint.upper
    assert max(motion[0] for motion in sampled(path)[1]) <= joint.upper


@pytest.mark.parametrize("at_once", [False, True])
def test_a_stop_that_cannot_keep_a_limit_takes_eight_times_the_jerk_and_no_more(at_once):
    """A joint at its limit with full speed leaves it; its drive is not asked for anything."""
    joint = JOINTS[0]
    motion = (joint.upper, 0.0, -0.1, 0.0), (joint.velocity, 0.0, 0.0, 0.0), (0.0,) * N
    path = plan_stop(JOINTS, JointMotion(*motion), 0.25, at_once)
    taus, _, _, qddot = sampled(path, 2000)
    assert np.abs(qddot[:, 0]).max() == pytest.approx(8.0 * 0.25 * joint.acceleration)
    jerk = np.abs(np.diff(qddot[:, 0])).max() / (taus[1] - taus[0])
    assert jerk == pytest.approx(8.0 * joint.jerk, rel=0.01)


def test_a_new_target_that_would_swing_beyond_a_limit_is_reached_after_a_stop():
    """What moves towards a limit is stopped before it when the new target lies behind."""
    joint = JOINTS[2]
    start = JointMotion((0.0, 0.0, -0.03, 0.0), (0.0, 0.0, 0.9, 3.0), (0.0,) * N)
    path = plan_move(JOINTS, start, (1.0, 1.0, -0.2, -1.0), 100.0)
    assert path.end == (1.0, 1.0, -0.2, -1.0)
    taus, q, _, qddot = sampled(path, 2000)
    assert max(row[2] for row in q) <= joint.upper + 1e-9
    # As hard as the limit asks for, and no harder: a stop at once has eight times the jerk.
    jerk = np.abs(np.diff(qddot[:, 2])).max() / (taus[1] - taus[0])
    assert jerk == pytest.approx(4.0 * joint.jerk, rel=0.01)


def test_a_move_to_where_the_joints_are_takes_no_time():
    """Nothing to do is a path too."""
    path = plan_move(
        JOINTS, JointMotion.at_rest((0.1, 0.2, -0.1, 0.0)), (0.1, 0.2, -0.1, 0.0), 50.0
    )
    assert path.duration == 0.0 and path.at(0.0).q == (0.1, 0.2, -0.1, 0.0)


@pytest.mark.parametrize(
    "plan",
    [
        lambda motion: plan_move(JOINTS, motion, (0.0,) * N, 50.0),
        lambda motion: plan_stop(JOINTS, motion),
    ],
)
def test_no_path_from_what_is_no_number(plan):
    """NaN never reaches the simulator."""
    with pytest.raises(PlanError, match=r"no path: q = .*nan.*: not finite"):
        plan(JointMotion((math.nan, 0.0, 0.0, 0.0), (0.0,) * N, (0.0,) * N))


@pytest.mark.parametrize("exponent", range(-12, 0))
def test_the_smallest_way_has_a_path_too(exponent):
    """A trim, a rounding error, a hair: 1e-12 rad is planned as well as 0.1 rad."""
    target = (10.0**exponent, -(10.0**exponent) / 3.0, -0.1, 0.0)
    path = plan_move(JOINTS, JointMotion.at_rest((0.0, 0.0, -0.1, 0.0)), target, 100.0)
    assert path.at(path.duration).q == target
    assert path.at(0.5 * path.duration).q[0] == pytest.approx(0.5 * target[0], rel=0.01, abs=1e-9)
