"""What the link's node shows of the cell's topics, without a master."""

from __future__ import annotations

import threading
import time
from io import BytesIO
from types import SimpleNamespace
from typing import Any

import pytest
import rospy
from farm.config import load_farm
from farm.link.link_node import CellTopics
from farm.wire import CellState, Joints
from harness.workspace import ROOT
from msgspec.structs import replace
from sensor_msgs.msg import JointState

from scara_msgs.msg import TwinControllerState


class Bus:
    """Stands for the cell's link: what it knows of the switch."""

    remote = True

    def show(self, state: CellState) -> None:
        """Take the switch from a state."""
        self.switch(state.remote)

    def switch(self, remote: bool) -> None:
        """Take the switch."""
        self.remote = remote


@pytest.fixture
def topics(monkeypatch: pytest.MonkeyPatch) -> CellTopics:
    """Give the node's topics without ROS; the farm may move the cell."""
    for name in ("Publisher", "Service", "Subscriber"):
        monkeypatch.setattr(rospy, name, lambda *_, **__: None)
    config = load_farm(ROOT / "config")
    return CellTopics(replace(config, link=replace(config.link, remote_at_start=True)))


def test_a_dead_controller_is_silent_when_the_clock_is_set_back(
    topics: CellTopics, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And when it is put forward a live one is none."""
    buffer, heard = BytesIO(), time.monotonic()
    TwinControllerState(mode=TwinControllerState.IDLE).serialize(buffer)
    monkeypatch.setattr(time, "monotonic", lambda: heard)
    topics._keep(SimpleNamespace(_buff=buffer.getvalue()))  # type: ignore[arg-type]
    now = time.time()
    assert topics._state(now + 3600.0).mode == TwinControllerState.IDLE
    monkeypatch.setattr(time, "monotonic", lambda: heard + 10.0)
    for back in (0.0, 10.0, 3600.0):
        assert "silent for 10 s" in topics._state(now - back).why


def test_a_switch_that_is_turned_off_stays_off(
    topics: CellTopics, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A state that was made just before does not turn it on: somebody steps to the robot."""
    bus: Any = Bus()
    off = SimpleNamespace(data=False, _connection_header={})
    turning = threading.Thread(target=topics._switch, args=(off,))
    make = topics._state

    def made_before(now: float) -> CellState:
        state = make(now)
        turning.start()
        turning.join(0.1)
        return state

    monkeypatch.setattr(topics, "_state", made_before)
    shutdown = iter([False, True])
    monkeypatch.setattr(rospy, "is_shutdown", lambda: next(shutdown))
    topics.run(bus)
    turning.join()
    assert not bus.remote


def test_joints_of_a_side_that_is_not_heard_are_not_sent(
    topics: CellTopics, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside those of the other side they would look as if they were of now."""
    sent: list[Joints] = []
    bus: Any = SimpleNamespace(show_joints=sent.append)

    def show(now: float, *heard: str) -> None:
        monkeypatch.setattr(time, "monotonic", lambda: now)
        for side in heard:
            topics._keep_joints(JointState(name=["joint_1"], position=[now]), side)
        topics._show_joints(bus)

    show(10.0, "real", "twin")
    show(12.0, "twin")
    show(14.0)
    first, then = {"joint_1": 10.0}, {"joint_1": 12.0}
    assert [(one.real, one.twin) for one in sent] == [(first, first), ({}, then)]
