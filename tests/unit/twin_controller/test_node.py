"""The node publishes samples at any time, and ends with what it cannot do without."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
import rospy
from harness.opponents.memory_robot import STANDS
from harness.pair import HOME, SETUP, idle_pair, ramp, shifted
from sensor_msgs.msg import JointState
from twin_controller.core.events import RealMeasured
from twin_controller.reporting.publisher_thread_node import Batch
from twin_controller.reporting.publishing_node import Publishing
from twin_controller.twin_controller_node import Node


def published(batch: Batch) -> list[JointState]:
    """Return what is published of a batch for who records the real robot."""
    told: list[JointState] = []
    publishing: Any = Publishing.__new__(Publishing)
    publishing._setup = SETUP
    publishing._joints = SimpleNamespace(get_num_connections=lambda: 1, publish=told.append)
    publishing._publish_samples(batch)
    return told


def test_a_sample_older_than_simulated_time_has_the_stamp_zero() -> None:
    """No ROS time is negative: such a stamp would end the controller."""
    pair = idle_pair()
    last = pair.state.sides.real.last
    at = pair.now
    sample = RealMeasured(at, sent=at, received=at, clock_ms=0, motion=last)
    batch = Batch([sample], pair.state, [], last.time + 0.005, rospy.Time(0))
    assert [message.header.stamp for message in published(batch)] == [rospy.Time(0)]


def test_readings_that_are_taken_at_once_have_each_its_own_stamp_and_speeds() -> None:
    """Who records keeps the first of equal stamps: an old position would count as a new one."""
    pair = idle_pair()
    pair.start_program(ramp(HOME, shifted(HOME, 20.0, -30.0, 40.0, 10.0), 1.0), run=0.3)
    heard = [event for event in pair.inputs if isinstance(event, RealMeasured)]
    # The robot tells no speeds.
    older, newer = (
        msgspec.structs.replace(each, motion=msgspec.structs.replace(each.motion, qdot=()))
        for each in heard[-2:]
    )
    first, second = published(Batch([older, newer], pair.state, [], pair.now, rospy.Time(100)))
    apart = (second.header.stamp - first.header.stamp).to_sec()
    assert apart == pytest.approx(1e-3 * (newer.clock_ms - older.clock_ms), abs=1e-4)
    assert 0.0 < 100.0 - second.header.stamp.to_sec() < 0.02
    for message, event, known in zip((first, second), (older, newer), heard[-2:]):
        assert message.position == list(event.motion.q)
        assert message.velocity == list(known.motion.qdot)
    # The core took no such reading in: nobody knows its instant.
    unknown = msgspec.structs.replace(newer, motion=msgspec.structs.replace(newer.motion, q=HOME))
    assert not published(Batch([unknown], pair.state, [], pair.now, rospy.Time(100)))


@pytest.mark.parametrize("told", [None, True, False])
def test_a_robot_that_does_not_tell_of_its_pendant_is_of_no_known_mode(told: bool | None) -> None:
    """A map of who follows has no signals: nothing would say that it is automatic."""
    publishing: Any = Publishing.__new__(Publishing)
    publishing._status = SimpleNamespace()
    publishing._data_pace = SimpleNamespace(is_due=lambda *_: False)
    sample = msgspec.structs.replace(STANDS, pendant_enabled=told)
    publishing.robot_data(sample, "", "", 0)
    assert publishing._status.pendant_enabled is told


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
