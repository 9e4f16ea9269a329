"""What rosapi asks is paid for, whichever thread computes it."""

from __future__ import annotations

import time

import pytest
from rosbridge_gateway.graph import ros_view_node
from rosbridge_gateway.graph.ros_view_node import RosView
from scara_ros.services.service_connection_io import ServiceError

PROBE_S = 0.002


def test_time_of_the_threads_that_ask_services_is_told_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Also of those that do not tell their type."""

    def service_type(service: str, *_: object) -> str:
        end = time.thread_time() + PROBE_S
        while time.thread_time() < end:
            pass
        if service == "/mute":
            raise ServiceError("no answer")
        return "std_srvs/Trigger"

    monkeypatch.setattr(ros_view_node, "service_type", service_type)
    view = RosView()
    assert view.helped() == 0.0
    for _ in range(2):
        found = view.service_types(["/a", "/mute"])
        assert found == {"/a": "std_srvs/Trigger", "/mute": ""}
    assert 4 * PROBE_S <= view.helped() < 1.0
    assert view.helped() == 0.0
