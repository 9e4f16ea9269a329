"""The gate of the motion nodes with a real judge: refused motions never reach the wire."""

from __future__ import annotations

import io
import signal
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest
from harness.ros import Ros
from harness.running.thorough import thorough
from harness.second_world.gated_nodes import FREE, HOME, GatedNodes, refused_targets
from PIL import Image
from what_if.showing.moment_picture_io import WIDTH


@pytest.fixture(scope="module")
def cell(ros_module: Ros, tmp_path_factory: pytest.TempPathFactory) -> Iterator[GatedNodes]:
    """Give one cell to all tests of this module."""
    yield GatedNodes(ros_module, tmp_path_factory.mktemp("config"))


def forget_setpoints(cell: GatedNodes) -> None:
    """Begin without set points: the last one of a move may come behind its answer."""
    cell.ros.wait_until(
        lambda: not cell.setpoints or len(cell.setpoints[-1].points) == 1, 5.0, "the last set point"
    )
    time.sleep(0.1)
    cell.setpoints.clear()


@pytest.mark.parametrize("count", [10, *thorough(1000)])
def test_refused_commands_send_no_set_point_and_say_why(cell: GatedNodes, count: int) -> None:
    """Half by the service, half as goals. Then one that is free does move."""
    cell.told.clear()
    forget_setpoints(cell)
    wrong, judged = cell.refuse(refused_targets(count))
    assert wrong == [] and judged > count / 2
    assert cell.setpoints == []
    assert max(abs(a - b) for a, b in zip(sorted(cell.joints[-1].position), sorted(HOME))) < 1e-3

    def refused() -> int:
        # What the gates told of a move before this may come late.
        return sum(not said.success for said in cell.told)

    cell.ros.wait_until(lambda: refused() == judged, 10.0, "what the gates tell")
    answer = cell.move(joint_positions=FREE)
    assert answer.success, answer.message
    assert cell.setpoints
    assert cell.told[-1].success and cell.told[-1].outcome.startswith("OK")
    assert cell.move(joint_positions=HOME).success


def test_a_judge_that_was_resting_knows_where_the_twin_stands_now(cell: GatedNodes) -> None:
    """It hears a hundred joint states a second and reads few of them until it is asked."""
    from scara_msgs.srv import JudgeMotion

    judge = cell.ros.service("what_if/judge", JudgeMotion)
    for target in (FREE, HOME, FREE, HOME):
        assert cell.move(joint_positions=target).success
        there = judge(motion="MOVE_JOINTS", joint_positions=target)
        back = judge(motion="MOVE_JOINTS", joint_positions=FREE if target == HOME else HOME)
        assert there.success and back.success
        assert there.duration < 0.1 < back.duration


def test_judge_answers_all_figures_and_a_picture_of_the_worst_moment(cell: GatedNodes) -> None:
    """Of a move into a part: when, where, between what; the picture only where it is asked for."""
    from scara_msgs.srv import JudgeMotion

    judge = cell.ros.service("what_if/judge", JudgeMotion)
    # Over one part only: where two are met at once, the last bit of a joint says which is named.
    into = {"motion": "MOVE", "x": 0.55, "y": 0.05, "z": -0.02}
    told = judge(**into, picture=True)
    assert (told.verdict, told.cause) == ("REFUSED", "collision"), told.message
    picture = Image.open(io.BytesIO(told.picture))
    assert (picture.format, picture.width) == ("PNG", 2 * WIDTH)
    assert told.picture_time == told.time
    assert told.place.z < 0.0 and told.clearance_between[1].startswith("part_")
    shares = (told.speed_used_percent, told.acceleration_used_percent, told.effort_used_percent)
    assert all(len(share) == len(told.joint) and max(share) > 0.0 for share in shares)
    assert told.duration > 0.0 and told.energy > 0.0 and told.tool_speed > 0.0
    plain = judge(**into)
    assert plain.picture == b"" and plain.message == told.message
    far = judge(motion="MOVE", x=0.9, picture=True)
    assert far.cause == "reach" and far.picture == b""
    carried = judge(motion="PROGRAM", program="PALLETISE")
    assert len(carried.placed) == 9 and not carried.dropped and not carried.zones


def test_without_a_judge_it_moves_and_that_is_told(cell: GatedNodes) -> None:
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


def test_a_stop_does_not_wait_for_the_judge(cell: GatedNodes) -> None:
    """A move that is being judged is ended by STOP and never begins, although it is judged OK."""
    forget_setpoints(cell)
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


def test_a_goal_is_cancelled_while_it_is_judged(cell: GatedNodes) -> None:
    """The action's own lock is free meanwhile, and the goal never begins."""
    import rospy

    from scara_msgs.msg import Audit

    forget_setpoints(cell)
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
