"""What lives in the ROS graph stays what it is, whatever a client of the gateway offers."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
import rospy
import websocket
from harness.ros import Ros
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse

from scara_msgs.msg import Audit, TwinControllerState
from scara_msgs.srv import TwinCommand

DEADLINE = 20.0


class Cell:
    """A gateway, and a twin controller that has no robot."""

    def __init__(self, ros: Ros) -> None:
        self.ros = ros
        self.port = ros.free_port()
        home = {"HOME": str(ros.folder)}
        self.gateway = ros.run("rosbridge_gateway", "gateway", f"_port:={self.port}", env=home)
        ros.wait_until(
            lambda: f"on 127.0.0.1:{self.port}" in self.gateway.output, DEADLINE, "the port"
        )
        self.told = ros.collect("twin_controller/audit", Audit)
        ends = (f"_gateway_url:=ws://127.0.0.1:{self.port}", f"_modbus_port:={ros.free_port()}")
        self.controller = ros.run("twin_controller", "twin_controller", *ends, env=home)
        ros.wait_for_service("twin_controller/command")
        ros.wait_until(
            lambda: "link twin: connected" in self.controller.output, DEADLINE, "the link"
        )

    def answer(self, **packet: Any) -> dict[str, Any]:
        """Send a packet as an operator's program, wait for the answer, and leave.

        What is granted has no answer: then the time comes, which is asked for next.
        """
        url = f"ws://127.0.0.1:{self.port}"
        line = websocket.create_connection(url, timeout=DEADLINE, suppress_origin=True)
        line.send(json.dumps(packet))
        line.send(json.dumps({"op": "call_service", "id": "time", "service": "/rosapi/get_time"}))
        found: dict[str, Any] = json.loads(line.recv())
        line.close()
        return found


@pytest.fixture(scope="module")
def cell(ros_module: Ros) -> Iterator[Cell]:
    """Start both nodes once."""
    yield Cell(ros_module)


def test_service_of_the_twin_controller_stays_its_own(cell: Cell) -> None:
    """The next STOP goes to the twin controller, during the attempt and after it."""
    name = cell.ros.name("twin_controller/command")
    answer = cell.answer(op="advertise_service", service=name, type="scara_msgs/TwinCommand")
    assert answer["msg"] == f"{name} is offered by the cell's own nodes only"
    command = cell.ros.service("twin_controller/command", TwinCommand)
    assert "the client that answers" not in command(command="STOP").message

    def told() -> list[Audit]:
        return [e for e in cell.told if e.outcome == answer["msg"] and not e.success]

    cell.ros.wait_until(told, DEADLINE, "an entry of the audit")


def test_living_service_of_any_node_is_untouched(cell: Cell) -> None:
    """No list names it: the ROS master does."""
    name = cell.ros.name("lamp")
    living = rospy.Service(name, Trigger, lambda _: TriggerResponse(True, "living"))
    answer = cell.answer(op="advertise_service", service=name, type="std_srvs/Trigger")
    assert answer["msg"] == f"{name} is offered by {rospy.get_name()} already"
    assert cell.ros.service("lamp", Trigger)().message == "living"
    living.shutdown()


def test_topic_of_a_living_node_is_its_own(cell: Cell) -> None:
    """Listed or not; when the node has gone, the name is free."""
    name = cell.ros.name("measured")
    publisher = rospy.Publisher(name, String, queue_size=1)
    packet = {"op": "advertise", "topic": name, "type": "std_msgs/String", "id": "a"}
    assert cell.answer(**packet)["msg"] == f"{name} is published by {rospy.get_name()} already"
    publisher.unregister()
    assert cell.answer(**packet)["id"] == "time"


def test_nobody_publishes_the_twin_controllers_state_over_the_gateway(cell: Cell) -> None:
    """What a page or a recorder shows as its mode is its own."""
    states = cell.ros.collect("twin_controller/state", TwinControllerState)
    name = cell.ros.name("twin_controller/state")
    answer = cell.answer(op="publish", topic=name, msg={"mode": "FORGED"})
    assert answer["msg"] == f"{name} is published by the cell's own nodes only"
    cell.ros.wait_until(lambda: len(states) > 3, DEADLINE, "states")
    assert all(state.mode != "FORGED" for state in states)


def test_twin_controller_is_known_by_its_own_token(cell: Cell) -> None:
    """It finds the token where the gateway has put it, and all it wants is granted."""
    assert "came as twin_controller" in cell.gateway.output
    file = cell.ros.folder / ".ros" / "twin_controller_token"
    token = file.read_text(encoding="ascii").strip()
    assert file.stat().st_mode & 0o777 == 0o600 and len(token) >= 32
    assert token not in cell.gateway.output + cell.controller.output
    assert "the twin's gateway says" not in cell.controller.output


def test_token_on_the_command_line_ends_the_gateway(ros: Ros) -> None:
    """``ps`` and the parameter server show it to everybody; exit code 2 and what to do instead."""
    node = ros.run("rosbridge_gateway", "gateway", "_token:=spoken-aloud", "__name:=loud")
    assert node.wait(DEADLINE) == 2
    assert "~token: the command line and the parameter server show it" in node.output
    assert "spoken-aloud" not in node.output and "Traceback" not in node.output
    assert not rospy.has_param(ros.name("loud/token"))


def test_two_roles_with_one_token_end_the_gateway(ros: Ros) -> None:
    """Which role it gives would be a matter of luck."""
    env = {"SCARA_VIEWER_TOKEN": "same-one", "SCARA_OPERATOR_TOKEN": "same-one"}
    node = ros.run("rosbridge_gateway", "gateway", env=env)
    assert node.wait(DEADLINE) == 2
    assert "roles viewer and operator have the same token: give each its own" in node.output
    assert "same-one" not in node.output
