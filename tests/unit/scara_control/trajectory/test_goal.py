"""Trajectories of others: what is refused, and how what is accepted leads through its points."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.joint_motion import JointMotion
from scara_control.trajectory.execution import Execution
from scara_control.trajectory.goal import Code, Goal, GoalError, check_way, plan_path
from scipy.interpolate import PchipInterpolator


def waypoint(time, q, qdot=(), qddot=()):
    """Make a point of a goal, due ``time`` after its start."""
    return JointMotion(q, qdot, qddot, time)


JOINTS = load_robot().twin_joints
NAMES = tuple(joint.name for joint in JOINTS)
CONFIG = load_motion()
HERE = (0.1, 0.2, -0.1, 0.0)
THERE = (0.3, 0.1, -0.05, 0.2)
ZERO = (0.0,) * 4
NOW = 100.0
MEASURED = JointMotion.measured(HERE, ZERO, NOW)
GOOD = Goal(
    NAMES, (waypoint(0.0, HERE), waypoint(0.5, (0.2, 0.15, -0.08, 0.1)), waypoint(1.0, THERE))
)


def execute(goal: Goal) -> Execution:
    """Check and plan a goal."""
    return Execution(JOINTS, goal, CONFIG, MEASURED, NOW)


def points(*times_and_rows: tuple[float, tuple[float, ...]]) -> Goal:
    """Return the good goal with other points."""
    return replace(GOOD, points=tuple(waypoint(t, q) for t, q in times_and_rows))


@pytest.mark.parametrize(
    "goal",
    [
        GOOD,
        points((1.0, THERE)),
        Goal(("joint_2",), (waypoint(0.5, (0.4,)),)),
        points((0.5, HERE)),
        replace(GOOD, start=NOW + 5.0),
        replace(GOOD, start=NOW - 0.05),
        replace(GOOD, path_tolerance=(("joint_1", -1.0),), goal_tolerance=(("joint_3", 0.001),)),
        replace(GOOD, points=(waypoint(0.0, HERE, ZERO, ZERO), waypoint(1.0, THERE, ZERO, ZERO))),
    ],
)
def test_good_goals_are_accepted(goal: Goal) -> None:
    """All joints or some, with or without velocities and accelerations, now or later."""
    assert execute(goal).peak_percent > 0.0 or goal.points[-1].q == HERE


@pytest.mark.parametrize(
    ("goal", "code", "text"),
    [
        (
            replace(GOOD, names=("joint_1", "joint_2", "joint_3", "wrist")),
            Code.INVALID_JOINTS,
            "unknown joint wrist: the twin has",
        ),
        (replace(GOOD, names=()), Code.INVALID_JOINTS, "no joint is named"),
        (replace(GOOD, names=("joint_1",) * 4), Code.INVALID_JOINTS, "a joint is named twice"),
        (replace(GOOD, points=()), Code.INVALID_GOAL, "the trajectory has no points"),
        (points((601.0, THERE)), Code.INVALID_GOAL, "lasts 601 s, allowed 600"),
        (points((math.nan, THERE)), Code.INVALID_GOAL, "lasts nan s"),
        (points((1.0, THERE[:3])), Code.INVALID_GOAL, "point 1: 3 positions for 4 joints"),
        (points((1.0, (math.inf, 0.1, -0.05, 0.2))), Code.INVALID_GOAL, "point 1 is not finite"),
        (
            replace(GOOD, points=(waypoint(1.0, THERE, (0.0,) * 3),)),
            Code.INVALID_GOAL,
            "point 1: 3 velocities for 4 joints",
        ),
        (
            replace(GOOD, points=(waypoint(1.0, THERE, ZERO, (0.0,)),)),
            Code.INVALID_GOAL,
            "point 1: 1 accelerations for 4 joints",
        ),
        (points((0.0, HERE), (0.0, THERE)), Code.INVALID_GOAL, "time_from_start does not increase"),
        (
            points((-1.0, HERE), (1.0, THERE)),
            Code.INVALID_GOAL,
            "time_from_start does not increase",
        ),
        (
            replace(GOOD, points=(waypoint(1.0, THERE, (0.1, 0.0, 0.0, 0.0)),)),
            Code.INVALID_GOAL,
            "the last point moves",
        ),
        (
            replace(
                GOOD,
                points=(waypoint(0.0, HERE, (3.0, 0.0, 0.0, 0.0)), waypoint(1.0, THERE)),
            ),
            Code.INVALID_GOAL,
            "the first point moves",
        ),
        (
            points((1.0, (0.1, 2.71, -0.1, 0.0))),
            Code.INVALID_GOAL,
            r"joint_2 = 2\.\d+ rad is outside \[-2\.618, 2\.618\]",
        ),
        (
            points((1.0, (0.1, 0.2, 0.02, 0.0))),
            Code.INVALID_GOAL,
            r"joint_3 = 0\.0\d+ m is outside \[-0\.21, 0\]",
        ),
        (points((0.05, THERE)), Code.INVALID_GOAL, r"rad/s\^2 is outside"),
        (
            points((0.1, (0.1, 0.2, -0.1, 3.0))),
            Code.INVALID_GOAL,
            r"table_joint = .* rad/s(\^2)? is outside",
        ),
        (
            points((0.0, THERE), (1.0, HERE)),
            Code.INVALID_GOAL,
            r"joint_1 is 11\.46 deg from the first point, allowed 1",
        ),
        (
            replace(GOOD, start=NOW - 3.0),
            Code.OLD_HEADER_TIMESTAMP,
            "should have begun 3000 ms ago",
        ),
        (replace(GOOD, start=NOW + 5000.0), Code.INVALID_GOAL, "begins in 5000 s"),
        (
            replace(GOOD, path_tolerance=(("wrist", 1.0),)),
            Code.INVALID_GOAL,
            "path_tolerance of wrist",
        ),
        (
            replace(GOOD, goal_tolerance=(("joint_1", math.nan),)),
            Code.INVALID_GOAL,
            "goal_tolerance of joint_1",
        ),
    ],
)
def test_bad_goals_are_refused_with_code_and_reason(goal: Goal, code: Code, text: str) -> None:
    """The text names joint, value and range; the code is upstream's."""
    with pytest.raises(GoalError, match=text) as caught:
        execute(goal)
    assert caught.value.code is code


def test_codes_are_those_of_the_message() -> None:
    """Names and numbers of upstream."""
    from control_msgs.msg import FollowJointTrajectoryResult

    assert {code.name: int(code) for code in Code} == {
        code.name: getattr(FollowJointTrajectoryResult, code.name) for code in Code
    }


def test_the_path_leads_through_all_points_and_ends_at_rest() -> None:
    """Position, velocity and acceleration are met where they are given."""
    given = [
        waypoint(0.0, HERE, ZERO, ZERO),
        waypoint(0.4, (0.2, 0.15, -0.08, 0.1), (0.3, -0.1, 0.05, 0.2), (0.0, 0.5, 0.0, -0.5)),
        waypoint(1.0, THERE, ZERO, ZERO),
    ]
    path = plan_path(JOINTS, HERE, given)
    for point in given:
        motion = path.at(point.time)
        assert motion.q == pytest.approx(point.q, abs=1e-12)
        assert motion.qdot == pytest.approx(point.qdot, abs=1e-12)
        assert motion.qddot == pytest.approx(point.qddot, abs=1e-9)
    assert path.at(99.0).qdot == ZERO and path.end == THERE


def test_a_first_point_with_time_is_reached_from_where_the_joints_are() -> None:
    """As the usual planners send it."""
    path = plan_path(JOINTS, HERE, [waypoint(1.0, THERE)])
    assert path.at(0.0).q == pytest.approx(HERE)
    assert path.duration == 1.0


def test_missing_velocities_are_monotone_slopes() -> None:
    """A second library chooses the same in the middle; at the ends ours are zero."""
    times = [0.0, 0.3, 0.7, 1.2, 1.5]
    rows = [(0.0, 1.0), (0.2, 0.8), (0.3, 0.9), (0.9, 0.95), (1.0, 2.0)]
    path = plan_path(JOINTS[:2], rows[0], [waypoint(t, q) for t, q in zip(times, rows)])
    slopes = PchipInterpolator(times, rows).derivative()(times)
    for k in (1, 2, 3):
        assert path.at(times[k]).qdot == pytest.approx(slopes[k], abs=1e-12)
    assert path.at(0.0).qdot == (0.0, 0.0)


def test_velocity_is_the_derivative_of_position_everywhere() -> None:
    """By central differences, also across the points."""
    path = plan_path(JOINTS, HERE, GOOD.points)
    for tau in np.linspace(0.01, 0.99, 99):
        before, after = path.at(tau - 1e-6), path.at(tau + 1e-6)
        assert (np.array(after.q) - np.array(before.q)) / 2e-6 == pytest.approx(
            path.at(tau).qdot, abs=1e-5
        )
        assert (np.array(after.qdot) - np.array(before.qdot)) / 2e-6 == pytest.approx(
            path.at(tau).qddot, abs=1e-3
        )


@pytest.mark.parametrize("stretch", [1.0, 2.0])
def test_peak_speed_is_the_largest_share_of_a_joints_speed(stretch: float) -> None:
    """Twice the time, half the speed."""
    path = plan_path(JOINTS, HERE, [waypoint(0.5 * stretch, THERE)])
    fastest = max(
        100.0 * abs(v) / joint.velocity
        for tau in np.linspace(0.0, path.duration, 1001)
        for v, joint in zip(path.at(tau).qdot, JOINTS)
    )
    assert check_way(JOINTS, path, 0.001, HERE) == pytest.approx(fastest, rel=1e-3)


def test_a_cap_that_begins_between_two_periods_holds_from_the_next_one_on() -> None:
    """The set points lie on a grid of their own: one before the cap is still to be left."""
    run = execute(GOOD)
    run.tick(MEASURED, NOW + 0.05)
    run.limit_speed(10.0, NOW + 0.0534)
    packet, ended = run.tick(MEASURED, NOW + 0.0544)
    assert packet is not None and ended is None


def test_a_joint_a_little_beyond_its_limit_may_come_back_and_not_go_on() -> None:
    """A robot at its limit may read so."""
    beyond = (HERE[0], HERE[1], 1e-5, HERE[3])
    measured = JointMotion.measured(beyond, ZERO, NOW)
    assert Execution(JOINTS, points((1.0, THERE)), CONFIG, measured, NOW).peak_percent > 0.0
    with pytest.raises(GoalError, match=r"joint_3 = .* is outside"):
        Execution(JOINTS, points((1.0, (*THERE[:2], 1e-3, THERE[3]))), CONFIG, measured, NOW)
