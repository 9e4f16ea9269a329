"""What the stand-in publishes of its truth: nothing that nobody hears, and nothing out of date."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import rospy
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.emulator_node import GroundTruth
from fanuc_emulator.gripping import parts_truth_node
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.gripping.parts_truth_node import PartsTruth
from scara_config import load_robot
from scara_config.palletise import load_palletise

CONFIG = Path(__file__).parents[4] / "config"
ROBOT, WORK = load_robot(CONFIG), load_palletise(CONFIG)
EMULATOR, PROGRAMS = load_emulator(ROBOT, CONFIG), load_programs(ROBOT, CONFIG)
PERIOD_S = 0.002


class Topic:
    """Stands for a publisher: keeps what was published; the test says who listens."""

    def __init__(self, name: str, *_: object, **__: object) -> None:
        self.name = name
        self.listeners = 0
        self.messages: list[Any] = []

    def get_num_connections(self) -> int:
        """Return how many listen."""
        return self.listeners

    def publish(self, message: Any) -> None:
        """Keep a message."""
        self.messages.append(message)

    def take(self) -> list[Any]:
        """Return what came since the last call."""
        taken, self.messages = self.messages, []
        return taken


class Bench:
    """A robot with parts whose truth is published, in virtual time."""

    def __init__(self, topics: dict[str, Topic]) -> None:
        self.topics = topics
        self.parts = CellParts(WORK, ROBOT)
        self.controller = Controller(EMULATOR, ROBOT, PROGRAMS, 0.0, self.parts)
        self.controller.write_override(100)
        shown = PartsTruth(self.parts, WORK, ROBOT.base_frame)
        self.truth = GroundTruth(ROBOT, 2, threading.Event(), shown)
        self.truth.advertise()
        self.now = self.controller.snapshot()

    def run(self, seconds: float) -> None:
        """Let time pass."""
        for _ in range(round(seconds / PERIOD_S)):
            self.now = self.controller.step()
            self.truth.observe(self.now, self.now.tick * PERIOD_S)

    def take(self) -> dict[str, int]:
        """Return how many messages came on each topic since the last call."""
        return {name: len(topic.take()) for name, topic in self.topics.items()}


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    """Return a robot whose publishers are the test's, after its first messages."""
    topics: dict[str, Topic] = {}

    def advertise(name: str, *_: object, **__: object) -> Topic:
        return topics.setdefault(name, Topic(name))

    monkeypatch.setattr(rospy, "Publisher", advertise)
    monkeypatch.setattr(rospy, "Service", lambda *_: None)
    bench = Bench(topics)
    bench.run(0.1)
    assert bench.take() == {
        "real/ground_truth": 0,
        "real/plant": 1,
        "real/parts": 1,
        "real/gripper": 1,
        "real/part_events": 0,
    }
    return bench


def test_nothing_is_published_while_nobody_listens_and_nothing_changes(bench: Bench) -> None:
    """The latched messages of the beginning still hold."""
    bench.run(1.0)
    assert set(bench.take().values()) == {0}


@pytest.mark.parametrize(
    ("topic", "rate"), [("real/ground_truth", 250), ("real/gripper", 20), ("real/parts", 10)]
)
def test_listener_hears_the_promised_rate(bench: Bench, topic: str, rate: int) -> None:
    """From the moment it listens; the others stay silent."""
    bench.topics[topic].listeners = 1
    bench.run(2.0)
    heard = bench.take()
    assert heard.pop(topic) == pytest.approx(2 * rate, rel=0.05)
    assert set(heard.values()) == {0}


def test_ground_truth_is_the_snapshot_at_its_time(bench: Bench) -> None:
    """Positions, speeds and stamp of one servo step."""
    bench.topics["real/ground_truth"].listeners = 1
    bench.controller.write_input("rsr3", True)
    bench.run(0.2)
    last = bench.topics["real/ground_truth"].take()[-1]
    assert last.position == bench.now.positions and any(last.velocity)
    assert last.velocity == bench.now.velocities
    assert last.header.stamp.to_sec() == pytest.approx(bench.now.tick * PERIOD_S, abs=1e-9)


def until(bench: Bench, condition: Callable[[], bool]) -> None:
    """Let time pass until ``condition`` holds."""
    for _ in range(round(20.0 / PERIOD_S)):
        if condition():
            return
        bench.run(PERIOD_S)
    raise AssertionError("not within 20 s")


def test_late_listener_gets_what_is_true(bench: Bench) -> None:
    """With nobody there a part is gripped, carried and lost: the last messages say so."""
    bench.controller.write_input("rsr4", True)
    until(bench, lambda: bench.now.outputs.vacuum)
    bench.run(0.5)
    gripper, parts = (bench.topics[name] for name in ("real/gripper", "real/parts"))
    assert gripper.messages[-1].holding and gripper.messages[-1].part == "part_1"
    bench.controller.write_input("hold", False)
    bench.run(1.0)
    bench.controller.write_input("gripper", False)
    bench.run(0.2)
    last = gripper.messages[-1]
    assert (last.commanded, last.holding, last.drops) == (False, False, 1)
    kinds = [event.kind for event in bench.topics["real/part_events"].messages]
    assert kinds == ["gripped", "released", "dropped"]
    assert not [marker.text for marker in parts.messages[-1].markers if marker.text]
    shown = {marker.ns: marker.pose.position for marker in parts.messages[-1].markers}
    for part in bench.parts.parts:
        x, y, z = bench.parts.place(part)
        place = shown[part.name]
        assert (place.x, place.y, place.z - 0.01) == pytest.approx((x, y, z), abs=1e-12)


def test_what_happened_before_a_roscore_came_has_the_time_at_which_it_happened(
    bench: Bench,
) -> None:
    """The stand-in works from its start; who listens later is told when it was."""
    publisher, bench.truth._publisher = bench.truth._publisher, None
    bench.controller.write_input("rsr4", True)
    until(bench, lambda: bench.now.outputs.vacuum)
    gripped = bench.now.tick * PERIOD_S
    bench.run(0.5)
    bench.truth._publisher = publisher
    bench.run(0.1)
    (event,) = bench.topics["real/part_events"].messages
    assert event.kind == "gripped"
    assert event.header.stamp.to_sec() == pytest.approx(gripped, abs=2 * PERIOD_S)


def test_a_wish_that_was_given_up_is_not_done_later(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Who asked was told that nothing is done, and it stays so."""
    monkeypatch.setattr(parts_truth_node, "_ANSWER_S", 0.01)
    shown, done = bench.truth._parts, []
    assert shown is not None
    answer = shown._ask(lambda: done.append("late") or "")
    assert answer == "no answer of the servo loop within 0.01 s: nothing is done"
    bench.run(0.1)
    assert done == []
