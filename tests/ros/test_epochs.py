"""What was asked for before a STOP never begins after it, whichever node stood still meanwhile."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from harness.ros import Ros
from scara_config import load_robot

NAMES = [joint.name for joint in load_robot().twin_joints]
NODES = (
    "kinematics_server",
    "joint_pose_controller",
    "joint_vel_controller",
    "motion_server",
    "trajectory_server",
)
STOOD_S = 0.5
WATCHED_S = 0.7
REST_RAD = 1e-4


class Cell:
    """Simulator and motion nodes; one of them can stand still."""

    def __init__(self, ros: Ros) -> None:
        """Start all."""
        import actionlib
        from sensor_msgs.msg import JointState

        from control_msgs.msg import FollowJointTrajectoryAction
        from scara_msgs.msg import MotionCommand, MotionState
        from scara_msgs.srv import MoveJoints, MoveTo

        self.ros = ros
        ros.run("scara_simulation", "simulator")
        self.nodes = {name: ros.run("scara_control", name) for name in NODES}
        self.move_to = ros.service("move_to", MoveTo)
        self.move = ros.service("joint_pose_controller/move", MoveJoints)
        self.joints = ros.collect("twin/joint_states", JointState)
        self.states = ros.collect("joint_pose_controller/state", MotionState)
        self.commands = ros.publisher("motion_command", MotionCommand, subscribers=5)
        self.goals = actionlib.SimpleActionClient(
            ros.name("joint_trajectory_action"), FollowJointTrajectoryAction
        )
        assert self.goals.wait_for_server(actionlib_duration(10.0))
        ros.wait_until(lambda: bool(self.joints and self.states), 10.0, "joints and states")
        self._id = 0

    def stop(self) -> None:
        """Send STOP and wait until joint_pose_controller has obeyed it, if it runs."""
        from scara_msgs.msg import MotionCommand

        self._id += 1
        self.commands.publish(MotionCommand(command=MotionCommand.STOP, id=self._id, reason="test"))

    @contextmanager
    def standing(self, name: str) -> Iterator[None]:
        """Let a node stand still for half a second."""
        began = time.monotonic()
        self.nodes[name].signal(signal.SIGSTOP)
        try:
            yield
            time.sleep(max(0.0, began + STOOD_S - time.monotonic()))
        finally:
            self.nodes[name].signal(signal.SIGCONT)

    def background(self, call: Any, **fields: object) -> list[Any]:
        """Call a service in a thread; return a list that will hold the answer."""
        answers: list[Any] = []
        threading.Thread(target=lambda: answers.append(call(**fields)), daemon=True).start()
        return answers

    def stays(self) -> None:
        """Watch for a while; nothing moves."""
        begin = list(self.joints[-1].position)
        end, farthest = time.monotonic() + WATCHED_S, 0.0
        while time.monotonic() < end:
            gaps = [abs(a - b) for a, b in zip(self.joints[-1].position, begin)]
            farthest = max(farthest, *gaps)
            time.sleep(0.01)
        assert farthest < REST_RAD


def actionlib_duration(seconds: float) -> Any:
    """Return a duration for actionlib."""
    import rospy

    return rospy.Duration.from_sec(seconds)


@pytest.fixture(scope="module")
def cell(ros_module: Ros) -> Cell:
    """Give one cell to all tests of this module."""
    return Cell(ros_module)


@pytest.mark.parametrize("standing", ["kinematics_server", "motion_server"])
def test_a_point_that_waited_behind_a_node_does_not_begin_after_stop(
    cell: Cell, standing: str
) -> None:
    """move_to waits for inverse kinematics, or in the queue of the node itself."""
    with cell.standing(standing):
        answers = cell.background(cell.move_to, x=0.51, y=0.16, z=0.10, speed_percent=30.0)
        time.sleep(0.1)  # the request is on its way before the STOP is
        cell.stop()
    answer = cell.ros.wait_until(lambda: answers, 10.0, "the answer")[0]
    assert not answer.success
    assert "cancelled by STOP: test" in answer.message or "stood still for" in answer.message
    cell.stays()
    assert cell.move_to(x=0.55, y=0.10, z=0.05, speed_percent=60.0).success


def test_a_joint_move_that_waited_does_not_begin_after_stop(cell: Cell) -> None:
    """joint_pose_controller finds the move and the STOP side by side."""
    with cell.standing("joint_pose_controller"):
        answers = cell.background(
            cell.move, joint_names=NAMES, joint_positions=[1.0, 0.5, -0.1, 0.5], speed_percent=30.0
        )
        time.sleep(0.1)  # the request is on its way before the STOP is
        cell.stop()
    answer = cell.ros.wait_until(lambda: answers, 10.0, "the answer")[0]
    assert not answer.success and "stood still for" in answer.message
    cell.stays()


def test_a_goal_that_waited_does_not_begin_after_stop(cell: Cell) -> None:
    """trajectory_server finds the goal and the STOP side by side."""
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    from control_msgs.msg import FollowJointTrajectoryGoal

    point = JointTrajectoryPoint(positions=[1.0, 0.5, -0.1, 0.5])
    point.time_from_start = actionlib_duration(3.0)
    goal = FollowJointTrajectoryGoal(trajectory=JointTrajectory(joint_names=NAMES, points=[point]))
    with cell.standing("trajectory_server"):
        cell.goals.send_goal(goal)
        time.sleep(0.1)  # the goal is on its way before the STOP is
        cell.stop()
    assert cell.goals.wait_for_result(actionlib_duration(10.0))
    assert "stood still for" in cell.goals.get_goal_status_text()
    cell.stays()
