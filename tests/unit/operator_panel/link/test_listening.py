"""What comes all the time is read seldom while no page is open."""

from __future__ import annotations

import threading
import time
from datetime import datetime

import pytest
import rospy
from operator_panel.link import listening_node as listening
from operator_panel.link.listening_node import Listening
from scara_config import load_robot

from scara_msgs.msg import Decision


@pytest.fixture
def ears(monkeypatch: pytest.MonkeyPatch) -> Listening:
    """Return a listener that would hold the next message back for ever."""
    monkeypatch.setattr(listening, "UNWATCHED_S", 60.0)
    return Listening(load_robot())


def test_a_message_is_taken_before_the_next_is_held_back(ears: Listening) -> None:
    """The newest is known at once, and a page that opens ends the holding."""
    taken: list[str] = []
    reader = threading.Thread(target=lambda: ears._seldom(taken.append)("first"), daemon=True)
    reader.start()
    while not taken:
        time.sleep(0.001)
    assert reader.is_alive()
    ears.watch(True)
    reader.join(30.0)
    assert not reader.is_alive()


def test_all_is_read_while_a_page_is_open(ears: Listening) -> None:
    """Nothing is held back."""
    ears.watch(True)
    taken: list[int] = []
    take = ears._seldom(taken.append)
    begun = time.monotonic()
    for number in range(3):
        take(number)
    assert taken == [0, 1, 2]
    assert time.monotonic() - begun < 30.0


def test_a_decision_that_is_seen_after_midnight_keeps_its_day(ears: Listening) -> None:
    """The day is told when it was made, not when it came."""
    made = Decision()
    made.header.stamp = rospy.Time.from_sec(datetime(2026, 3, 1, 23, 59, 59, 500_000).timestamp())
    ears._decision(made)
    (told,) = ears.snapshot().decisions
    assert told.time == "2026-03-01T23:59:59"
