"""A stream that its source ends gives the joints back at once."""

from __future__ import annotations

import pytest
from harness.pair import ROBOT, ROOT
from scara_control.config import load_motion
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.pose_control import PoseController
from scara_control.motion.requests import MotionRefusedError

REST = (0.0, 0.0, -0.16, 0.0)
STILL = (0.0, 0.0, 0.0, 0.0)


@pytest.fixture
def following() -> PoseController:
    """Return a controller that follows a stream at rest."""
    controller = PoseController(ROBOT, load_motion(ROOT / "config"), 10.0)
    controller.measure(JointMotion.measured(REST, STILL, 10.0))
    controller.follow(Setpoints(controller.names, (JointMotion(REST, STILL, STILL, 10.0),)), 10.0)
    return controller


def test_a_move_is_refused_while_a_stream_is_followed(following: PoseController) -> None:
    """Two sources of motion never mix."""
    with pytest.raises(MotionRefusedError, match="following a stream"):
        following.move((), (0.1, 0.0, -0.1, 0.0), 50.0, 10.0)


def test_a_move_is_possible_as_soon_as_the_stream_has_been_ended(following: PoseController) -> None:
    """The end of a stream needs no time-out; a resting joint needs no ramp."""
    following.end_follow(10.01)
    following.tick(10.02)
    assert following.move((), (0.1, 0.0, -0.1, 0.0), 50.0, 10.02) > 0


def test_ending_a_stream_that_is_not_there_changes_nothing() -> None:
    """The end may come twice, or late."""
    controller = PoseController(ROBOT, load_motion(ROOT / "config"), 10.0)
    controller.measure(JointMotion.measured(REST, STILL, 10.0))
    move = controller.move((), (0.1, 0.0, -0.1, 0.0), 50.0, 10.0)
    controller.end_follow(10.01)
    controller.tick(10.05)
    assert controller.move((), (0.2, 0.0, -0.1, 0.0), 50.0, 10.05) == move + 1
