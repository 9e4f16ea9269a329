"""The node publishes samples at any time, and ends with what it cannot do without."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
import rospy
from harness.pair import SETUP, idle_pair
from sensor_msgs.msg import JointState
from twin_controller.core.events import RealMeasured
from twin_controller.reporting.publisher_thread_node import Batch
from twin_controller.reporting.publishing_node import Publishing
from twin_controller.twin_controller_node import Node


def test_a_sample_older_than_simulated_time_has_the_stamp_zero() -> None:
    """No ROS time is negative: such a stamp would end the controller."""
    pair = idle_pair()
    last = pair.state.sides.real.last
    at = pair.now
    sample = RealMeasured(at, sent=at, received=at, clock_ms=0, motion=last)
    told: list[JointState] = []
    publishing: Any = Publishing.__new__(Publishing)
    publishing._setup = SETUP
    publishing._joints = SimpleNamespace(get_num_connections=lambda: 1, publish=told.append)
    batch = Batch([sample], pair.state, [], last.time + 0.005, rospy.Time(0))
    publishing._publish_samples(batch)
    assert [message.header.stamp for message in told] == [rospy.Time(0)]


@pytest.mark.parametrize(("hangs", "died"), [(False, False), (True, False), (False, True)])
def test_the_watchdog_is_kept_awake_while_somebody_decides_and_is_heard(
    hangs: bool, died: bool
) -> None:
    """Behind the end of either thread the robot's own watchdog has to end what runs."""
    node: Any = Node.__new__(Node)
    node._engine = SimpleNamespace(alive=not hangs)
    failure = RuntimeError("a value that no message can hold") if died else None
    node._publishing = SimpleNamespace(thread=SimpleNamespace(failure=failure))
    assert node._decides() == (not hangs and not died)


@pytest.mark.parametrize("died", ["publisher", "real"])
def test_the_node_no_longer_watches_once_a_thread_has_died(died: str) -> None:
    """A link that died never connects again: who supervises the node starts it anew."""
    failure = {died: RuntimeError("a value that no message can hold")}
    node: Any = Node.__new__(Node)
    node._engine = SimpleNamespace(running=True)
    thread = SimpleNamespace(failure=failure.get("publisher"))
    node._publishing = SimpleNamespace(thread=thread)
    node._real = SimpleNamespace(failure=failure.get("real"))
    node._watch()
