"""What a stamp of a message says of when it was sent."""

from __future__ import annotations

import time
from types import SimpleNamespace

import pytest
import rospy
from scara_control.motion.wiring_node import MotionClock


class Clocks:
    """The system's clock and the monotonic one, in the test's hand."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, simulated: bool = False) -> None:
        """Begin; no ROS master is asked."""
        self.now, self.offset = 1000.0, 1.7e9
        self.held: list[float] = []
        fake = SimpleNamespace(monotonic=self._monotonic, time=self._time, sleep=time.sleep)
        monkeypatch.setattr("scara_control.motion.wiring_node.time", fake)
        monkeypatch.setattr(rospy, "get_param", lambda name, default: simulated)
        self.clock = MotionClock()

    def _monotonic(self) -> float:
        """Look at the clock; ``held`` says for how long the process stands still before looks."""
        self.now += self.held.pop(0) if self.held else 0.0
        return self.now

    def _time(self) -> float:
        return self._monotonic() + self.offset

    def stamp(self, ago: float = 0.0) -> rospy.Time:
        """Return the stamp of a message that was sent some time ago [s]."""
        return rospy.Time.from_sec(self.now - ago + self.offset)


def test_a_stamp_says_when_a_message_was_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the clock by which stops are judged, and there and back again."""
    clocks = Clocks(monkeypatch)
    assert clocks.clock.asked(clocks.stamp(0.25)) == pytest.approx(999.75, abs=1e-5)
    assert clocks.clock.asked(clocks.clock.stamp(999.5)) == pytest.approx(999.5, abs=1e-5)
    assert clocks.clock.asked(rospy.Time()) == 0.0


@pytest.mark.parametrize("held", [(0.0, 0.1), (0.0, 0.0, 0.1), (0.0, 0.1, 0.0, 0.0, 0.05, 0.0)])
def test_who_is_held_between_two_looks_tells_the_same_time(
    held: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a busy machine set points would be stamped for later or sooner than they are meant."""
    clocks = Clocks(monkeypatch)
    clocks.held = list(held)
    assert clocks.clock.offset() == pytest.approx(1.7e9, abs=1e-5)
    assert not clocks.held


@pytest.mark.parametrize("step", [-3600.0, -0.1, 0.1, 3600.0])
def test_no_stamp_is_believed_right_after_the_clock_was_set(
    step: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Set back by a little, an old stamp would look newer than a stop."""
    clocks = Clocks(monkeypatch)
    sent = clocks.stamp()
    clocks.now, clocks.offset = clocks.now + 0.3, clocks.offset + step
    assert clocks.clock.asked(sent) == 0.0
    clocks.now += 1.0
    assert clocks.clock.asked(clocks.stamp()) == 0.0
    clocks.now += 1.5
    assert clocks.clock.asked(clocks.stamp()) == pytest.approx(clocks.now, abs=1e-5)


def test_simulated_time_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """It runs by itself."""
    clocks = Clocks(monkeypatch, simulated=True)
    assert clocks.clock.asked(clocks.stamp()) == 0.0
