"""Topics and rights between real ROS nodes and real web-socket clients."""

from __future__ import annotations

import math
import re
import signal
import time
from typing import Any

import pytest
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from harness.opponents.running_gateway import DEADLINE, RunningGateway
from std_msgs.msg import Float64, String

from scara_msgs.msg import MotionCommand


def test_not_a_number_crosses_both_ways(gateway: RunningGateway) -> None:
    """NaN in ROS, null on the wire."""
    client = gateway.client()
    client.subscribe("out", "std_msgs/Float64")
    gateway.ros.publisher("out", Float64).publish(math.nan)
    assert client.hear("publish") == {"op": "publish", "topic": "out", "msg": {"data": None}}
    received = gateway.ros.collect("back", Float64)
    client.say(op="advertise", topic="back", type="std_msgs/Float64")
    gateway.ros.wait_until(
        lambda: client.say(op="publish", topic="back", msg={"data": None}) or received, DEADLINE
    )
    assert math.isnan(received[0].data)


def test_late_subscriber_gets_the_latched_message(gateway: RunningGateway) -> None:
    """The first client does, and one that shares its subscription, while the publisher lives."""
    publisher = rospy.Publisher(gateway.ros.name("latched"), String, latch=True, queue_size=1)
    publisher.publish("kept")
    for _ in range(2):
        client = gateway.client()
        client.subscribe("latched")
        heard = client.held[0] if client.held else client.hear("publish")
        assert heard["msg"] == {"data": "kept"}
    publisher.unregister()

    def nothing_comes() -> bool:
        client = gateway.client()
        client.subscribe("latched", "std_msgs/String")
        return not client.held

    gateway.ros.wait_until(nothing_comes, DEADLINE, "the latched message to go with its publisher")


def test_subscription_ends_with_its_last_client(gateway: RunningGateway) -> None:
    """ROS is not burdened with topics that nobody wants."""
    first, second = gateway.client(), gateway.client()
    for client in (first, second):
        client.subscribe("shared", "std_msgs/String")
    publisher = gateway.ros.publisher("shared", String)
    first.line.close()
    second.say(op="set_level", level="none")
    publisher.publish("still")
    assert second.hear("publish")["msg"] == {"data": "still"}
    assert publisher.get_num_connections() == 1
    second.say(op="unsubscribe", topic="shared")
    gateway.ros.wait_until(
        lambda: publisher.get_num_connections() == 0, DEADLINE, "the end of the subscription"
    )


@pytest.mark.parametrize(
    ("packet", "text"),
    [
        (
            {"op": "subscribe", "topic": "nobody_has_it"},
            "the type of .*/nobody_has_it is not known: advertise it, or give `type`",
        ),
        (
            {"op": "subscribe", "topic": "/rosout", "type": "std_msgs/String"},
            "/rosout has type rosgraph_msgs/Log, not std_msgs/String",
        ),
        ({"op": "advertise", "topic": "t", "type": "no_such/Type"}, "unknown type 'no_such/Type'"),
        (
            {"op": "advertise_service", "service": "s", "type": "no_such/Type"},
            "unknown service type 'no_such/Type'",
        ),
    ],
)
def test_what_ros_cannot_do_is_said(
    gateway: RunningGateway, packet: dict[str, Any], text: str
) -> None:
    """A status names the reason, the session lives on."""
    client = gateway.client()
    client.say(id="x", **packet)
    answer = client.hear("status")
    assert answer["id"] == "x" and re.search(text, answer["msg"]), answer
    assert client.call("/rosapi/get_time")["result"]


def test_viewer_cannot_publish_and_operator_can(gateway: RunningGateway) -> None:
    """Tokens come from the environment variables that gateway.yaml names."""
    viewer = gateway.client(header=["Authorization: Bearer look"])
    viewer.say(op="advertise", id="a", topic="motion_command", type="scara_msgs/MotionCommand")
    assert (
        viewer.hear("status")["msg"]
        == f"role viewer may not advertise {gateway.ros.name('motion_command')}"
    )
    operator = gateway.client(header=["Authorization: Bearer drive"])
    received = gateway.ros.collect("motion_command", MotionCommand)
    operator.say(op="advertise", topic="motion_command", type="scara_msgs/MotionCommand")
    gateway.ros.wait_until(
        lambda: (
            operator.say(op="publish", topic="motion_command", msg={"command": 3, "reason": "x"})
            or received
        ),
        DEADLINE,
    )


def test_diagnostics_count_what_was_refused(gateway: RunningGateway) -> None:
    """What is refused is shown."""
    name = f"{gateway.ros.namespace}/gateway: web socket"

    def refused(array: DiagnosticArray) -> int:
        return next(
            (
                int(v.value)
                for status in array.status
                if status.name == name
                for v in status.values
                if v.key == "refused"
            ),
            -1,
        )

    # The client answers no pings while nobody reads it, so it is gone before the next report: what
    # counts is the sum.
    before = refused(
        gateway.ros.wait_for_message(
            "/diagnostics", DiagnosticArray, DEADLINE, such_that=lambda a: refused(a) >= 0
        )
    )
    client = gateway.client()
    client.say(op="dance")
    client.hear("status")
    gateway.ros.wait_for_message(
        "/diagnostics", DiagnosticArray, DEADLINE, such_that=lambda a: refused(a) > before
    )


def test_velocity_that_waited_in_a_stopped_gateway_moves_nothing(gateway: RunningGateway) -> None:
    """A plain number says nothing of its time; a STOP may have come while the gateway stood."""
    ros, client = gateway.ros, gateway.client()
    topic = "twin/joint_1_velocity_controller/command"
    heard = ros.collect(topic, Float64)
    client.say(op="advertise", topic=topic, type="std_msgs/Float64")
    number = [0.0]

    def arrives() -> bool:
        number[0] += 1.0
        client.say(op="publish", topic=topic, msg={"data": number[0]})
        return bool(heard)

    ros.wait_until(arrives, DEADLINE, "a velocity")
    gateway.node.signal(signal.SIGSTOP)
    client.say(op="publish", topic=topic, msg={"data": -1.0})
    time.sleep(0.2)  # what is tried: the standstill
    gateway.node.signal(signal.SIGCONT)

    def waited() -> float:
        text = client.hear("status")["msg"]
        told = re.search(r"not sent: it waited for (\d+\.\d+) s in the gateway", text)
        return float(told[1]) if told else 0.0

    # One of before may have waited too, for less; this one for longer, on a busy machine.
    ros.wait_until(lambda: waited() >= 0.2, DEADLINE, "the velocity that waited")
    before = len(heard)
    ros.wait_until(lambda: arrives() and len(heard) > before, DEADLINE, "the next velocity")
    assert -1.0 not in {message.data for message in heard}
