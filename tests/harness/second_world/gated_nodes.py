"""Motion nodes with the gate before them and a real judge, under a ROS master of a test."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scara_config.loader import OVERRIDE
from what_if.cell_files_io import resting_cell
from what_if.judging import judge
from what_if.motions import JointTarget
from what_if.verdict import Outcome

from harness.processes import Process
from harness.ros import Ros
from harness.starter import Cell
from harness.yaml_files import CONFIG, changed_yaml, copy_configuration, shipped

HOME = (0.0, 0.0, -0.16, 0.0)
FREE = (0.4, -0.3, -0.1, 0.2)
PATIENCE_MS = 20000.0
"""Longer than any load of this machine: what is tested is what is refused, not how soon."""


def refused_targets(count: int) -> list[tuple[tuple[float, ...], str]]:
    """Return joint targets that the judge refuses from home, with its sentence."""
    rng = np.random.default_rng(7)
    with resting_cell(CONFIG) as (world, _):
        low, high = np.array([(j.lower, j.upper) for j in world.cell.robot.twin_joints]).T
        found = []
        while len(found) < count:
            # A tenth of the range beyond it, so that limits are among them.
            target = rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low))
            motion = JointTarget(tuple(target.tolist()))
            verdict = judge(world, motion)
            if verdict.outcome is Outcome.REFUSED:
                found.append((motion.q, verdict.sentence))
    return found


class GatedNodes:
    """Simulator, motion nodes and judge."""

    def __init__(self, ros: Ros, folder: Path) -> None:
        """Start all; the motion nodes wait long for a judgement."""
        import actionlib
        import rospy
        from sensor_msgs.msg import JointState
        from trajectory_msgs.msg import JointTrajectory

        from control_msgs.msg import FollowJointTrajectoryAction
        from scara_msgs.msg import Audit, MotionCommand, MotionState
        from scara_msgs.srv import JudgeMotion, MoveJoints

        changed = copy_configuration(folder)
        changed_yaml(shipped("what_if.yaml"), changed, ["gate_timeout_ms"], PATIENCE_MS)
        self.ros, self._cell = ros, Cell(ros.stage, {OVERRIDE: str(changed)})
        for node in ("simulator", "joint_pose_controller", "trajectory_server"):
            self._cell.start_node(node)
        self.judge = self.start_judge()
        self.move = ros.service("joint_pose_controller/move", MoveJoints)
        ros.service("what_if/judge", JudgeMotion)
        self.goals = actionlib.SimpleActionClient(
            ros.name("joint_trajectory_action"), FollowJointTrajectoryAction
        )
        assert self.goals.wait_for_server(rospy.Duration.from_sec(20.0))
        self.joints = ros.collect("twin/joint_states", JointState)
        self.setpoints = ros.collect("twin/joint_setpoints", JointTrajectory)
        self.states = ros.collect("joint_pose_controller/state", MotionState)
        self.told = ros.collect("what_if/gate", Audit)
        self.commands = ros.publisher("motion_command", MotionCommand, subscribers=3)
        ros.wait_until(lambda: bool(self.joints), 20.0, "joints")
        self.numbers = itertools.count(1)

    def start_judge(self) -> Process:
        """Start the judge."""
        return self._cell.start_node("what_if")

    def goal(self, target: tuple[float, ...]) -> Any:
        """Return a goal of one point."""
        import rospy
        from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

        from control_msgs.msg import FollowJointTrajectoryGoal

        names = ["joint_1", "joint_2", "joint_3", "table_joint"]
        point = JointTrajectoryPoint(positions=target, time_from_start=rospy.Duration.from_sec(6.0))
        return FollowJointTrajectoryGoal(
            trajectory=JointTrajectory(joint_names=names, points=[point])
        )

    def stop(self) -> int:
        """Send STOP; return its number."""
        from scara_msgs.msg import MotionCommand

        command = MotionCommand(command=MotionCommand.STOP, id=next(self.numbers), reason="test")
        self.commands.publish(command)
        return int(command.id)

    def background(self, target: tuple[float, ...]) -> list[Any]:
        """Ask for a move in a thread; return a list that will hold the answer."""
        answers: list[Any] = []
        threading.Thread(
            target=lambda: answers.append(self.move(joint_positions=target)), daemon=True
        ).start()
        return answers

    def refuse(self, targets: Sequence[tuple[tuple[float, ...], str]]) -> tuple[list[str], int]:
        """Ask for refused targets: half by the service, half as goals.

        Returns:
            What is wrong, and how many the judge refused: a goal outside the joints' limits does
            not come to it.
        """
        import rospy

        wrong, judged = [], 0
        for number, (target, sentence) in enumerate(targets):
            if number % 2:
                self.goals.send_goal(self.goal(target))
                done = self.goals.wait_for_result(rospy.Duration.from_sec(30.0))
                success, text = not done, self.goals.get_goal_status_text()
            else:
                answer = self.move(joint_positions=target)
                success, text = answer.success, answer.message
            judged += text.startswith("REFUSED at")
            # A goal goes another way than a move, and its node looks at limits before the judge.
            words = ("REFUSED at", "joint_") if number % 2 else ("REFUSED at",)
            same = number % 2 or sentence.split(": ", 1)[1] in text
            if success or not text.startswith(words) or not same:
                wrong.append(f"{target}: {text!r}, expected {sentence!r}")
        return wrong, judged
