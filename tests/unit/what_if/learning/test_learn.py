"""``rosrun what_if learn``: from a recorded program to the numbers of what_if.yaml."""

from __future__ import annotations

from pathlib import Path

import pytest
import rosbag
import rospy
from harness.second_world.cycles import run
from harness.yaml_files import copy_configuration
from sensor_msgs.msg import JointState
from typer.testing import CliRunner
from what_if.config import load_what_if
from what_if.learning.learn_node import app
from what_if.world import World

from scara_msgs.msg import RobotData, TwinControllerState

BEGIN = 1.7e9


def record(path: Path, world: World, overrides: list[int], paused: bool = False) -> Path:
    """Write what a cell records while the field plant runs TWO_POINT."""
    took, seen = run(world, "TWO_POINT", "field", overrides[0] or 100)
    names = [joint.name for joint in world.cell.robot.twin_joints]
    with rosbag.Bag(str(path), "w") as bag:

        def put(topic: str, message: object, at: float) -> None:
            message.header.stamp = rospy.Time.from_sec(BEGIN + at)  # type: ignore[attr-defined]
            bag.write(topic, message, message.header.stamp)  # type: ignore[attr-defined]

        put("/real/joint_states", JointState(name=names, position=world.q), -0.1)
        for k, override in enumerate(overrides):
            state = TwinControllerState(real_override_percent=override)
            put("/twin_controller/state", state, -0.1 + k * 0.5 * took)
        for number, (line, at) in enumerate(seen):
            if paused and number == 2:
                put("/real/robot_data", RobotData(program=f"TWO_POINT line {line} paused"), at)
                continue
            shown = f"TWO_POINT line {line} running"
            put(
                "/real/robot_data",
                RobotData(control_type="program", running=True, program=shown),
                at,
            )
        put("/real/robot_data", RobotData(program="TWO_POINT line 1 aborted"), took)
    return path


def learn(*words: object) -> tuple[int, str]:
    """Run the command; return its exit code and all that it wrote."""
    done = CliRunner().invoke(app, [str(word) for word in words])
    return done.exit_code, done.output


def test_a_recorded_program_teaches_the_rest_at_fine(world: World, tmp_path: Path) -> None:
    """It is proposed, and written only on request; comments stay."""
    folder = copy_configuration(tmp_path / "config")
    bag = record(tmp_path / "run.bag", world, [50])
    code, text = learn(bag, "--config-dir", folder)
    assert code == 0 and "4 moves with FINE (4 of TWO_POINT)" in text, text
    assert "nothing was written" in text and not load_what_if(folder).program.fitted
    code, text = learn(bag, "--config-dir", folder, "--write")
    found = load_what_if(folder).program
    assert code == 0 and found.fitted
    assert 65.0 < found.fine_ms < 80.0 and found.fine_spread_ms < 8.0
    assert "# [chk] from the end of a move's plan" in (folder / "what_if.yaml").read_text()


@pytest.mark.parametrize("overrides", [[50, 80], [0]], ids=["changed", "unknown"])
def test_a_program_at_no_one_override_is_left_out(
    world: World, tmp_path: Path, overrides: list[int]
) -> None:
    """Nobody knows what its moves would have taken."""
    code, text = learn(record(tmp_path / "run.bag", world, overrides))
    assert code == 3 and "0 moves with FINE were seen whole: 3 are needed" in text


def test_a_line_with_a_pause_in_it_is_left_out(world: World, tmp_path: Path) -> None:
    """The lines after it count again."""
    code, text = learn(record(tmp_path / "run.bag", world, [50], paused=True))
    assert code == 0 and "3 moves with FINE (3 of TWO_POINT)" in text


def test_a_bag_without_what_is_needed_is_refused(tmp_path: Path) -> None:
    """With the names of what is missing."""
    with rosbag.Bag(str(tmp_path / "run.bag"), "w") as bag:
        bag.write("/real/joint_states", JointState(), rospy.Time(1))
    code, text = learn(tmp_path / "run.bag")
    assert code == 3 and "holds no message of real/robot_data, twin_controller/state" in text
