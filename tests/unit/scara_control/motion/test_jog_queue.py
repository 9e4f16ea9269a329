"""Velocities that wait: what was told, what is due, and where the joints are going to be."""

from __future__ import annotations

import pytest
from scara_config import load_robot
from scara_control.motion.jogging.waiting import JogQueue

JOINTS = load_robot().twin_joints[:2]
FIRST, SECOND = (joint.name for joint in JOINTS)
PERIOD = 0.02


def told() -> JogQueue:
    """Return a queue whose first joint was told 0.4 rad/s."""
    queue = JogQueue(PERIOD)
    queue.put(0.0, {FIRST: 0.4})
    assert queue.take(0.0) == {FIRST: 0.4}
    return queue


def test_what_waits_is_where_the_joints_are_going_to_be() -> None:
    """Straight between the velocities: q by trapezia, accelerations from one to the other side."""
    queue = told()
    queue.put(0.02, {FIRST: 0.6, SECOND: -0.2})
    queue.put(0.04, {SECOND: -0.4})
    ahead = queue.setpoints(JOINTS, [0.1, 0.2], 0.0)
    assert ahead.times == pytest.approx((0.0, 0.02, 0.04))
    assert [point.qdot for point in ahead.points] == [(0.4, 0.0), (0.6, -0.2), (0.6, -0.4)]
    assert [point.q for point in ahead.points] == [
        pytest.approx((0.1, 0.2)),
        pytest.approx((0.11, 0.198)),
        pytest.approx((0.122, 0.192)),
    ]
    assert [point.qddot for point in ahead.points] == [
        pytest.approx((10.0, -10.0)),
        pytest.approx((5.0, -10.0)),
        pytest.approx((0.0, -10.0)),
    ]


def test_what_was_told_holds_until_a_period_before_the_next() -> None:
    """A velocity that is due late does not begin now."""
    queue = told()
    queue.put(0.1, {FIRST: 0.0})
    ahead = queue.setpoints(JOINTS, [0.0, 0.0], 0.0)
    assert ahead.times == pytest.approx((0.0, 0.08, 0.1))
    assert [point.qdot[0] for point in ahead.points] == [0.4, 0.4, 0.0]
    assert [point.q[0] for point in ahead.points] == pytest.approx([0.0, 0.032, 0.036])


def test_a_velocity_right_behind_another_one_gives_no_point() -> None:
    """Closer than half a period: two points at one time would be a step."""
    queue = told()
    queue.put(0.005, {FIRST: 0.6})
    ahead = queue.setpoints(JOINTS, [0.0, 0.0], 0.0)
    assert ahead.times == (0.0,) and ahead.points[0].qdot[0] == 0.4


def test_a_cap_counts_for_what_was_told_and_what_waits() -> None:
    """To the digit, both ways; what is slower stays."""
    most = JOINTS[0].velocity
    queue = JogQueue(PERIOD)
    queue.put(0.0, {FIRST: most, SECOND: 0.1})
    queue.take(0.0)
    queue.put(0.02, {FIRST: -most})
    queue.limit(JOINTS, 50.0)
    assert queue.told == {FIRST: pytest.approx(0.5 * most), SECOND: 0.1}
    assert queue.take(0.02) == {FIRST: pytest.approx(-0.5 * most)}


def test_joints_that_were_taken_from_us_are_forgotten_in_what_was_told_and_what_waits() -> None:
    """The others stay."""
    queue = told()
    queue.put(0.0, {SECOND: 0.1})
    queue.take(0.0)
    queue.put(0.02, {FIRST: 0.6, SECOND: -0.2})
    queue.drop([FIRST])
    assert queue.told == {SECOND: 0.1}
    assert queue.take(0.02) == {SECOND: -0.2}
