"""PAYLOAD[n] over ROS: set, mounted, read, refused, and planned for."""

from __future__ import annotations

import pytest

HARD = ((-1.64, -2.3, -0.1, 0.0), (1.64, 2.3, -0.1, 0.0))
JOINT_1_EFFORT = 300.0


@pytest.fixture(scope="module")
def cell(ros_module):
    """Start the simulator and the node that plans."""
    ros_module.run("scara_simulation", "simulator")
    ros_module.run("scara_control", "joint_pose_controller")
    for name in ("twin/payload/set", "joint_pose_controller/move"):
        ros_module.wait_for_service(name)
    return ros_module


def ask(ros, name, **fields):
    """Call ``twin/payload/set`` or ``mount``."""
    from scara_msgs.srv import SetPayload

    return ros.service(f"twin/payload/{name}", SetPayload)(**fields)


def state_such_that(ros, condition):
    """Wait for the payload's state."""
    from scara_msgs.msg import PayloadState

    return ros.wait_for_message("twin/payload", PayloadState, such_that=condition)


def diagnosis_such_that(ros, condition):
    """Wait for what the diagnostics say of the payload."""
    from diagnostic_msgs.msg import DiagnosticArray

    def mine(message):
        return [s for s in message.status if s.name.endswith("simulator: payload") and condition(s)]

    return mine(ros.wait_for_message("/diagnostics", DiagnosticArray, such_that=mine))[0]


def move(ros, positions):
    """Move all joints at full speed."""
    from scara_msgs.srv import MoveJoints

    return ros.service("joint_pose_controller/move", MoveJoints)([], positions, 100.0)


def test_rated_payload_is_set_mounted_told_and_moved_inside_the_efforts(cell):
    """Set and mount PAYLOAD[4]; the state follows; a move at full speed keeps joint 1's effort."""
    from sensor_msgs.msg import JointState

    from scara_msgs.srv import ListPayloads

    first = state_such_that(cell, lambda state: True)
    assert (first.told.name, first.mounted.name, first.holding) == ("empty", "empty", False)
    assert list(first.acceleration_percent) == pytest.approx([100.0] * 4)
    assert move(cell, HARD[0]).success
    for name, level in (("set", 1), ("mount", 0)):
        answer = ask(cell, name, number=4)
        assert answer.success, answer.message
        status = diagnosis_such_that(cell, lambda s, wanted=level: s.level == wanted)
        assert ("mounted is PAYLOAD[1] empty" in status.message) == (level == 1)
    state = state_such_that(cell, lambda s: s.told.number == 4 and s.mounted.number == 4)
    assert (state.told.mass, state.told.centre.z) == (6.0, 0.04)
    assert state.name[0] == "joint_1" and 50.0 < state.acceleration_percent[0] < 95.0
    listed = cell.service("twin/payload/list", ListPayloads)()
    assert (listed.rated, listed.told, listed.mounted) == (6.0, 4, 4)
    assert [payload.name for payload in listed.payloads] == ["empty", "part", "half", "rated"]
    efforts = cell.collect("twin/joint_states", JointState)
    assert move(cell, HARD[1]).success
    most = max(abs(state.effort[0]) for state in efforts)
    assert 0.5 * JOINT_1_EFFORT < most < JOINT_1_EFFORT


def test_what_cannot_be_is_refused_with_the_reason(cell):
    """Unknown, too heavy, or a joint moves; what was told before stays."""
    from std_msgs.msg import Float64

    assert ask(cell, "set", number=1).success
    refused = [
        (ask(cell, "set", number=9), "number = 9: is no payload of the table, which has 1 (empty)"),
        (ask(cell, "set", number=2, change=True, mass=6.5), "mass_kg = 6.5: is outside [0, 6] kg"),
        (ask(cell, "mount", number=2, change=True, mass=float("nan")), "not finite"),
    ]
    cell.publisher("twin/table_joint_position_controller/command", Float64).publish(Float64(2.0))
    from sensor_msgs.msg import JointState

    cell.wait_for_message("twin/joint_states", JointState, such_that=lambda s: s.velocity[3] > 0.5)
    refused.append((ask(cell, "set", number=3), "table_joint moves: a payload is changed only at"))
    for answer, text in refused:
        assert not answer.success and text in answer.message, answer.message
    assert state_such_that(cell, lambda state: True).told.number == 1
