"""What lives in the ROS graph stays what it is, and whoever commands is named in the audit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import rospy
from harness.opponents.running_gateway import RunningGateway
from harness.ros import Ros
from harness.wires.gateway_client import connect
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse

from scara_msgs.msg import Audit
from scara_msgs.srv import TwinCommand

DEADLINE = 20.0


class Cell(RunningGateway):
    """A gateway, and a twin controller that has no robot."""

    def __init__(self, ros: Ros) -> None:
        home = {"HOME": str(ros.folder)}
        super().__init__(ros, env=home)
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
        with connect(self.port) as client:
            client.say(**packet)
            return client.time()

    def audited(self, such_that: Callable[[Audit], bool]) -> Audit:
        """Return the first entry of the audit for which ``such_that`` is true."""

        def find() -> list[Audit]:
            return [entry for entry in list(self.told) if such_that(entry)][:1]

        return self.ros.wait_until(find, DEADLINE, f"an entry among {len(self.told)}")[0]


@pytest.fixture(scope="module")
def cell(ros_module: Ros) -> Cell:
    """Start both nodes once."""
    return Cell(ros_module)


def test_service_of_the_twin_controller_stays_its_own(cell: Cell) -> None:
    """The next STOP goes to the twin controller, during the attempt and after it."""
    name = cell.ros.name("twin_controller/command")
    answer = cell.answer(op="advertise_service", service=name, type="scara_msgs/TwinCommand")
    assert answer["msg"] == f"{name} is offered by the cell's own nodes only"
    command = cell.ros.service("twin_controller/command", TwinCommand)
    assert "the client that answers" not in command(command="STOP").message
    cell.audited(lambda entry: entry.outcome == answer["msg"] and not entry.success)


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


def test_twin_controller_is_known_by_its_own_token(cell: Cell) -> None:
    """It finds the token where the gateway has put it, and all it wants is granted."""
    assert "came as twin_controller" in cell.node.output
    file = cell.ros.folder / ".ros" / "twin_controller_token"
    token = file.read_text(encoding="ascii").strip()
    assert file.stat().st_mode & 0o777 == 0o600 and len(token) >= 32
    assert token not in cell.node.output + cell.controller.output
    assert "the twin's gateway says" not in cell.controller.output


def test_command_of_a_console_is_told_with_its_node(cell: Cell) -> None:
    """``rosservice`` is a node with a name of its own."""
    name = cell.ros.name("twin_controller/command")
    cell.ros.shell("rosservice", "call", name, "{command: PAUSE}")
    entry = cell.audited(lambda entry: entry.what.startswith("PAUSE "))
    assert "rosservice" in entry.who and entry.outcome


def test_command_over_the_web_socket_is_told_with_role_and_address(cell: Cell) -> None:
    """The gateway's own name would say nothing about who it was."""
    with connect(cell.port) as client:
        address = ":".join(map(str, client.line.sock.getsockname()))
        client.call(cell.ros.name("twin_controller/command"), {"command": "RESUME"})
        entry = cell.audited(lambda entry: entry.what.startswith("RESUME "))
    assert entry.who == f"{cell.ros.name('gateway')}/operator@{address}" and entry.outcome


def test_what_a_client_publishes_and_what_is_refused_is_told(cell: Cell) -> None:
    """The twin controller knows nothing of what goes to the twin or is not let through."""
    name = cell.ros.name("motion_command")
    for token, role, outcome in (
        ("drive", "operator", ""),
        ("look", "viewer", f"role viewer may not publish {name}"),
    ):
        with connect(cell.port, header=[f"Authorization: Bearer {token}"]) as client:
            address = ":".join(map(str, client.line.sock.getsockname()))
            client.say(op="publish", topic=name, msg={"command": 1})
            entry = cell.audited(lambda entry, at=address: entry.who.endswith(at))
        assert entry.who == f"{cell.ros.name('gateway')}/{role}@{address}"
        assert (entry.what.split()[:2], entry.success) == (["publish", name], not outcome)
        assert outcome in entry.outcome


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
