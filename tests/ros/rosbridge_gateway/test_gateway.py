"""The gateway between real ROS nodes and real web-socket clients."""

from __future__ import annotations

import json
import math
import re
import shutil
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rospy
import websocket
from harness.opponents.running_gateway import DEADLINE, RosbridgeClient, RunningGateway
from harness.ros import Ros
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String
from std_srvs.srv import SetBool, SetBoolRequest, SetBoolResponse, Trigger, TriggerResponse

from scara_msgs.srv import MoveTo, MoveToRequest, MoveToResponse

ROSLIBPY = """
import json, os, sys, threading, time
import roslibpy
from roslibpy.core import ServiceException

ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
ros.run(timeout=10)
found = {}
heard = threading.Event()

def take(message):
    found["heard"] = message
    heard.set()

states = roslibpy.Topic(ros, sys.argv[2] + "/twin/joint_states", "sensor_msgs/JointState")
states.subscribe(take)
assert heard.wait(10)
found["time"] = dict(ros.get_time())
found["topics"] = ros.get_topics()
found["type"] = ros.get_service_type(sys.argv[2] + "/move_to")
move_to = roslibpy.Service(ros, sys.argv[2] + "/move_to", "scara_msgs/MoveTo")
request = roslibpy.ServiceRequest({"x": 0.51, "y": 0.16, "z": 0.10})
found["moved"] = dict(move_to.call(request, timeout=10))
try:
    move_to.call(roslibpy.ServiceRequest({"a": 1}), timeout=10)
except ServiceException as error:
    found["refused"] = str(error)

def answer(request, response):
    response["success"] = request["data"]
    response["message"] = "by roslibpy"
    return True

enable = roslibpy.Service(ros, sys.argv[2] + "/enable", "std_srvs/SetBool")
enable.advertise(answer)
told = roslibpy.Topic(ros, sys.argv[2] + "/told", "std_msgs/String", latch=True)
told.publish(roslibpy.Message({"data": json.dumps(found)}))
while not os.path.exists(sys.argv[3]):
    time.sleep(0.02)
os._exit(0)
"""


@pytest.fixture(scope="module")
def running(ros_module: Ros) -> RunningGateway:
    """Start one gateway for the tests of this module."""
    return RunningGateway(ros_module)


@pytest.fixture
def cell(running: RunningGateway) -> Iterator[RunningGateway]:
    """Give a test the gateway; its clients go at the end."""
    yield running
    running.end_clients()


def offer(
    cell: RunningGateway, name: str, kind: type[Any], handler: Callable[[Any], Any]
) -> rospy.Service:
    """Offer a service in the test's own process."""
    return rospy.Service(cell.ros.name(name), kind, handler)


def test_unmodified_roslibpy_client_is_served(cell: RunningGateway) -> None:
    """Topics, calls, refusals, an own service, latch and rosapi, all by roslibpy's own code."""
    ros = cell.ros

    def move(request: MoveToRequest) -> MoveToResponse:
        return MoveToResponse(
            success=True, message=f"{request.x:.2f}", joint_positions=[0.5, math.nan]
        )

    service = offer(cell, "move_to", MoveTo, move)
    script = ros.folder / "client.py"
    script.write_text(ROSLIBPY, encoding="utf-8")
    client = ros.stage.start(
        sys.executable, str(script), str(cell.port), ros.namespace, str(ros.folder / "go")
    )
    states = ros.publisher("twin/joint_states", JointState)
    ros.wait_until(
        lambda: (
            states.publish(JointState(name=["joint_1"], position=[1.5]))
            or states.get_num_connections()
        ),
        DEADLINE,
    )
    stop = threading.Event()
    ticking = threading.Thread(
        target=lambda: [
            states.publish(JointState(name=["joint_1"], position=[1.5]))
            for _ in iter(lambda: stop.wait(0.05), True)
        ]
    )
    ticking.start()
    try:
        found = json.loads(ros.wait_for_message("told", String, DEADLINE).data)
    finally:
        stop.set()
        ticking.join()
    assert found["heard"]["name"] == ["joint_1"] and found["heard"]["position"] == [1.5]
    assert abs(found["time"]["secs"] - rospy.get_time()) < 60
    assert ros.name("twin/joint_states") in found["topics"] and found["type"] == "scara_msgs/MoveTo"
    assert (
        found["moved"]["success"]
        and found["moved"]["joint_positions"] == [0.5, None]
        and found["moved"]["message"] == "0.51"
    )
    assert found["refused"] == "a: unknown field: allowed: x, y, z, speed_percent, elbow"
    assert ros.service("enable", SetBool)(True).message == "by roslibpy"
    (ros.folder / "go").touch()
    assert client.wait() == 0
    ros.wait_until(
        lambda: ros.name("enable") not in ros.shell("rosservice", "list").split(),
        DEADLINE,
        "the service to go",
    )
    service.shutdown()


def test_not_a_number_crosses_both_ways(cell: RunningGateway) -> None:
    """NaN in ROS, null on the wire."""
    client = cell.client()
    client.subscribe("out", "std_msgs/Float64")
    cell.ros.publisher("out", Float64).publish(math.nan)
    assert client.hear("publish") == {"op": "publish", "topic": "out", "msg": {"data": None}}
    received = cell.ros.collect("back", Float64)
    client.say(op="advertise", topic="back", type="std_msgs/Float64")
    cell.ros.wait_until(
        lambda: client.say(op="publish", topic="back", msg={"data": None}) or received, DEADLINE
    )
    assert math.isnan(received[0].data)


def test_late_subscriber_gets_the_latched_message(cell: RunningGateway) -> None:
    """So do the first client and one that shares its subscription, without a type.

    It holds as long as the publisher lives.
    """
    publisher = rospy.Publisher(cell.ros.name("latched"), String, latch=True, queue_size=1)
    publisher.publish("kept")
    for _ in range(2):
        client = cell.client()
        client.subscribe("latched")
        heard = client.held[0] if client.held else client.hear("publish")
        assert heard["msg"] == {"data": "kept"}
    publisher.unregister()

    def nothing_comes() -> bool:
        client = cell.client()
        client.subscribe("latched", "std_msgs/String")
        return not client.held

    cell.ros.wait_until(nothing_comes, DEADLINE, "the latched message to go with its publisher")


def test_subscription_ends_with_its_last_client(cell: RunningGateway) -> None:
    """ROS is not burdened with topics that nobody wants."""
    first, second = cell.client(), cell.client()
    for client in (first, second):
        client.subscribe("shared", "std_msgs/String")
    publisher = cell.ros.publisher("shared", String)
    first.line.close()
    second.say(op="set_level", level="none")
    publisher.publish("still")
    assert second.hear("publish")["msg"] == {"data": "still"}
    assert publisher.get_num_connections() == 1
    second.say(op="unsubscribe", topic="shared")
    cell.ros.wait_until(
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
            {"op": "publish", "topic": "/rosout", "msg": {"level": 300}},
            "/rosout is published by the cell's own nodes only",
        ),
        (
            {"op": "advertise_service", "service": "s", "type": "no_such/Type"},
            "unknown service type 'no_such/Type'",
        ),
        ({"op": "unadvertise_service", "service": "s"}, "/s is not advertised as a service"),
    ],
)
def test_what_ros_cannot_do_is_said(
    cell: RunningGateway, packet: dict[str, Any], text: str
) -> None:
    """A status names the reason, the session lives on."""
    client = cell.client()
    client.say(id="x", **packet)
    answer = client.hear("status")
    assert answer["id"] == "x" and re.search(text, answer["msg"]), answer
    assert client.call("/rosapi/get_time")["result"]


def test_failing_service_is_answered_with_its_reason(cell: RunningGateway) -> None:
    """The text of the node's own error."""

    def fail(request: Any) -> Any:
        raise rospy.ServiceException("the drives are off")

    service = offer(cell, "failing", Trigger, fail)
    answer = cell.client().call("failing")
    assert answer["result"] is False and "the drives are off" in answer["values"]
    service.shutdown()
    answer = cell.client().call("failing")
    assert (answer["result"], answer["values"]) == (
        False,
        f"service {cell.ros.name('failing')} does not exist",
    )


def test_hanging_service_ends_at_the_calls_time_out(cell: RunningGateway) -> None:
    """ROS itself has no time-out; the gateway has, and serves others meanwhile."""
    release = threading.Event()
    service = offer(
        cell, "hanging", Trigger, lambda _: release.wait(DEADLINE) and TriggerResponse(True, "")
    )
    client = cell.client()
    answer = client.call("hanging", timeout=0.3)
    assert (answer["result"], answer["values"]) == (
        False,
        f"service {cell.ros.name('hanging')} did not answer within 0.3 s",
    )
    release.set()
    assert client.call("hanging")["values"] == {"success": True, "message": ""}
    service.shutdown()


def test_service_started_anew_with_another_type_is_found(cell: RunningGateway) -> None:
    """The remembered type is asked for again after a failure."""
    service = offer(cell, "changing", Trigger, lambda _: TriggerResponse(True, "old"))
    client = cell.client()
    assert client.call("changing")["values"]["message"] == "old"
    service.shutdown()

    def answer(request: SetBoolRequest) -> SetBoolResponse:
        return SetBoolResponse(request.data, "new")

    service = offer(cell, "changing", SetBool, answer)
    assert "md5sums do not match" in client.call("changing")["values"]
    assert client.call("changing", {"data": True})["values"] == {"success": True, "message": "new"}
    service.shutdown()


def test_client_that_is_silent_about_a_question_fails_the_ros_call(cell: RunningGateway) -> None:
    """A ROS caller of a client's service gets the reason when the client goes."""
    client = cell.client()
    client.say(op="advertise_service", service="mine", type="std_srvs/Trigger")
    mine = cell.ros.service("mine", Trigger)
    outcome: list[str] = []

    def ask() -> None:
        try:
            mine()
        except rospy.ServiceException as error:
            outcome.append(str(error))

    caller = threading.Thread(target=ask)
    caller.start()
    assert client.hear("call_service")["service"] == "mine"
    client.line.close()
    caller.join(DEADLINE)
    assert len(outcome) == 1 and "the client that answers mine has gone" in outcome[0]


def test_viewer_cannot_publish_and_operator_can(cell: RunningGateway) -> None:
    """Tokens come from the environment variables that gateway.yaml names."""
    viewer = cell.client(header=["Authorization: Bearer look"])
    viewer.say(op="advertise", id="a", topic="motion_command", type="std_msgs/String")
    assert (
        viewer.hear("status")["msg"]
        == f"role viewer may not advertise {cell.ros.name('motion_command')}"
    )
    operator = cell.client(header=["Authorization: Bearer drive"])
    received = cell.ros.collect("motion_command", String)
    operator.say(op="advertise", topic="motion_command", type="std_msgs/String")
    cell.ros.wait_until(
        lambda: operator.say(op="publish", topic="motion_command", msg={"data": "x"}) or received,
        DEADLINE,
    )


def test_diagnostics_count_what_was_refused(cell: RunningGateway) -> None:
    """What is refused is shown."""
    from diagnostic_msgs.msg import DiagnosticArray

    name = f"{cell.ros.namespace}/gateway: web socket"

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
        cell.ros.wait_for_message(
            "/diagnostics", DiagnosticArray, DEADLINE, such_that=lambda a: refused(a) >= 0
        )
    )
    client = cell.client()
    client.say(op="dance")
    client.hear("status")
    cell.ros.wait_for_message(
        "/diagnostics", DiagnosticArray, DEADLINE, such_that=lambda a: refused(a) > before
    )


def test_taken_port_ends_the_second_gateway(cell: RunningGateway) -> None:
    """Exit code 2 and a text that names the port and what to do."""
    second = cell.ros.run("rosbridge_gateway", "gateway", f"_port:={cell.port}", "__name:=second")
    assert second.wait(20.0) == 2
    assert (
        f"port 127.0.0.1:{cell.port} cannot be opened" in second.output
        and "_port:=NUMBER" in second.output
    )
    assert "Traceback" not in second.output


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("nesting: 32", "nesting: 1000", "limits.nesting = 1000"),
        ("clients: 32", "client: 32", "`client`"),
    ],
)
def test_wrong_configuration_ends_the_node(ros: Ros, old: str, new: str, text: str) -> None:
    """Exit code 2 and one line with file, key, value."""
    text_before = (Path(__file__).parents[3] / "config" / "gateway.yaml").read_text(
        encoding="utf-8"
    )
    (ros.folder / "gateway.yaml").write_text(text_before.replace(old, new), encoding="utf-8")
    node = ros.run("rosbridge_gateway", "gateway", f"_config_dir:={ros.folder}")
    assert node.wait(20.0) == 2
    assert (
        f"{ros.folder}/gateway.yaml: " in node.output
        and text in node.output
        and "Traceback" not in node.output
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_the_gateway_with_close_frames(ros: Ros, number: signal.Signals) -> None:
    """Clients hear a goodbye; exit code 0, no error."""
    cell = RunningGateway(ros)
    client = cell.client()
    client.subscribe("t", "std_msgs/String")
    cell.node.signal(number)
    opcode, data = client.line.recv_data()
    assert opcode == websocket.ABNF.OPCODE_CLOSE and data[2:] == b"the gateway ends"
    assert cell.node.wait(10.0) == 0
    assert "Traceback" not in cell.node.output


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_missing_roscore_is_said_once_and_waited_for(ros: Ros, number: signal.Signals) -> None:
    """Any start order works; a signal ends the waiting."""
    uri = f"http://127.0.0.1:{ros.free_port()}"
    node = ros.run("rosbridge_gateway", "gateway", env={"ROS_MASTER_URI": uri})
    ros.wait_until(
        lambda: f"no roscore at {uri}: waiting for it" in node.output, 20.0, "the remark"
    )
    node.signal(number)
    assert node.wait(10.0) == 0
    assert node.output.count("no roscore") == 1 and "Traceback" not in node.output


def test_gateway_waits_for_a_roscore_that_comes_late(ros: Ros) -> None:
    """The remark is followed by service."""
    port = ros.free_port()
    uri = f"http://127.0.0.1:{port}"
    door = ros.free_port()
    node = ros.run("rosbridge_gateway", "gateway", f"_port:={door}", env={"ROS_MASTER_URI": uri})
    ros.wait_until(lambda: "no roscore" in node.output, 20.0, "the remark")
    assert shutil.which("rosmaster", path=ros.env["PATH"])
    ros.stage.start("rosmaster", "--core", "-p", str(port), env={"ROS_MASTER_URI": uri})
    ros.wait_until(lambda: f"on 127.0.0.1:{door}" in node.output, 20.0, "the gateway's port")
    client = RosbridgeClient(door)
    assert client.call("/rosapi/get_time")["result"]
    client.line.close()
