"""The kinematics services over ROS: every request gets an answer, a refusal says why."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from harness.ros import Ros

from scara_msgs.srv import (
    ForwardKinematics,
    InverseKinematics,
    InverseVelocityKinematics,
    VelocityKinematics,
)

SERVICES = {
    "forward_kinematics": ForwardKinematics,
    "inverse_kinematics": InverseKinematics,
    "velocity_kinematics": VelocityKinematics,
    "inverse_velocity_kinematics": InverseVelocityKinematics,
}


@pytest.fixture(scope="module")
def call(ros_module: Ros) -> Callable[..., Any]:
    """Start the node once; return ``call(service, **fields)``."""
    ros_module.run("scara_control", "kinematics_server")
    proxies = {name: ros_module.service(name, kind) for name, kind in SERVICES.items()}
    return lambda name, **fields: proxies[name](**fields)


def test_forward_kinematics_of_the_real_controllers_reading(call):
    """Within the rounding of its joints, z and R to the digit."""
    q = [math.radians(19.62), math.radians(79.60), -0.01817, math.radians(-98.26)]
    answer = call("forward_kinematics", joint_positions=q)
    assert answer.success and answer.message == "" and answer.elbow == "righty"
    assert (answer.x, answer.y) == pytest.approx((0.28158, 0.41366), abs=7e-5)
    assert answer.z == pytest.approx(0.14183, abs=1e-12)
    # Home: a half turn about (1, -1, 0) / sqrt(2); the tool turned by R about z adds R / 2 to the
    # axis' angle.
    angle = 2.0 * math.atan2(answer.orientation.y, answer.orientation.x) + math.pi / 2.0
    assert round(math.degrees(angle), 2) == 0.96
    assert answer.yaw == pytest.approx(angle, abs=1e-12)
    assert (answer.orientation.z, answer.orientation.w) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_inverse_kinematics_answers_the_chosen_and_both_branches(call):
    """P2 of the article."""
    answer = call("inverse_kinematics", x=0.51, y=0.16, z=0.10)
    assert answer.success and answer.elbow == "righty"
    assert answer.joint_positions == answer.righty
    assert [math.degrees(value) for value in answer.righty[:2]] == pytest.approx(
        [-14.3218, 69.6], abs=1e-4
    )
    assert [math.degrees(value) for value in answer.lefty[:2]] == pytest.approx(
        [49.1577, -69.6], abs=1e-4
    )
    near = call("inverse_kinematics", x=0.51, y=0.16, z=0.10, seed=[0.8, -1.0, 0.0])
    assert near.elbow == "lefty" and near.joint_positions == answer.lefty


def test_velocities_go_there_and_back(call):
    """Both velocity services at one pose."""
    q = [0.2, 1.1, -0.1]
    there = call("velocity_kinematics", joint_positions=q, joint_velocities=[1.0, -2.0, 0.3])
    assert there.success and there.twist.angular.z == pytest.approx(-1.0)
    back = call("inverse_velocity_kinematics", joint_positions=q, linear=there.twist.linear)
    assert back.success and not back.damped
    assert back.joint_velocities == pytest.approx((1.0, -2.0, 0.3))
    assert back.manipulability == pytest.approx(0.35 * 0.3 * math.sin(1.1))


@pytest.mark.parametrize(
    ("service", "fields", "text"),
    [
        ("forward_kinematics", {"joint_positions": []}, "got 0 joint values, expected 3: joint_1"),
        ("inverse_kinematics", {"x": 0.5, "z": 0.3}, "joint_3 = 0.14 m is outside [-0.21, 0]"),
        ("inverse_kinematics", {"x": 0.5, "elbow": "left"}, "elbow = 'left' is neither righty nor"),
        (
            "inverse_kinematics",
            {"x": 0.5, "seed": [0.0]},
            "got 1 joint values, expected 3: joint_1",
        ),
        (
            "inverse_kinematics",
            {"x": 0.5, "has_yaw": True},
            "yaw: this arm has no joint that turns",
        ),
        (
            "inverse_velocity_kinematics",
            {"joint_positions": [0.0, 1.0, 0.0], "yaw_rate": 0.1},
            "yaw_rate: this arm has no joint that turns its tool",
        ),
        (
            "velocity_kinematics",
            {"joint_positions": [0.0] * 3, "joint_velocities": [8.0, 0.0, 0.0]},
            "joint_1 = 8 rad/s is outside [-7.679, 7.679]",
        ),
    ],
)
def test_refusal_is_an_answer_with_joint_value_and_range(call, service, fields, text):
    """No exception reaches the caller; what else is refused is in unit/scara_control/kinematics."""
    answer = call(service, **fields)
    assert not answer.success
    assert text in answer.message


def test_sigterm_ends_the_node_cleanly(ros):
    """No traceback on the way out."""
    node = ros.run("scara_control", "kinematics_server")
    ros.wait_for_service("inverse_velocity_kinematics")
    assert node.stop() == 0
    assert "Traceback" not in node.output
