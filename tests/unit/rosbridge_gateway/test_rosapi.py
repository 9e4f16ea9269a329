"""The gateway's own rosapi services answer with rosapi's field names."""

from __future__ import annotations

from typing import Any

import pytest
from rosbridge_gateway.rosapi import answers as rosapi


class Names:
    """A small ROS graph."""

    def topics(self) -> dict[str, str]:
        """Return one topic."""
        return {"/clock": "rosgraph_msgs/Clock"}

    def services(self) -> list[str]:
        """Return one service."""
        return ["/move_to"]

    def service_type(self, service: str) -> str:
        """Know one type."""
        return "scara_msgs/MoveTo" if service == "/move_to" else ""


@pytest.mark.parametrize(
    ("name", "service"),
    [
        ("/rosapi/get_time", "get_time"),
        ("/cell/rosapi/topics", "topics"),
        ("/move_to", None),
        ("/cell/move_to", None),
        ("/other/rosapi/topics", None),
    ],
)
def test_rosapi_is_found_globally_and_in_the_namespace(name: str, service: str | None) -> None:
    """Clients write /rosapi/..., or rosapi/... relative to the gateway."""
    assert rosapi.service_of(name, "/cell") == service


@pytest.mark.parametrize(
    ("service", "args", "values"),
    [
        ("topics", {}, {"topics": ["/clock"], "types": ["rosgraph_msgs/Clock"]}),
        ("services", None, {"services": ["/move_to"]}),
        ("topic_type", {"topic": "/clock"}, {"type": "rosgraph_msgs/Clock"}),
        ("topic_type", ["/nothing"], {"type": ""}),
        ("service_type", {"service": "/move_to"}, {"type": "scara_msgs/MoveTo"}),
        ("service_type", {}, {"type": ""}),
        ("set_param", {}, None),
    ],
)
def test_answers_have_rosapis_fields(
    service: str, args: Any, values: dict[str, Any] | None
) -> None:
    """What is not offered is None."""
    assert rosapi.answer(service, args, Names()) == values


def test_time_is_split_as_in_ros() -> None:
    """The clock probe's answer."""
    assert rosapi.time_values(3, 4) == {"time": {"secs": 3, "nsecs": 4}}
