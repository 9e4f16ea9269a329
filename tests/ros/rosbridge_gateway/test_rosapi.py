"""rosapi over the gateway against what ROS's own tools say of the same graph."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
import rosgraph
import rosnode
import rospy
import rosservice
import rostopic
from harness.opponents.running_gateway import RunningGateway
from harness.ros import Ros
from harness.wires.gateway_client import RosbridgeClient
from std_msgs.msg import String
from std_srvs.srv import Trigger, TriggerResponse


@pytest.fixture(scope="module")
def gateway(running: RunningGateway, ros_module: Ros) -> Iterator[RunningGateway]:
    """Give the module's gateway beside a topic and a service of the test's own node."""
    publisher = rospy.Publisher(ros_module.name("notes"), String, queue_size=1)
    service = rospy.Service(ros_module.name("try"), Trigger, lambda _: TriggerResponse(True, ""))
    yield running
    running.end_clients()
    service.shutdown()
    publisher.unregister()


@pytest.fixture
def client(gateway: RunningGateway) -> RosbridgeClient:
    """Connect."""
    return gateway.client()


def ask(client: RosbridgeClient, asked: str, **args: Any) -> dict[str, Any]:
    """Call one of rosapi's services and return its values."""
    answer = client.call(f"/rosapi/{asked}", args)
    assert answer["result"], answer
    values: dict[str, Any] = answer["values"]
    return values


def test_nodes_topics_and_services_are_those_of_ros(client: RosbridgeClient) -> None:
    """rosnode, rostopic and rosservice say the same."""
    state = rosgraph.Master(rospy.get_name()).getSystemState()
    used = {name for group in state[:2] for name, _ in group}
    assert ask(client, "nodes")["nodes"] == sorted(rosnode.get_node_names())
    topics = ask(client, "topics")
    assert set(topics["topics"]) == used
    types = dict(zip(topics["topics"], topics["types"]))
    assert {name: rostopic.get_topic_type(name)[0] or "" for name in used} == types
    assert ask(client, "services")["services"] == sorted(rosservice.get_service_list())
    strings = ask(client, "topics_for_type", type="std_msgs/String")["topics"]
    assert strings == sorted(rostopic.find_by_type("std_msgs/String")) and strings


def test_one_topic_service_and_node_in_detail(
    gateway: RunningGateway, client: RosbridgeClient
) -> None:
    """The test's own node, seen from outside."""
    notes, service, me = gateway.ros.name("notes"), gateway.ros.name("try"), rospy.get_name()
    assert ask(client, "topic_type", topic=notes) == {"type": "std_msgs/String"}
    assert ask(client, "publishers", topic=notes) == {"publishers": [me]}
    assert ask(client, "subscribers", topic=notes) == {"subscribers": []}
    assert ask(client, "service_type", service=service) == {"type": "std_srvs/Trigger"}
    assert ask(client, "service_node", service=service) == {"node": me}
    host = rosservice.get_service_uri(service).split("//")[1].split(":")[0]
    assert ask(client, "service_host", service=service) == {"host": host}
    of_type = ask(client, "services_for_type", type="std_srvs/Trigger")["services"]
    assert of_type == sorted(rosservice.rosservice_find("std_srvs/Trigger")) and service in of_type
    assert ask(client, "service_providers", service="std_srvs/Trigger")["providers"] == [me]
    details = ask(client, "node_details", node=me)
    assert notes in details["publishing"] and service in details["services"]
    assert ask(client, "service_type", service="/nowhere") == {"type": ""}
    assert ask(client, "service_host", service="/nowhere") == {"host": ""}


def test_parameters_are_those_of_the_server(
    gateway: RunningGateway, client: RosbridgeClient
) -> None:
    """Set here, read there, and the other way round; a name may be relative."""
    name, value = gateway.ros.name("gains"), {"p": 1.5, "joints": ["joint_1"]}
    ask(client, "set_param", name="gains", value=json.dumps(value))
    assert rospy.get_param(name) == value
    assert json.loads(ask(client, "get_param", name=f"{name}/p")["value"]) == 1.5
    assert name + "/p" in ask(client, "get_param_names")["names"]
    assert ask(client, "search_param", name="gains") == {"global_name": name}
    assert ask(client, "search_param", name="nowhere") == {"global_name": ""}
    rospy.set_param(name + "/p", 2)
    assert json.loads(ask(client, "get_param", name=name)["value"]) == {**value, "p": 2}
    ask(client, "delete_param", name=name)
    assert not rospy.has_param(name) and ask(client, "has_param", name=name) == {"exists": False}
    for wrong in ("null", "99999999999"):
        refused = client.call("/rosapi/set_param", {"name": name, "value": wrong})
        assert not refused["result"] and f"value = '{wrong}': " in refused["values"]
    assert json.loads(ask(client, "get_param", name=name, default="7")["value"]) == 7
