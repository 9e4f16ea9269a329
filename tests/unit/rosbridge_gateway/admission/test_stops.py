"""Which packets stop a robot, and who drives one, as gateway.yaml ships it."""

from __future__ import annotations

import pytest
from harness.opponents.graph_and_clients import SHIPPED
from rosbridge_gateway.admission.stops import Drivers, StopRules
from rosbridge_gateway.protocol.packets import CallService, Packet, Publish, Subscribe

RULES = StopRules(SHIPPED.stops, "/cell")
COMMAND = "twin_controller/command"


@pytest.mark.parametrize(
    ("packet", "stops"),
    [
        (Publish(topic="motion_command", msg={"command": 1}), True),
        (Publish(topic="/cell/motion_command", msg={"command": 2, "id": 7}), True),
        (Publish(topic="motion_command", msg={"command": 4}), True),
        (Publish(topic="motion_command", msg={"command": 3}), False),
        (Publish(topic="motion_command", msg={}), False),
        (Publish(topic="motion_command", msg={"command": [1]}), False),
        (Publish(topic="/other/motion_command", msg={"command": 1}), False),
        (Publish(topic="no name", msg={"command": 1}), False),
        (CallService(service=COMMAND, args={"command": "STOP"}), True),
        (CallService(service=f"/cell/{COMMAND}", args=["ESTOP"]), True),
        (CallService(service=COMMAND, args={"command": "PAUSE"}), True),
        (CallService(service=COMMAND, args={"command": " stop "}), True),
        (CallService(service=COMMAND, args=["eStop"]), True),
        (CallService(service="twin_controller/stop"), True),
        (CallService(service="/cell/twin_controller/pause", args={}), True),
        (CallService(service="twin_controller/resume", args=[]), False),
        (CallService(service="/other/twin_controller/stop"), False),
        (CallService(service=COMMAND, args={"command": "RESUME"}), False),
        (CallService(service=COMMAND, args={"command": {"STOP": 1}}), False),
        (CallService(service=COMMAND, args=[]), False),
        (CallService(service=COMMAND), False),
        (CallService(service="move_to", args={"command": "STOP"}), False),
        (Subscribe(topic="motion_command"), False),
    ],
)
def test_packet_stops_a_robot(packet: Packet, stops: bool) -> None:
    """By the name of the topic or service in the gateway's namespace, and the command."""
    assert RULES.stops(packet) is stops


@pytest.mark.parametrize(
    ("role", "advertised", "drives"),
    [
        ("operator", ["/cell/joint_vel_controller/command"], True),
        ("operator", ["/t", "/cell/twin/joint_1_velocity_controller/command"], True),
        ("operator", ["/cell/twin/joint_2_position_controller/command"], True),
        ("operator", ["/cell/motion_command"], False),
        ("operator", [], False),
        ("twin_controller", [], True),
    ],
)
def test_who_publishes_what_moves_a_robot_drives(
    role: str, advertised: list[str], drives: bool
) -> None:
    """A STOP makes nobody a driver; the twin controller is one from the beginning."""
    assert Drivers(SHIPPED.driving, "/cell").drives(role, advertised) is drives
