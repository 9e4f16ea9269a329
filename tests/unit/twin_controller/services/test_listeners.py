"""What nobody listens to is not made: inputs, states for the record, the robot's status."""

from __future__ import annotations

from typing import Any

import pytest
import rospy
from harness.pair import SETUP
from twin_controller.core.events import Tick
from twin_controller.core.state import initial_state
from twin_controller.reporting.input_publisher_node import InputPublisher
from twin_controller.reporting.status_publisher_node import StatusPublisher

STATE = initial_state(SETUP)


class Topic:
    """A publisher with as many listeners as the test says."""

    listeners = 0

    def __init__(self, name: str, kind: type, **_: Any) -> None:
        self.sent: list[Any] = []

    def get_num_connections(self) -> int:
        """Count the listeners."""
        return Topic.listeners

    def publish(self, message: Any) -> None:
        """Keep a message."""
        self.sent.append(message)


@pytest.fixture(autouse=True)
def _topics(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give topics to a process that is no node; nobody listens at first."""
    monkeypatch.setattr(rospy, "Publisher", Topic)
    monkeypatch.setattr(Topic, "listeners", 0)


def test_inputs_without_a_listener_are_counted_and_the_first_one_heard_has_a_state() -> None:
    """A recorder that comes later can begin its replay with its first message."""
    inputs = InputPublisher(SETUP)
    topic: Any = inputs._publisher
    for k in range(3):
        inputs.publish([Tick(float(k))], STATE, rospy.Time(1))
    assert topic.sent == []
    Topic.listeners = 1
    inputs.peer_subscribe("", None, None)
    inputs.publish([Tick(3.0)], STATE, rospy.Time(1))
    inputs.publish([Tick(4.0)], STATE, rospy.Time(1), lost=2)
    assert [message.seq for message in topic.sent] == [4, 7]
    assert topic.sent[0].state and not topic.sent[1].state


def test_the_robots_status_is_told_at_once_to_whoever_begins_to_listen() -> None:
    """And to nobody before."""
    status = StatusPublisher(SETUP)
    told: Any = status._status
    status.publish(STATE, 10.0, rospy.Time(1))
    assert told.sent == []
    Topic.listeners = 1
    status.publish(STATE, 10.001, rospy.Time(1))
    status.publish(STATE, 10.002, rospy.Time(1))
    assert len(told.sent) == 1
