"""What the motion nodes make of messages before and beside their cores, without a ROS master."""

from __future__ import annotations

import math
import time
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import actionlib
import pytest
import rospy
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.motion.jogging.joint_vel_controller_node import JointVelController
from scara_control.motion.joint_pose_controller_node import JointPoseController
from scara_control.trajectory import execution
from scara_control.trajectory.goal import Code
from scara_control.trajectory.trajectory_server_node import TrajectoryServer
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectoryPoint

from control_msgs.msg import FollowJointTrajectoryGoal, JointJog
from scara_msgs.msg import MotionCommand, MotionState

ROBOT, CONFIG = load_robot(), load_motion()
NAMES = [joint.name for joint in ROBOT.twin_joints]
HERE, STILL = [0.1, 0.2, -0.1, 0.0], [0.0] * 4


@pytest.fixture(autouse=True)
def _ros(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give nodes topics and services that lead nowhere, and a ROS time."""
    for name in ("Publisher", "Subscriber", "Service"):
        monkeypatch.setattr(rospy, name, MagicMock())
    monkeypatch.setattr(actionlib, "ActionServer", MagicMock())
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


def test_a_goal_whose_judgement_fails_unexpectedly_is_rejected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its client would wait for ever; the failure is still raised, for the log."""
    server, handle = TrajectoryServer(ROBOT, CONFIG), MagicMock()
    handle.get_goal.return_value = FollowJointTrajectoryGoal()
    handle.get_goal_id.return_value.id = "a"
    handle.goal.header.stamp = rospy.Time()
    works = list[Any]()
    monkeypatch.setattr(server._judging, "put", works.append)
    monkeypatch.setattr(server._gate, "ask", MagicMock(side_effect=RuntimeError("a bug")))
    server._on_goal(handle)
    with pytest.raises(RuntimeError, match="a bug"):
        works[0]()
    (result, text), _ = handle.set_rejected.call_args
    assert result.error_code == Code.INVALID_GOAL
    assert text == "trajectory_server failed: RuntimeError('a bug')"
    assert not server._judged


def send_goal(server: TrajectoryServer, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Let a client send a good goal to a server that may begin one; return its handle."""
    server._reader(reading(HERE, STILL))
    server._on_motion_state(MotionState(state="idle", speed_limit_percent=100.0))
    goal, handle = FollowJointTrajectoryGoal(), MagicMock()
    goal.trajectory.joint_names = NAMES
    place = JointTrajectoryPoint(positions=HERE, time_from_start=rospy.Duration(1))
    goal.trajectory.points = [place]
    handle.get_goal.return_value, handle.get_goal_id.return_value.id = goal, "a"
    handle.goal.header.stamp = rospy.Time()
    monkeypatch.setattr(server._judging, "put", lambda work: work())
    allowed = SimpleNamespace(allowed=True, text="")
    monkeypatch.setattr(server._gate, "ask", lambda *_, **__: allowed)
    monkeypatch.setattr(server._lending, "say", lambda _: False)
    server._on_goal(handle)
    return handle


@pytest.mark.parametrize("end", ["", "STOP", "PAUSE", "cancel"])
def test_a_stop_that_comes_while_a_goal_is_checked_is_heard_and_the_goal_never_begins(
    monkeypatch: pytest.MonkeyPatch, end: str
) -> None:
    """That of ten minutes takes seconds: nothing that stops, streams or measures waits for it."""
    server, checked = TrajectoryServer(ROBOT, CONFIG), execution.check_way

    def check(*arguments: Any) -> float:
        assert not server._lock.locked()
        if end == "cancel":
            server._on_cancel(server._judged["a"])
        elif end:
            server._on_command(MotionCommand(command=getattr(MotionCommand, end), id=1))
        server._reader(reading(HERE, STILL))
        return checked(*arguments)

    monkeypatch.setattr(execution, "check_way", check)
    handle = send_goal(server, monkeypatch)
    assert server._desk.is_idle == bool(end) and handle.set_accepted.called != bool(end)
    assert handle.set_canceled.called == (end == "cancel")
    if end in ("STOP", "PAUSE"):
        assert handle.set_rejected.call_args[0][1] == f"cancelled by {end}, before it began"


def test_a_goal_that_has_waited_is_checked_without_the_lock_and_accepted_when_it_begins(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its client is told by the loop, which nothing streams meanwhile."""
    server, checked = TrajectoryServer(ROBOT, CONFIG), execution.check_way
    server._desk._quiet_until = server._clock.now() + 1e6
    handle = send_goal(server, monkeypatch)
    assert not handle.set_accepted.called and not server._desk.is_idle
    server._desk._quiet_until = 0.0

    def check(*arguments: Any) -> float:
        assert not server._lock.locked()
        return checked(*arguments)

    monkeypatch.setattr(execution, "check_way", check)
    server._tick(server._clock.now())
    assert handle.set_accepted.called and not handle.set_rejected.called


def test_the_trajectory_server_ignores_an_unknown_command() -> None:
    """joint_pose_controller warns of it; those after it are obeyed."""
    server = TrajectoryServer(ROBOT, CONFIG)
    server._on_command(MotionCommand(command=99, id=1))
    server._on_command(MotionCommand(command=MotionCommand.STOP, id=1))
    assert server._epoch._number == 1


@pytest.mark.parametrize("stamped", [True, False])
def test_a_key_that_is_held_through_a_stop_jogs_no_longer(
    monkeypatch: pytest.MonkeyPatch, stamped: bool
) -> None:
    """The STOP comes while the first jog waits for the twin controller: none was heard before."""
    # On a machine that stands still the key would count as let go.
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(time, "monotonic", lambda: clock.now)
    monkeypatch.setattr(time, "time", lambda: 1000.0 + clock.now)
    controller = JointVelController(ROBOT, CONFIG)
    stops = [MotionCommand(command=MotionCommand.STOP, id=1)]

    def say(message: JointJog, goes_on: bool) -> None:
        while stops:
            controller._on_command(stops.pop())

    monkeypatch.setattr(controller._lending, "say", say)
    jog = JointJog(joint_names=NAMES[:1], velocities=[0.1])
    for _ in range(3):
        jog.header.stamp = rospy.Time.from_sec(time.time()) if stamped else rospy.Time()
        controller._reader(reading(HERE, STILL))
        controller._on_jog(jog)
        assert controller._core.is_idle
        clock.now += 0.05
    assert "commands are ignored until they pause" in controller._core.report()


def test_a_target_that_waited_behind_another_does_not_begin_after_a_stop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without a stamp: a connection is read in the thread that asks for the one before."""
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(time, "monotonic", lambda: clock.now)
    controller = JointPoseController(ROBOT, CONFIG)
    monkeypatch.setattr(controller._gate, "ask", MagicMock())

    def say(message: JointState) -> None:
        for turn in range(40):
            clock.now += 0.01
            controller._tick(clock.now)
            if turn == 20 and clock.now < 100.5:
                controller._on_command(MotionCommand(command=MotionCommand.STOP, id=1))
        controller._reader(reading(HERE, STILL))

    monkeypatch.setattr(controller._lending, "say", say)
    controller._reader(reading(HERE, STILL))
    target = JointState(name=NAMES[:1], position=[0.3])
    for _ in range(2):
        controller._on_target(target)
        assert controller._core.is_idle
    for _ in range(10):
        clock.now += 0.01
        controller._tick(clock.now)
    controller._on_target(target)
    assert not controller._core.is_idle
