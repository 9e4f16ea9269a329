"""CBOR, raw messages, images and fragments between real ROS nodes and real clients."""

from __future__ import annotations

import base64
import io
import json
import math
import struct
import threading
from typing import Any

import cbor2
import pytest
import rospy
from geometry_msgs.msg import PointStamped
from harness.opponents.running_gateway import DEADLINE, RunningGateway
from harness.wires.gateway_client import RosbridgeClient
from PIL import Image
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool
from websocket import ABNF


def whole(client: RosbridgeClient) -> tuple[int, Any]:
    """Return opcode and content of the next packet, put together and unpacked."""
    opcode, data = client.line.recv_data()
    if opcode == ABNF.OPCODE_BINARY:
        return opcode, cbor2.loads(data)
    packet = json.loads(data)
    if packet["op"] == "fragment":
        parts = [packet, *(json.loads(client.line.recv()) for _ in range(packet["total"] - 1))]
        packet = json.loads("".join(part["data"] for part in parts))
    if packet["op"] == "png":
        packet = json.loads(Image.open(io.BytesIO(base64.b64decode(packet["data"]))).tobytes())
    return opcode, packet


def test_one_message_reaches_each_client_in_its_own_form(gateway: RunningGateway) -> None:
    """The raw form is what ROS carries, byte by byte."""
    ros = gateway.ros
    listeners = {
        form: gateway.client() for form in ("none", "png", "cbor", "cbor-raw", "bson", "pieces")
    }
    for form, client in listeners.items():
        more = {"fragment_size": 100} if form == "pieces" else {"compression": form}
        client.subscribe("states", "sensor_msgs/JointState", **more)
    carried: list[rospy.AnyMsg] = ros.collect("states", rospy.AnyMsg)
    names = ["joint_1", "joint_2"]
    before = rospy.get_time()
    sent = JointState(name=names, position=[0.1, math.nan])
    ros.publisher("states", JointState, subscribers=2).publish(sent)
    found = {form: whole(client) for form, client in listeners.items()}
    ros.wait_until(lambda: carried, DEADLINE, "the message in ROS")
    assert all(packet["topic"] == "states" for _, packet in found.values())
    binary = {form for form, (opcode, _) in found.items() if opcode == ABNF.OPCODE_BINARY}
    assert binary == {"cbor", "cbor-raw"}
    for form in ("none", "png", "bson", "pieces"):
        assert found[form][1] == found["none"][1], form
    text, cbor, raw = (found[form][1]["msg"] for form in ("none", "cbor", "cbor-raw"))
    assert (text["name"], text["position"]) == (names, [0.1, None])
    assert cbor["header"] == text["header"] and cbor["name"] == names
    assert cbor["position"] == cbor2.CBORTag(86, struct.pack("<2d", 0.1, math.nan))
    assert raw["bytes"] == carried[0]._buff and abs(raw["secs"] - before) < 10


def test_late_client_gets_the_latched_message_in_its_own_form(gateway: RunningGateway) -> None:
    """The first has made the gateway listen, for JSON."""
    publisher = rospy.Publisher(gateway.ros.name("kept"), JointState, latch=True, queue_size=1)
    publisher.publish(JointState(name=["a"]))
    first = gateway.client()
    first.subscribe("kept")
    assert (first.held or [first.hear("publish")])[0]["msg"]["name"] == ["a"]
    late = gateway.client()
    late.say(op="subscribe", topic="kept", compression="cbor")
    assert whole(late) == (
        ABNF.OPCODE_BINARY,
        {"op": "publish", "topic": "kept", "msg": whole_state("a")},
    )
    publisher.unregister()


def whole_state(name: str) -> dict[str, Any]:
    """Return a joint state without positions, as CBOR has it."""
    empty = cbor2.CBORTag(86, b"")
    stamp = {"secs": 0, "nsecs": 0}
    header = {"seq": 1, "stamp": stamp, "frame_id": ""}
    return {"header": header, "name": [name], "position": empty, "velocity": empty, "effort": empty}


def test_sighting_without_a_stamp_is_not_taken_for_one_of_now(gateway: RunningGateway) -> None:
    """Only its sender knows when it was true; the twin controller does not count it."""
    ros, client = gateway.ros, gateway.client()
    seen = ros.collect("people/nearest", PointStamped)
    client.say(op="advertise", topic="people/nearest", type="geometry_msgs/PointStamped")
    sighting = {"header": {"frame_id": "base_link"}}
    ros.wait_until(
        lambda: client.say(op="publish", topic="people/nearest", msg=sighting) or seen, DEADLINE
    )
    assert seen[0].header.stamp.is_zero() and seen[0].header.frame_id == "base_link"


@pytest.mark.parametrize("result", [True, False])
def test_values_of_a_clients_service_answer_whatever_result_says(
    gateway: RunningGateway, result: bool
) -> None:
    """Roslibpy says result: false when its handler returns False, and sends the values."""
    client = gateway.client()
    client.say(op="advertise_service", service="lamp", type="std_srvs/SetBool")
    lamp = gateway.ros.service("lamp", SetBool)
    answers: list[Any] = []
    caller = threading.Thread(target=lambda: answers.append(lamp(True)))
    caller.start()
    asked = client.hear("call_service")
    values = {"success": False, "message": "no bulb"}
    client.say(op="service_response", id=asked["id"], service="lamp", values=values, result=result)
    caller.join(DEADLINE)
    assert [(answer.success, answer.message) for answer in answers] == [(False, "no bulb")]
    client.say(op="unadvertise_service", service="lamp")
    assert client.call("/rosapi/get_time")["result"]
