"""What a running cell's topics make of the world: nobody whom a sensor sees is lost."""

from __future__ import annotations

import math
from typing import Any
from unittest.mock import Mock

import pytest
import rospy
from geometry_msgs.msg import Point, PointStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from what_if.live_world_node import JOINTS, PEOPLE, PERSON_S, LiveWorld
from what_if.world import World

NEAR, FAR = (0.5, 0.6, 0.0), (4.0, 0.0, 0.0)


class Topics:
    """The topics of a cell without a master."""

    def __init__(self, world: World, monkeypatch: pytest.MonkeyPatch) -> None:
        """Listen; nothing was heard but the joints."""
        monkeypatch.setattr(rospy, "Subscriber", Mock())
        self.live = LiveWorld(world, Mock())
        self.live.is_idle = lambda: False

    def sighting(self, sender: str, place: tuple[float, ...], frame: str = "base_link") -> None:
        """Let a sender say where somebody is."""
        message = PointStamped(header=Header(frame_id=frame), point=Point(*place))
        message._connection_header = {"callerid": sender}
        self.live._keep(message, PEOPLE)

    def people(self) -> Any:
        """Return who is in the world now."""
        self.live._keep(JointState(), JOINTS)
        world = self.live.now()
        assert world is not None
        return world.people


@pytest.fixture
def topics(world: World, monkeypatch: pytest.MonkeyPatch) -> Topics:
    """Somebody beside the arm is seen by a sensor."""
    found = Topics(world, monkeypatch)
    found.sighting("/camera_a", NEAR)
    assert found.people() == (NEAR,)
    return found


@pytest.mark.parametrize(
    ("sender", "place", "frame"),
    [
        ("/camera_b", FAR, "base_link"),
        ("/camera_a", (math.nan, 0.6, 0.0), "base_link"),
        ("/camera_a", FAR, "cell_2/base_link"),
        ("/camera_a", FAR, ""),
    ],
)
def test_what_is_said_after_it_takes_nobody_away(
    topics: Topics, sender: str, place: tuple[float, ...], frame: str
) -> None:
    """Another sensor, a lost track, another cell's frame."""
    topics.sighting(sender, place, frame)
    assert NEAR in topics.people()
    assert all(map(math.isfinite, sum(topics.people(), ())))
    assert (FAR in topics.people()) is (sender == "/camera_b")


def test_a_sensor_says_where_its_person_went_and_forgets_after_a_while(
    topics: Topics, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its newest sighting counts, for so long."""
    topics.sighting("/camera_a", FAR)
    assert topics.people() == (FAR,)
    monkeypatch.setattr("what_if.live_world_node.PERSON_S", -PERSON_S)
    assert topics.people() == ()
