"""Gateway and rosbridge_server 0.11.17 on one master: the same questions, the same messages.

See test_rosbridge_server.py for where the server comes from. Decision 0020 tells the differences.
"""

from __future__ import annotations

import base64
import io
import json
import random
from collections.abc import Iterator
from functools import partial
from typing import Any

import cbor2
import genpy
import pytest
import rospy
from harness.clients.environments import NOT_BUILT, UPSTREAM
from harness.clients.random_messages import EACH, PACKAGES, SEED, random_message, types_of
from harness.clients.ros_side import RosSide
from harness.opponents.running_gateway import RunningGateway
from harness.ros import Ros
from harness.wires.gateway_client import RosbridgeClient, connect
from PIL import Image
from std_msgs.msg import Time, UInt8MultiArray

pytestmark = pytest.mark.skipif(not UPSTREAM, reason=NOT_BUILT)

QUESTIONS: list[tuple[str, dict[str, str]]] = [
    ("topics", {}),
    ("topics_for_type", {"type": "sensor_msgs/JointState"}),
    ("topics_and_raw_types", {}),
    ("services", {}),
    ("services_for_type", {"type": "std_srvs/SetBool"}),
    ("nodes", {}),
    ("node_details", {"node": "/tests"}),
    ("node_details", {"node": "/nobody"}),
    ("action_servers", {}),
    ("topic_type", {"topic": "NAMESPACE/states"}),
    ("topic_type", {"topic": "/nowhere"}),
    ("service_type", {"service": "NAMESPACE/switch"}),
    ("service_type", {"service": "/nowhere"}),
    ("publishers", {"topic": "NAMESPACE/states"}),
    ("subscribers", {"topic": "NAMESPACE/question"}),
    ("service_providers", {"service": "std_srvs/SetBool"}),
    ("service_node", {"service": "NAMESPACE/switch"}),
    ("service_host", {"service": "NAMESPACE/switch"}),
    ("message_details", {"type": "sensor_msgs/JointState"}),
    ("message_details", {"type": "geometry_msgs/PoseWithCovarianceStamped"}),
    ("service_request_details", {"type": "std_srvs/SetBool"}),
    ("service_response_details", {"type": "std_srvs/SetBool"}),
    ("set_param", {"name": "NAMESPACE/gain", "value": '{"p": 1.5}'}),
    ("get_param", {"name": "NAMESPACE/gain"}),
    ("get_param", {"name": "NAMESPACE/nothing", "default": "7"}),
    ("has_param", {"name": "NAMESPACE/gain"}),
    ("search_param", {"name": "/NAMESPACE/gain"}),
    ("get_param_names", {}),
    ("delete_param", {"name": "NAMESPACE/gain"}),
    ("get_time", {}),
]
"""All 25 services of rosapi, in an order in which each has something to say."""
NAMES = (
    *("topics", "services", "nodes", "publishers", "subscribers", "publishing", "subscribing"),
    *("providers", "action_servers", "names"),
)
"""Lists that have no order of their own."""


@pytest.fixture(scope="module")
def side(gateway: RunningGateway) -> Iterator[RosSide]:
    """Start what is asked about."""
    made = RosSide(gateway.ros)
    yield made
    made.close()


@pytest.fixture(scope="module")
def both(
    gateway: RunningGateway, server: int, side: RosSide
) -> Iterator[tuple[RosbridgeClient, RosbridgeClient]]:
    """Connect to the gateway and to the server."""
    clients = gateway.client(), connect(server)
    yield clients
    gateway.end_clients()
    clients[1].line.close(timeout=0.2)


def in_one_order(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values with names sorted, and what belongs to topics in the order of these.

    Without topics of the server's own types: the gateway does not know its workspace.
    """
    names, types = values.get("topics"), values.get("types")
    if names and types:
        kept = [k for k, kind in enumerate(types) if not kind.startswith("rosbridge_msgs/")]
        kept.sort(key=names.__getitem__)
        return {key: [many[k] for k in kept] for key, many in values.items()}
    return {key: sorted(many) if key in NAMES else many for key, many in values.items()}


@pytest.mark.parametrize(("service", "args"), QUESTIONS)
def test_rosapi_answers_field_by_field_as_upstream(
    both: tuple[RosbridgeClient, RosbridgeClient],
    ros_module: Ros,
    service: str,
    args: dict[str, str],
) -> None:
    """Names and values; only the order of lists and the time may differ."""
    named = {
        key: text.replace("/NAMESPACE", ros_module.namespace).replace(
            "NAMESPACE", ros_module.namespace
        )
        for key, text in args.items()
    }
    ours, theirs = (client.call(f"/rosapi/{service}", named) for client in both)
    assert ours["result"] is theirs["result"] is True, (ours, theirs)
    if service == "get_time":
        assert ours["values"].keys() == theirs["values"].keys()
        assert abs(ours["values"]["time"]["secs"] - theirs["values"]["time"]["secs"]) <= 1
        return
    assert in_one_order(ours["values"]) == in_one_order(theirs["values"])


def heard_by_both(publisher: rospy.Publisher) -> bool:
    """Return whether both have subscribed."""
    return bool(publisher.get_num_connections() == 2)


@pytest.mark.parametrize("package", PACKAGES)
def test_random_messages_reach_clients_of_both_alike(
    both: tuple[RosbridgeClient, RosbridgeClient], ros_module: Ros, package: str
) -> None:
    """The same packet, value by value."""
    chance = random.Random(f"{SEED} {package}")
    for kind in types_of(package):
        topic = ros_module.name(f"random/{kind._type}")
        publisher = rospy.Publisher(topic, kind, queue_size=EACH)
        for client in both:
            client.subscribe(topic, kind._type)
        ros_module.wait_until(partial(heard_by_both, publisher), 10.0, topic)
        for _ in range(EACH):
            message: genpy.Message = random_message(kind, chance)
            publisher.publish(message)
            ours, theirs = (client.hear("publish") for client in both)
            assert ours["msg"] == theirs["msg"], (kind._type, message)
        for client in both:
            client.say(op="unsubscribe", topic=topic)
        publisher.unregister()


def joined(fragments: list[dict[str, Any]]) -> dict[str, Any]:
    """Put fragments together."""
    assert [one["num"] for one in fragments] == list(range(len(fragments)))
    packet: dict[str, Any] = json.loads("".join(one["data"] for one in fragments))
    return packet


def pixels(packet: dict[str, Any]) -> dict[str, Any]:
    """Return the packet that an image carries."""
    with Image.open(io.BytesIO(base64.b64decode(packet["data"]))) as image:
        found: dict[str, Any] = json.loads(image.tobytes().rstrip(b"\n"))
    return found


def test_images_bytes_and_fragments_are_the_same(gateway: RunningGateway, server: int) -> None:
    """What each compression carries, and what pieces are a piece of."""
    topic = gateway.ros.name("octets")
    publisher = rospy.Publisher(topic, UInt8MultiArray, latch=True, queue_size=1)
    publisher.publish(UInt8MultiArray(data=bytes(range(64))))
    wanted = {"op": "publish", "topic": topic}
    carried = []
    for port in (gateway.port, server):
        found = {}
        for compression in ("png", "cbor-raw", "fragments"):
            client = connect(port)
            more = (
                {"fragment_size": 40}
                if compression == "fragments"
                else {"compression": compression}
            )
            client.say(op="subscribe", topic=topic, type="std_msgs/UInt8MultiArray", **more)
            heard = client.line.recv()
            if compression == "cbor-raw":
                packet = cbor2.loads(heard)
                packet["msg"] = packet["msg"]["bytes"]
            elif compression == "png":
                packet = pixels(json.loads(heard))
            else:
                parts = [json.loads(heard)]
                parts += [client.hear("fragment") for _ in range(int(parts[0]["total"]) - 1)]
                packet = joined(parts)
            assert packet.items() >= wanted.items()
            found[compression] = packet["msg"]
            client.line.close(timeout=0.2)
        carried.append(found)
    publisher.unregister()
    assert carried[0] == carried[1]


def test_now_and_short_lists_are_taken_alike(
    both: tuple[RosbridgeClient, RosbridgeClient], ros_module: Ros
) -> None:
    """A time may be "now"; a list of arguments may stop early."""
    for number, client in enumerate(both):
        topic = ros_module.name(f"clock_{number}")
        times = ros_module.collect(topic, Time)
        client.say(op="advertise", topic=topic, type="std_msgs/Time")
        client.say(op="publish", topic=topic, msg={"data": "now"})
        ros_module.wait_until(lambda times=times: times, 10.0, "a time")
        assert abs(times[0].data.to_sec() - rospy.get_time()) < 5.0
        answer = client.call(ros_module.name("switch"), [])
        assert answer["result"] and answer["values"]["message"] == "off", answer
        answer = client.call(ros_module.name("switch"), [True])
        assert answer["result"] and answer["values"]["message"] == "on", answer
        client.say(op="unadvertise", topic=topic)
