"""The gate of the motion nodes with a real judge: refused motions never reach the wire."""

from __future__ import annotations

import itertools
import signal
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from harness.processes import Process
from harness.ros import Ros
from harness.yaml_files import CONFIG, changed_yaml, copy_configuration, shipped
from what_if.io.cell_files import resting_cell
from what_if.judging import judge
from what_if.motions import JointTarget
from what_if.verdict import Outcome

HOME = (0.0, 0.0, -0.16, 0.0)
FREE = (0.4, -0.3, -0.1, 0.2)
REFUSED = 20
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


class Cell:
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
        self.ros = ros
        ros.run("scara_simulation", "simulator")
        for node in ("joint_pose_controller", "trajectory_server"):
            ros.run("scara_control", node, f"_config_dir:={changed}")
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
        self.commands = ros.publisher("motion_command", MotionCommand, subscribers=2)
        ros.wait_until(lambda: bool(self.joints), 20.0, "joints")
        self.numbers = itertools.count(1)

    def start_judge(self) -> Process:
        """Start the judge."""
        return self.ros.run("what_if", "what_if")

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


@pytest.fixture(scope="module")
def cell(ros_module: Ros, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    """Give one cell to all tests of this module."""
    yield Cell(ros_module, tmp_path_factory.mktemp("config"))


def test_refused_commands_send_no_set_point_and_say_why(cell: Cell) -> None:
    """Twenty: half by the service, half as goals. Then one that is free does move."""
    import rospy

    for number, (target, sentence) in enumerate(refused_targets(REFUSED)):
        if number % 2:
            cell.goals.send_goal(cell.goal(target))
            assert cell.goals.wait_for_result(rospy.Duration.from_sec(30.0))
            text = cell.goals.get_goal_status_text()
            assert text.startswith("REFUSED at"), (text, sentence)
            continue
        answer = cell.move(joint_positions=target)
        assert not answer.success
        assert answer.message.startswith(sentence.split(" at ")[0]), (answer.message, sentence)
        assert sentence.split(": ", 1)[1] in answer.message
    assert cell.setpoints == []
    assert max(abs(a - b) for a, b in zip(sorted(cell.joints[-1].position), sorted(HOME))) < 1e-3
    assert [said.success for said in cell.told] == [False] * REFUSED
    answer = cell.move(joint_positions=FREE)
    assert answer.success, answer.message
    assert cell.setpoints
    assert cell.told[-1].success and cell.told[-1].outcome.startswith("OK")
    assert cell.move(joint_positions=HOME).success


def test_a_judge_that_was_resting_knows_where_the_twin_stands_now(cell: Cell) -> None:
    """It hears a hundred joint states a second and reads few of them until it is asked."""
    from scara_msgs.srv import JudgeMotion

    judge = cell.ros.service("what_if/judge", JudgeMotion)
    for target in (FREE, HOME, FREE, HOME):
        assert cell.move(joint_positions=target).success
        there = judge(motion="MOVE_JOINTS", joint_positions=target)
        back = judge(motion="MOVE_JOINTS", joint_positions=FREE if target == HOME else HOME)
        assert there.success and back.success
        assert there.duration < 0.1 < back.duration


def test_without_a_judge_it_moves_and_that_is_told(cell: Cell) -> None:
    """The judge is killed; what nobody judged moves as before, by the shipped file."""
    cell.judge.signal(signal.SIGKILL)
    cell.judge.wait(10.0)
    cell.ros.stage.processes.remove(cell.judge)
    answer = cell.move(joint_positions=HOME)
    assert answer.success, answer.message
    said = cell.told[-1]
    assert said.success and said.outcome.startswith("not judged: ")


class SlowJudge:
    """A judge in this process that answers OK, but only when it is told to."""

    def __init__(self, ros: Ros) -> None:
        """Offer the service."""
        import rospy

        from scara_msgs.srv import JudgeMotion

        self.asked, self.may_answer = threading.Event(), threading.Event()
        self.service = rospy.Service(ros.name("what_if/judge"), JudgeMotion, self._answer)

    def _answer(self, _: Any) -> Any:
        from scara_msgs.srv import JudgeMotionResponse

        self.asked.set()
        assert self.may_answer.wait(30.0)
        return JudgeMotionResponse(success=True, verdict="OK", message="OK: takes 1.00 s")

    def __enter__(self) -> SlowJudge:
        return self

    def __exit__(self, *_: object) -> None:
        self.may_answer.set()
        self.service.shutdown("the test ends")


def test_a_stop_does_not_wait_for_the_judge(cell: Cell) -> None:
    """A move that is being judged is ended by STOP and never begins, although it is judged OK."""
    cell.setpoints.clear()
    with SlowJudge(cell.ros) as judge:
        answers = cell.background(FREE)
        assert judge.asked.wait(20.0)
        number = cell.stop()
        cell.ros.wait_until(
            lambda: cell.states[-1].last_command_id == number, 5.0, "STOP while the judge thinks"
        )
        assert not answers
        judge.may_answer.set()
        answer = cell.ros.wait_until(lambda: answers, 30.0, "the answer")[0]
    assert not answer.success
    assert "cancelled by STOP: test" in answer.message
    assert cell.setpoints == []


def test_a_goal_is_cancelled_while_it_is_judged(cell: Cell) -> None:
    """The action's own lock is free meanwhile, and the goal never begins."""
    import rospy

    from scara_msgs.msg import Audit

    cell.setpoints.clear()
    with SlowJudge(cell.ros) as judge:
        cell.goals.send_goal(cell.goal(FREE))
        assert judge.asked.wait(20.0)
        cell.goals.cancel_goal()
        assert cell.goals.wait_for_result(rospy.Duration.from_sec(10.0))
        assert "cancelled before it began" in cell.goals.get_goal_status_text()
        heard: list[Audit] = cell.told
        count = len(heard)
        judge.may_answer.set()
        cell.ros.wait_until(lambda: len(heard) > count, 10.0, "the judgement")
        assert cell.move(joint_positions=HOME).success
    assert {tuple(packet.points[-1].positions) for packet in cell.setpoints} <= {HOME}
