"""What the motion nodes make of messages before and beside their cores, without a ROS master."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest
import rospy
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.motion.joint_pose_controller_node import JointPoseController
from sensor_msgs.msg import JointState

ROBOT, CONFIG = load_robot(), load_motion()
NAMES = [joint.name for joint in ROBOT.twin_joints]
HERE, STILL = [0.1, 0.2, -0.1, 0.0], [0.0] * 4


@pytest.fixture(autouse=True)
def _ros(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give nodes topics and services that lead nowhere, and a ROS time."""
    for name in ("Publisher", "Subscriber", "Service"):
        monkeypatch.setattr(rospy, name, MagicMock())
    monkeypatch.setattr(rospy, "get_param", lambda name, default: default)
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)


def reading(position: list[float], velocity: list[float]) -> JointState:
    """Return joint states of now, with a joint more than ours."""
    message = JointState(name=["other", *NAMES], position=[math.nan, *position])
    message.velocity = [math.inf, *velocity]
    return message


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
@pytest.mark.parametrize("field", ["position", "velocity"])
def test_a_reading_that_is_not_finite_is_none(field: str, wrong: float) -> None:
    """NaN is away from no target: a move whose joints nobody can read would count as arrived."""
    controller = JointPoseController(ROBOT, CONFIG)
    values = {"position": HERE, "velocity": STILL}
    values[field] = [*values[field][:1], wrong, *values[field][2:]]
    controller._reader(reading(**values))
    assert controller._measured is None
    controller._reader(reading(HERE, STILL))
    assert controller._measured is not None and controller._measured.q == tuple(HERE)


def test_a_move_that_was_not_judged_never_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first reading comes right after the judge could not be asked, while others answer."""
    controller, asked = JointPoseController(ROBOT, CONFIG), list[dict[str, Any]]()

    def ask(what: str, **request: Any) -> Any:
        asked.append(request)
        return SimpleNamespace(allowed=True, text="")

    monkeypatch.setattr(controller._gate, "ask", ask)
    monkeypatch.setattr(
        controller._lending, "say", lambda message: controller._reader(reading(HERE, STILL))
    )
    target = JointState(name=NAMES[:1], position=[0.3])
    controller._on_target(target)
    assert controller._core.is_idle and not asked
    controller._reader(reading(HERE, STILL))
    controller._on_target(target)
    assert not controller._core.is_idle and len(asked) == 1
