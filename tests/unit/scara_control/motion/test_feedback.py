"""What is known of the joints: how old it may be and where a motion may begin."""

from __future__ import annotations

import pytest
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.joint_motion import JointMotion
from scara_control.motion.commands import MotionRefusedError, Ownership
from scara_control.motion.feedback import Feedback

JOINTS = load_robot().twin_joints
CONFIG = load_motion()
HERE = (0.1, 0.2, -0.1, 0.0)
LAST = (0.101, 0.2, -0.1, 0.5)


def feedback(q=HERE, qdot=(0.0,) * 4):
    """Make a feedback with one measurement at 10 s."""
    known = Feedback(JOINTS, CONFIG)
    known.measured = JointMotion.measured(q, qdot, 10.0)
    return known


def test_no_measurement_is_no_feedback():
    """Said so, not guessed."""
    with pytest.raises(MotionRefusedError, match="no twin/joint_states yet"):
        Feedback(JOINTS, CONFIG).fresh(0.0)


@pytest.mark.parametrize(
    ("age", "trouble"),
    [(0.0, ""), (0.499, ""), (0.52, "twin/joint_states is 0.52 s old, allowed 0.5")],
)
def test_an_old_measurement_is_no_feedback(age, trouble):
    """The text says how old and how old it may be."""
    assert feedback().trouble(10.0 + age) == trouble


def test_joints_rest_at_the_last_set_point_if_they_are_there():
    """So that the PID's rest does not add up from move to move; the table is not there."""
    assert feedback().rest(LAST, Ownership("trajectory"), 10.0) == (0.101, 0.2, -0.1, 0.0)
    assert feedback().rest(None, Ownership("trajectory"), 10.0) == HERE


def test_a_joint_of_another_controller_rests_where_it_is_measured():
    """Its old set point means nothing."""
    ownership = Ownership("trajectory")
    ownership.update({"joint_1": "velocity"})
    assert feedback().rest(LAST, ownership, 10.0)[0] == HERE[0]


def test_a_joint_that_somebody_else_moves_does_not_rest():
    """Joint, speed and controller are named."""
    ownership = Ownership("trajectory")
    ownership.update({"joint_3": "velocity"})
    with pytest.raises(
        MotionRefusedError,
        match=r"joint_3 moves at 10\.00 mm/s under its velocity controller: stop it first",
    ):
        feedback(qdot=(0.0, 0.0, 0.01, 0.0)).rest(LAST, ownership, 10.0)


def test_a_measurement_is_extrapolated_by_its_velocity():
    """Five milliseconds at 2 m/s are a centimetre."""
    measured = JointMotion.measured((0.0, -0.1), (0.0, 2.0), 1.0)
    assert measured.extrapolated(1.005) == pytest.approx((0.0, -0.09))
