"""Command ``step_response`` on a running simulator, and where it must not.

Without one: tests/unit/twin_experiments/test_exit_codes.py.
"""

from __future__ import annotations

import itertools
import json

import pytest


@pytest.fixture(scope="module")
def ros(ros_module):
    """Start a simulator for all tests."""
    ros_module.run("scara_simulation", "simulator")
    ros_module.wait_for_service("reset_simulation")
    return ros_module


def run(ros, *args, code=0, timeout=60.0):
    """Run the command to its end and return what it printed."""
    command = ros.run("twin_analysis", "step_response", *args)
    assert command.wait(timeout) == code, command.output
    return command.output


def test_steps_on_the_running_simulator_are_judged_and_drawn(ros):
    """Both directions at the physics rate, through command and state topics.

    The joint ends where it began.
    """
    from sensor_msgs.msg import JointState

    folder = ros.folder / "steps"
    output = run(ros, "joint_2", "--output", folder, "--seconds", "0.8")
    assert "on the simulator at" in output
    document = json.loads((folder / "step_joint_2.json").read_text())
    assert (document["simulator"], document["verdict"]) == ("live", "pass")
    assert document["gains"]["p"] > 0.0
    assert [row["target"] - row["start"] for row in document["steps"]] == pytest.approx(
        [5.0, -5.0], abs=0.01
    )
    assert (folder / "step_joint_2_up.png").is_file() and (
        folder / "step_joint_2_down.png"
    ).is_file()
    state = ros.wait_for_message("twin/joint_states", JointState)
    assert state.position[1] == pytest.approx(0.0, abs=1e-4)


def test_state_comes_for_each_physics_step_while_somebody_listens(ros):
    """Every millisecond of nominal time; only a stall of the machine may be skipped."""
    from control_msgs.msg import JointControllerState

    states = ros.collect("twin/joint_3_position_controller/state_each_step", JointControllerState)
    ros.wait_until(lambda: len(states) >= 300, 20.0, "300 states")
    stamps = [state.header.stamp.to_nsec() for state in states[:300]]
    steps = [later - earlier for earlier, later in itertools.pairwise(stamps)]
    assert steps.count(1_000_000) >= 295
    assert min(steps) > 0


def test_command_refuses_to_move_the_real_robot_along(ros):
    """With a twin controller on the same master the robot would follow."""
    import rospy

    from scara_msgs.msg import TwinControllerState

    publisher = rospy.Publisher(
        ros.name("twin_controller/state"), TwinControllerState, queue_size=1
    )
    try:
        assert "the real robot would follow each step; add --with-robot" in run(
            ros, "joint_1", "--output", ros.folder, code=3
        )
    finally:
        publisher.unregister()
