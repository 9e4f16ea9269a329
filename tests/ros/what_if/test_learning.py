"""What was predicted is kept beside what happened, for moves that a gate let through."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.ros import Ros
from harness.second_world.played_robot import HOME, NAMES, PlayedRobot
from harness.yaml_files import changed_yaml, copy_configuration, shipped

THERE = (0.4, -0.3, -0.1, 0.2)
SLOWER = 1.5


def test_slow_robot_is_told_with_both_times_and_in_the_end_an_alarm(
    ros: Ros, tmp_path: Path
) -> None:
    """Two moves that take half as long again: each is told, the second raises the alarm."""
    from diagnostic_msgs.msg import DiagnosticArray
    from rosgraph_msgs.msg import Log

    from scara_msgs.msg import Audit, MotionOutcome
    from scara_msgs.srv import JudgeMotion

    config = copy_configuration(tmp_path)
    changed_yaml(shipped("what_if.yaml"), config, ["learning", "motions"], 2)
    robot = PlayedRobot(ros)
    ros.run("what_if", "what_if", f"_config_dir:={config}")
    judge = ros.service("what_if/judge", JudgeMotion)
    gate = ros.publisher("what_if/gate", Audit, subscribers=1)
    outcomes = ros.collect("what_if/outcomes", MotionOutcome)
    told = ros.collect("/diagnostics", DiagnosticArray)
    logs = ros.collect("/rosout", Log)

    def unheard() -> int:
        return sum("are of its middle" in log.msg for log in logs)

    def alarms() -> list[str]:
        return [
            status.message
            for array in told
            for status in array.status
            if status.name.endswith("what_if: predictions") and status.level > 0
        ]

    here = HOME
    while len(outcomes) < 2:
        target = HOME if here is THERE else THERE
        answer = judge(motion="MOVE_JOINTS", joint_positions=target, speed_percent=40.0)
        assert answer.success and answer.verdict == "OK", answer.message
        gate.publish(Audit(who="test", what="MOVE_JOINTS", success=True, outcome=answer.message))
        ends = len(outcomes) + unheard()
        robot.move(target, SLOWER * answer.duration)
        # A node that stood while the joints left their place says so, and learns nothing.
        ros.wait_until(lambda n=ends: len(outcomes) + unheard() > n, 20.0, "an outcome")  # type: ignore[misc]
        here = target
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
