"""What was predicted is kept beside what happened, for moves that a gate let through."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from harness.ros import Ros
from harness.yaml_files import changed_yaml, copy_configuration, shipped

NAMES = ["joint_1", "joint_2", "joint_3", "table_joint"]
HOME, THERE = (0.0, 0.0, -0.16, 0.0), (0.4, -0.3, -0.1, 0.2)
SLOWER = 1.5
PERIOD_S = 0.01


class Robot:
    """Joint states of both sides, played by the test on the clock of the cell."""

    def __init__(self, ros: Ros) -> None:
        """Advertise, and stand at home."""
        import rospy
        from sensor_msgs.msg import JointState

        self.joints = [
            rospy.Publisher(ros.name(f"{side}/joint_states"), JointState, queue_size=10)
            for side in ("real", "twin")
        ]
        self._now, self._timer = HOME, None
        self._stand = rospy.Timer(rospy.Duration(PERIOD_S), lambda _: self.say())

    def say(self) -> None:
        """Tell where the joints are."""
        import rospy
        from sensor_msgs.msg import JointState

        for publisher in self.joints:
            message = JointState(name=NAMES, position=self._now, effort=[10.0, 0.0, 0.0, 0.0])
            message.header.stamp = rospy.get_rostime()
            publisher.publish(message)

    def move(self, target: tuple[float, ...], duration: float) -> None:
        """Go to a target along a smooth curve."""
        import rospy

        begin, start = rospy.get_time(), np.array(self._now)
        while (share := (rospy.get_time() - begin) / duration) < 1.0:
            smooth = share * share * (3.0 - 2.0 * share)
            self._now = tuple((start + smooth * (np.array(target) - start)).tolist())
            rospy.sleep(PERIOD_S)
        self._now = target

    def close(self) -> None:
        """Fall silent."""
        self._stand.shutdown()


def test_slow_robot_is_told_with_both_times_and_in_the_end_an_alarm(
    ros: Ros, tmp_path: Path
) -> None:
    """Two moves that take half as long again: each is told, the second raises the alarm."""
    from diagnostic_msgs.msg import DiagnosticArray

    from scara_msgs.msg import Audit, MotionOutcome
    from scara_msgs.srv import JudgeMotion

    config = copy_configuration(tmp_path)
    changed_yaml(shipped("what_if.yaml"), config, ["learning", "motions"], 2)
    robot = Robot(ros)
    ros.run("what_if", "what_if", f"_config_dir:={config}")
    judge = ros.service("what_if/judge", JudgeMotion)
    gate = ros.publisher("what_if/gate", Audit, subscribers=1)
    outcomes = ros.collect("what_if/outcomes", MotionOutcome)
    told = ros.collect("/diagnostics", DiagnosticArray)

    def alarms() -> list[str]:
        return [
            status.message
            for array in told
            for status in array.status
            if status.name.endswith("what_if: predictions") and status.level > 0
        ]

    for number, target in enumerate((THERE, HOME), 1):
        answer = judge(motion="MOVE_JOINTS", joint_positions=target, speed_percent=40.0)
        assert answer.success and answer.verdict == "OK", answer.message
        gate.publish(Audit(who="test", what="MOVE_JOINTS", success=True, outcome=answer.message))
        robot.move(target, SLOWER * answer.duration)
        ros.wait_until(lambda n=number: len(outcomes) == n, 20.0, "an outcome")  # type: ignore[misc]
    found = outcomes[-1]
    assert (found.what, found.end) == ("MOVE_JOINTS", MotionOutcome.REACHED)
    assert found.way_measured == pytest.approx(found.way_predicted, rel=0.1)
    assert found.time_measured > 1.1 * found.time_predicted
    assert found.joint == NAMES and max(found.effort_measured) > 0.0
    assert found.drift.startswith("moving time of the last 2 motions is +")
    ros.wait_until(lambda: alarms(), 10.0, "the alarm")
    assert "allowed 5 %" in alarms()[-1]

    # What is only asked, and not let through, is not watched.
    judge(motion="MOVE_JOINTS", joint_positions=THERE)
    robot.move(THERE, 1.0)
    answer = judge(motion="MOVE_JOINTS", joint_positions=HOME)
    gate.publish(Audit(who="test", what="back", success=True, outcome=answer.message))
    robot.move(HOME, 1.0)
    ros.wait_until(lambda: len(outcomes) == 3, 20.0, "an outcome")
    assert outcomes[-1].what == "back"
    robot.close()
