"""rosapi's services answer with rosapi's fields, from the graph."""

from __future__ import annotations

from typing import Any

import pytest
import roslib.message
from harness.opponents.graph_and_clients import Parameters
from rosbridge_gateway.rosapi import answers
from rosbridge_gateway.rosapi.answers import SystemState
from rosbridge_gateway.rosapi.errors import RequestError
from rosbridge_gateway.rosapi.parameters import ParameterServer
from rosbridge_gateway.rosapi.typedefs import FindClass
from std_msgs.msg import String

STATE = SystemState(
    publishers={
        "/clock": ["/simulator"],
        "/chatter": ["/talker", "/parrot"],
        **{f"/arm/{part}": ["/arm"] for part in ("feedback", "result", "status")},
    },
    subscribers={
        "/chatter": ["/listener"],
        "/nobody_says": ["/listener"],
        **{f"/arm/{part}": ["/arm"] for part in ("goal", "cancel")},
        "/half/goal": ["/half"],
    },
    services={"/move_to": ["/motion_server"], "/again": ["/listener"], "/mute": ["/listener"]},
)


class Graph:
    """A small ROS graph."""

    parameters: ParameterServer = Parameters({"/robot_description": "<robot/>"})
    find_message: FindClass = staticmethod(roslib.message.get_message_class)
    find_service: FindClass = staticmethod(roslib.message.get_service_class)

    def topic_types(self) -> dict[str, str]:
        """Return types, one of a topic that nobody uses any longer."""
        return {
            "/clock": "rosgraph_msgs/Clock",
            "/chatter": "std_msgs/String",
            "/gone": "std_msgs/String",
            "/half/goal": "*",
        }

    def system_state(self) -> SystemState:
        """Return who does what."""
        return STATE

    def service_types(self, services: list[str]) -> dict[str, str]:
        """Know two types of three."""
        known = {"/move_to": "scara_msgs/MoveTo", "/again": "scara_msgs/MoveTo"}
        return {service: known.get(service, "") for service in services}

    def service_address(self, service: str) -> str:
        """Know one."""
        return "rosrpc://robot.local:45678" if service == "/move_to" else ""


def ask(service: str, args: Any = None) -> dict[str, Any]:
    """Call one of rosapi's services."""
    return answers.answer(service, args, Graph())


@pytest.mark.parametrize(
    ("name", "service"),
    [
        ("/rosapi/get_time", "get_time"),
        ("/cell/rosapi/topics", "topics"),
        ("/rosapi/topics_and_raw_types", "topics_and_raw_types"),
        ("/move_to", None),
        ("/cell/move_to", None),
        ("/other/rosapi/topics", None),
        ("/rosapi/get_ros_version", None),
        ("/rosapi/", None),
    ],
)
def test_rosapi_is_found_globally_and_in_the_namespace(name: str, service: str | None) -> None:
    """Clients write /rosapi/..., or rosapi/... relative; other names are for ROS."""
    assert answers.service_of(name, "/cell") == service


@pytest.mark.parametrize(
    ("service", "args", "values"),
    [
        ("topics_for_type", {"type": "std_msgs/String"}, {"topics": ["/chatter", "/gone"]}),
        ("topic_type", {"topic": "/clock"}, {"type": "rosgraph_msgs/Clock"}),
        ("topic_type", ["/nothing"], {"type": ""}),
        ("topic_type", [], {"type": ""}),
        ("publishers", {"topic": "/chatter"}, {"publishers": ["/talker", "/parrot"]}),
        ("publishers", {"topic": "/nobody_says"}, {"publishers": []}),
        ("subscribers", {"topic": "/chatter"}, {"subscribers": ["/listener"]}),
        ("services", None, {"services": ["/again", "/move_to", "/mute"]}),
        ("services_for_type", ["scara_msgs/MoveTo"], {"services": ["/again", "/move_to"]}),
        ("service_type", {"service": "/move_to"}, {"type": "scara_msgs/MoveTo"}),
        ("service_type", {}, {"type": ""}),
        ("service_node", {"service": "/move_to"}, {"node": "/motion_server"}),
        ("service_node", {"service": "/none"}, {"node": ""}),
        ("service_host", {"service": "/move_to"}, {"host": "robot.local"}),
        ("service_host", {"service": "/none"}, {"host": ""}),
        (
            "service_providers",
            {"service": "scara_msgs/MoveTo"},
            {"providers": ["/listener", "/motion_server"]},
        ),
        (
            "nodes",
            {},
            {
                "nodes": [
                    *("/arm", "/half", "/listener", "/motion_server"),
                    *("/parrot", "/simulator", "/talker"),
                ]
            },
        ),
        (
            "node_details",
            {"node": "/listener"},
            {
                "subscribing": ["/chatter", "/nobody_says"],
                "publishing": [],
                "services": ["/again", "/mute"],
            },
        ),
        ("action_servers", {}, {"action_servers": ["/arm"]}),
    ],
)
def test_answers_come_from_the_graph(service: str, args: Any, values: dict[str, Any]) -> None:
    """Field by field as rosapi's .srv files name them."""
    assert ask(service, args) == values


def test_topics_are_those_in_use_with_an_empty_type_where_none_is_known() -> None:
    """A topic that nobody uses any longer is not shown, one that is only heard is."""
    found = ask("topics")
    types = dict(zip(found["topics"], found["types"]))
    assert "/gone" not in types and types["/nobody_says"] == "" and types["/half/goal"] == "*"
    assert types["/chatter"] == "std_msgs/String" and len(found["topics"]) == len(found["types"])


def test_raw_types_are_the_definitions_with_all_that_they_contain() -> None:
    """What a viewer decodes messages with; empty where the type is not known."""
    found = ask("topics_and_raw_types")
    texts = dict(zip(found["topics"], found["typedefs_full_text"]))
    assert found.keys() == {"topics", "types", "typedefs_full_text"}
    assert texts["/chatter"] == String._full_text and "string data" in texts["/chatter"]
    assert texts["/nobody_says"] == "" == texts["/half/goal"]
    assert [*texts] == ask("topics")["topics"]


@pytest.mark.parametrize(
    ("service", "args", "text"),
    [
        ("topic_type", {"name": "/clock"}, "name: unknown field: allowed: topic"),
        ("topic_type", ["/clock", "x"], "2 values for the fields topic"),
        ("topic_type", {"topic": 5}, "topic = 5: allowed: a text"),
        ("nodes", {"x": "y"}, "x: unknown field: allowed: none"),
        ("message_details", {"type": "std_msgs/Nothing"}, "unknown type 'std_msgs/Nothing'"),
        ("message_details", {"type": "nothing"}, "unknown type 'nothing'"),
        ("service_request_details", {"type": "std_srvs/Nothing"}, "unknown type"),
    ],
)
def test_wrong_arguments_are_refused_with_what_is_allowed(
    service: str, args: Any, text: str
) -> None:
    """The text goes to the client."""
    with pytest.raises(RequestError, match=text):
        ask(service, args)


def test_all_of_rosapis_services_are_there() -> None:
    """The names that rosapi 0.11.17 registers."""
    names = [
        *("action_servers", "delete_param", "get_param", "get_param_names", "get_time"),
        *("has_param", "message_details", "node_details", "nodes", "publishers"),
        *("search_param", "service_host", "service_node", "service_providers"),
        *("service_request_details", "service_response_details", "service_type", "services"),
        *("services_for_type", "set_param", "subscribers", "topic_type", "topics"),
        *("topics_and_raw_types", "topics_for_type"),
    ]
    assert sorted(answers.SERVICES) == names and len(names) == 25


def test_time_is_split_as_in_ros() -> None:
    """The clock probe's answer."""
    assert answers.time_values(3, 4) == {"time": {"secs": 3, "nsecs": 4}}
