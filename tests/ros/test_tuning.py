"""Tuning a running simulator.

By dynamic_reconfigure's own client, in the loop, in the file, and back.
"""

from __future__ import annotations

import pytest
from harness.yaml_files import copy_configuration, shipped

SHIPPED = shipped("pid_gains.yaml").read_text()


@pytest.fixture(scope="module")
def node(ros_module):
    """Start the simulator on a configuration of its own."""
    folder = copy_configuration(ros_module.folder / "config")
    ros_module.gains_file = folder / "pid_gains.yaml"
    ros_module.run("scara_simulation", "simulator", f"_config_dir:={folder}")
    ros_module.wait_for_service("twin/pid/undo")
    return ros_module


@pytest.fixture
def cell(node):
    """Give a simulator whose gains are the shipped ones."""
    from std_srvs.srv import Trigger

    undo = node.service("twin/pid/undo", Trigger)
    while undo().success:
        pass
    assert node.gains_file.read_text() == SHIPPED
    return node


@pytest.fixture
def client(cell):
    """Give the standard client of joint_1's server."""
    from dynamic_reconfigure.client import Client

    client = Client(cell.name("twin/pid/joint_1"), timeout=10.0)
    yield client
    client.close()


def status_with(cell, part):
    """Wait for the status text that holds ``part``; an older one may be on its way."""
    from std_msgs.msg import String

    return cell.wait_for_message(
        "twin/pid/status", String, such_that=lambda status: part in status.data
    ).data


def gains_in_the_loop(cell, wanted):
    """Wait until joint_1's controller reports the gains that ``wanted`` accepts."""
    from control_msgs.msg import JointControllerState

    return cell.wait_for_message(
        "twin/joint_1_position_controller/state", JointControllerState, such_that=wanted
    )


def test_change_takes_effect_in_loop_and_file_and_is_undone(cell, client):
    """One value changes in the file, comments and order stay.

    Undo restores the file to the letter.
    """
    from std_srvs.srv import Trigger

    answer = client.update_configuration({"position_p": 9000.0, "position_antiwindup": False})
    assert (answer["position_p"], answer["position_antiwindup"], answer["position_d"]) == (
        9000.0,
        False,
        276.2,
    )
    gains_in_the_loop(cell, lambda state: state.p == 9000.0 and not state.antiwindup)
    before = "  position: {p: 8285.0, i: 82850.0, d: 276.2, i_clamp: 1.5, antiwindup: true}"
    after = "  position: {p: 9000.0, i: 82850.0, d: 276.2, i_clamp: 1.5, antiwindup: false}"
    assert cell.gains_file.read_text() == SHIPPED.replace(before, after)
    undone = cell.service("twin/pid/undo", Trigger)()
    assert (
        undone.message
        == "undone and saved: joint_1: position_p 9000 -> 8285, position_antiwindup false -> true"
    )
    gains_in_the_loop(cell, lambda state: state.p == 8285.0 and state.antiwindup)
    assert cell.gains_file.read_text() == SHIPPED
    assert cell.service("twin/pid/undo", Trigger)().message.startswith("nothing to undo")


def test_client_is_told_names_types_and_ranges(cell, client):
    """What rqt_reconfigure draws its sliders from; the ranges are those that are taken."""
    descriptions = {
        entry["name"]: entry for entry in client.get_parameter_descriptions(timeout=10.0)
    }
    assert set(descriptions) == {
        f"{loop}_{key}"
        for loop in ("position", "velocity")
        for key in ("p", "i", "d", "i_clamp", "antiwindup")
    }
    assert descriptions["position_i_clamp"]["max"] == 300.0
    assert descriptions["position_antiwindup"]["type"] == "bool"
    highest = descriptions["position_p"]["max"]
    assert client.update_configuration({"position_p": highest})["position_p"] == highest


def test_refused_gain_changes_nothing_and_says_why(cell, client):
    """The answer holds the old value; loop and file stay, the reason is published."""
    assert client.update_configuration({"position_p": 1e9})["position_p"] == 8285.0
    status_with(cell, "joint_1 position_p = 1000000000 is outside [0, ")
    assert cell.gains_file.read_text() == SHIPPED


def test_gain_is_in_force_also_when_the_file_is_gone(cell, client):
    """The loop is tuned, and an error says that it is not saved."""
    kept = cell.gains_file.with_suffix(".kept")
    cell.gains_file.rename(kept)
    try:
        assert client.update_configuration({"position_p": 9100.0})["position_p"] == 9100.0
        gains_in_the_loop(cell, lambda state: state.p == 9100.0)
        text = status_with(cell, "but not saved: joint_1: position_p 8285 -> 9100")
        assert "pid_gains.yaml: cannot be read" in text
    finally:
        kept.rename(cell.gains_file)


def test_unstable_gains_in_the_file_end_the_simulator_with_code_2(ros):
    """One line names file, joint, gain, value and range."""
    copy_configuration(ros.folder)
    file = ros.folder / "pid_gains.yaml"
    file.write_text(SHIPPED.replace("p: 8285.0", "p: 8285000.0"))
    node = ros.run("scara_simulation", "simulator", f"_config_dir:={ros.folder}")
    assert node.wait(20.0) == 2
    assert f"{file}: joint_1 position_p = 8285000 is outside [0, " in node.output
    assert "Traceback" not in node.output
