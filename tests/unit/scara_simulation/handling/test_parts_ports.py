"""How often the parts are told, often while one moves, seldom while all rest; and how."""

from __future__ import annotations

from collections import deque
from types import SimpleNamespace
from typing import Any, cast

import msgspec
import pytest
import rospy
from scara_config.palletise import find_palletise
from scara_ros.names import part_name
from scara_simulation.handling import parts_ports_node as parts_ports
from scara_simulation.handling.ledger import Happening
from scara_simulation.handling.part_bodies_io import PartShown
from scara_simulation.handling.part_world_io import PartsNow
from scara_simulation.handling.parts_ports_node import PartsPorts
from scara_simulation.handling.suction import Suction
from scara_simulation.joints.control import JointControl
from scara_simulation.simulation import Simulation, Timing
from visualization_msgs.msg import Marker

from scara_msgs.msg import PartEvent

PERIOD_S = parts_ports.PARTS_PERIOD_NS * 1e-9
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
REST = (
    PartShown("part_1", (0.5, 0.1, 0.02), UPRIGHT, False, "stand_1"),
    PartShown("part_2", (0.5, 0.2, 0.02), UPRIGHT, False, "stand_2"),
)


class Publisher:
    """Keeps what it is given, by topic."""

    told: dict[str, list[Any]]

    def __init__(self, topic: str, *_: Any, **__: Any) -> None:
        self._kept = self.told.setdefault(topic, [])

    def publish(self, message: Any) -> None:
        """Keep it."""
        self._kept.append(message)


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> dict[str, list[Any]]:
    """Return what is published, by topic."""
    Publisher.told = {}
    monkeypatch.setattr(rospy, "Publisher", Publisher)
    monkeypatch.setattr(rospy, "get_name", lambda: "/simulator")
    return Publisher.told


def publish_for(seconds: float, ports: PartsPorts, world: SimpleNamespace, begin: float) -> None:
    """Let a time pass, with a snapshot each 10 ms."""
    for k in range(round(seconds / 0.01)):
        stamp_ns = round((begin + 0.01 * k) * 1e9)
        ports.publish(cast(Any, [SimpleNamespace(stamp_ns=stamp_ns)]))
        if world.now.parts[0].position[0] != 0.5:  # it goes on moving, 0.2 mm each snapshot
            world.now = moved(world.now, 0.0002)


def moved(now: PartsNow, by: float) -> PartsNow:
    """Return the same with the first part elsewhere."""
    first, *others = now.parts
    x, y, z = first.position
    part = msgspec.structs.replace(first, position=(x + by, y, z))
    return msgspec.structs.replace(now, parts=[part, *others])


def test_parts_that_rest_are_told_once_a_second(told: dict[str, list[Any]]) -> None:
    """Noise below a tenth of a millimetre is rest too; each message is whole."""
    work = find_palletise()
    assert work is not None
    world = SimpleNamespace(now=PartsNow(list(REST), Suction(), 0, 0, "", ""), happened=[])
    ports = PartsPorts(cast(Any, world), work, "base_link")
    publish_for(4.0, ports, world, 100.0)
    assert 4 <= len(told["twin/parts"]) <= 5
    assert {len(message.markers) for message in told["twin/parts"]} == {2}
    noisy = msgspec.structs.replace(REST[0], position=(0.5, 0.100002, 0.02))
    world.now = msgspec.structs.replace(world.now, parts=[noisy, REST[1]])
    before = len(told["twin/parts"])
    publish_for(0.5, ports, world, 104.0)
    assert len(told["twin/parts"]) <= before + 1


def test_a_part_is_named_without_a_warning_of_rviz(told: dict[str, list[Any]]) -> None:
    """By its namespace: RViz warns of a text on a cylinder. Older recordings have the text."""
    work = find_palletise()
    assert work is not None
    world = SimpleNamespace(now=PartsNow(list(REST), Suction(), 0, 0, "", ""), happened=[])
    publish_for(0.1, PartsPorts(cast(Any, world), work, "base_link"), world, 100.0)
    markers = told["twin/parts"][0].markers
    assert [(marker.ns, marker.text) for marker in markers] == [("part_1", ""), ("part_2", "")]
    assert [part_name(marker) for marker in markers] == ["part_1", "part_2"]
    assert part_name(Marker(ns="parts", text="part_1")) == "part_1"


def test_a_part_that_moves_is_told_ten_times_a_second(told: dict[str, list[Any]]) -> None:
    """From its first tenth of a millimetre on, until it rests again."""
    work = find_palletise()
    assert work is not None
    world = SimpleNamespace(now=PartsNow(list(REST), Suction(), 0, 0, "", ""), happened=[])
    ports = PartsPorts(cast(Any, world), work, "base_link")
    publish_for(0.5, ports, world, 100.0)
    before = len(told["twin/parts"])
    world.now = moved(world.now, 0.001)
    publish_for(1.0, ports, world, 100.5)
    assert len(told["twin/parts"]) - before == pytest.approx(1.0 / PERIOD_S, abs=1)


def test_a_grip_is_told_at_once(told: dict[str, list[Any]]) -> None:
    """It changes the part's colour, not its place."""
    work = find_palletise()
    assert work is not None
    world = SimpleNamespace(now=PartsNow(list(REST), Suction(), 0, 0, "", ""), happened=[])
    ports = PartsPorts(cast(Any, world), work, "base_link")
    publish_for(0.55, ports, world, 100.0)
    before = len(told["twin/parts"])
    held = msgspec.structs.replace(REST[0], held=True)
    suction = msgspec.structs.replace(Suction(), commanded=True, held="part_1")
    world.now = msgspec.structs.replace(world.now, parts=[held, REST[1]], suction=suction)
    ports.publish(cast(Any, [SimpleNamespace(stamp_ns=100_550_000_000)]))
    assert len(told["twin/parts"]) == before + 1
    assert told["twin/parts"][-1].markers[0].color.r > 0.9


def test_an_event_has_the_time_of_its_step(
    told: dict[str, list[Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not that of the next snapshot; a world that was mounted anew counts its steps anew."""
    monkeypatch.setattr(rospy, "Service", lambda *_: None)
    still = SimpleNamespace(read=lambda: ([], []), step=lambda _: None, reset=lambda _: None)
    control, ms = JointControl([], [], [], 1e-3, None), 1_000_000
    simulation = Simulation(cast(Any, still), control, [], Timing(ms, 5000 * ms, 10, 10))
    gripped = Happening(PartEvent.GRIPPED, "part_1", "", "part_1 was gripped", (0.5, 0.1, 0.02))
    world = SimpleNamespace(now=PartsNow(list(REST), Suction(), 0, 0, "", ""), happened=deque())
    work = find_palletise()
    assert work is not None
    ports = PartsPorts(cast(Any, world), work, "base_link")
    ports.serve(cast(Any, SimpleNamespace(simulation=simulation)))
    for world.steps, step in ((10, 3), (20, 20), (2, 25)):
        world.happened.append((step, gripped))
        ports.publish(simulation.advance(10))
    stamps = [event.header.stamp.to_nsec() / ms for event in told["twin/part_events"]]
    assert stamps == [5003.0, 5020.0, 5030.0]
