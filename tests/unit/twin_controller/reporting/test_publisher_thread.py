"""The thread that publishes for the engine: all that came, in order, with few wakes."""

from __future__ import annotations

import threading
import time

import pytest
import rospy
from harness.pair import SETUP
from harness.processes import wait_until
from twin_controller.core.events import Operator, Tick
from twin_controller.core.state import initial_state
from twin_controller.reporting import publisher_thread_node as publisher_thread
from twin_controller.reporting.publisher_thread_node import Batch, PublisherThread

STATE = initial_state(SETUP)
SINCE_1970 = 2_000_000_000


@pytest.fixture(autouse=True)
def _clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Give a ROS time to a process that is no node."""
    monkeypatch.setattr(rospy, "get_rostime", lambda: rospy.Time(SINCE_1970))


class Ears:
    """Keeps what is published; hangs on demand."""

    def __init__(self) -> None:
        self.calls: list[tuple[list[float], int]] = []
        self.go_on = threading.Event()
        self.go_on.set()

    def __call__(self, batches: list[Batch], lost: int) -> None:
        """Keep the times of the first inputs."""
        self.calls.append(([batch.events[0].now for batch in batches], lost))
        self.go_on.wait(10.0)

    @property
    def heard(self) -> list[float]:
        """All times, in the order in which they were published."""
        return [time for times, _ in self.calls for time in times]


def test_all_is_published_in_order_and_what_is_left_at_the_end() -> None:
    """The end is no reason to lose a decision."""
    ears = Ears()
    with PublisherThread(ears) as thread:
        for k in range(500):
            thread.stepped([Tick(float(k))], STATE, [])
    assert ears.heard == [float(k) for k in range(500)]


def test_a_batch_is_of_its_newest_input(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not of the moment at which the engine was done with it, nor of its last input in order."""
    monkeypatch.setattr(time, "monotonic", lambda: 100.5)
    found: list[Batch] = []
    with PublisherThread(lambda batches, lost: found.extend(batches)) as thread:
        thread.stepped([Tick(100.25), Operator(100.0, "STOP")], STATE, [])
        thread.stepped([], STATE, [])
    assert [batch.now for batch in found] == [100.25, 100.5]
    assert [batch.stamp.to_sec() - SINCE_1970 for batch in found] == [-0.25, 0.0]


def test_no_stamp_is_below_the_zero_of_a_simulated_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """It stands there until the first /clock; a negative stamp would end the controller."""
    monkeypatch.setattr(rospy, "get_rostime", lambda: rospy.Time(0))
    found: list[Batch] = []
    with PublisherThread(lambda batches, lost: found.extend(batches)) as thread:
        thread.stepped([Tick(0.0)], STATE, [])
    assert found[0].stamp == rospy.Time(0)


def test_what_comes_within_a_period_is_published_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each batch on its own would cost a wake and a message."""
    monkeypatch.setattr(publisher_thread, "PERIOD_S", 0.2)
    ears = Ears()
    begun = time.monotonic()
    with PublisherThread(ears) as thread:
        for k in range(60):
            thread.stepped([Tick(float(k))], STATE, [])
            time.sleep(0.01)
        lasted = time.monotonic() - begun
    assert len(ears.heard) == 60
    assert len(ears.calls) <= lasted / 0.2 + 2


def test_what_comes_after_a_silence_is_published_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A decision does not wait for a period that nobody uses."""
    monkeypatch.setattr(publisher_thread, "PERIOD_S", 0.001)
    ears = Ears()
    with PublisherThread(ears) as thread:
        time.sleep(0.05)
        monkeypatch.setattr(publisher_thread, "PERIOD_S", 5.0)
        thread.stepped([Tick(1.0)], STATE, [])
        wait_until(lambda: ears.heard, 2.5, "what came")
        monkeypatch.setattr(publisher_thread, "ENDING_S", 0.0)


def test_the_oldest_are_lost_and_counted_when_nobody_publishes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The engine never waits, and a replay sees the gap."""
    monkeypatch.setattr(publisher_thread, "MOST", 10)
    ears = Ears()
    ears.go_on.clear()
    with PublisherThread(ears) as thread:
        thread.stepped([Tick(0.0)], STATE, [])
        wait_until(lambda: ears.calls, 10.0, "a publisher that hangs")
        for k in range(1, 26):
            thread.stepped([Tick(float(k))], STATE, [])
        ears.go_on.set()
    assert ears.calls[0] == ([0.0], 0)
    assert ears.heard[1:] == [float(k) for k in range(16, 26)]
    assert sum(lost for _, lost in ears.calls) == 15


def test_what_is_lost_while_the_losses_are_told_is_told_next() -> None:
    """The engine counts at any moment, also between two steps of the publisher."""

    class Late(PublisherThread):
        """Counts a loss right after the publisher has looked, once."""

        lost = bumped = 0

        @property
        def _lost(self) -> int:
            found = self.lost
            if threading.current_thread() is self._thread and not self.bumped:
                self.bumped = 1
                self.lost += 1
            return found

        @_lost.setter
        def _lost(self, value: int) -> None:
            self.lost = value

    ears = Ears()
    with Late(ears) as thread:
        thread.stepped([Tick(0.0)], STATE, [])
        wait_until(lambda: ears.calls, 10.0, "the first batch")
        thread.stepped([Tick(1.0)], STATE, [])
    assert sum(lost for _, lost in ears.calls) == 1


def test_an_error_is_kept_for_the_node(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bug is never swallowed."""
    monkeypatch.setattr(threading, "excepthook", lambda arguments: None)

    def fail(batches: list[Batch], lost: int) -> None:
        raise RuntimeError("a bug")

    with PublisherThread(fail) as thread:
        thread.stepped([Tick(0.0)], STATE, [])
        wait_until(lambda: thread.failure is not None, 10.0, "the error")
    assert isinstance(thread.failure, RuntimeError)
