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
        fake = SimpleNamespace(
            monotonic=lambda: self.now, time=lambda: self.now + self.offset, sleep=time.sleep
        )
        monkeypatch.setattr("scara_control.motion.wiring_node.time", fake)
        monkeypatch.setattr(rospy, "get_param", lambda name, default: simulated)
        self.clock = MotionClock()

    def stamp(self, ago: float = 0.0) -> rospy.Time:
        """Return the stamp of a message that was sent some time ago [s]."""
        return rospy.Time.from_sec(self.now - ago + self.offset)


def test_a_stamp_says_when_a_message_was_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the clock by which stops are judged, and there and back again."""
    clocks = Clocks(monkeypatch)
    assert clocks.clock.asked(clocks.stamp(0.25)) == pytest.approx(999.75, abs=1e-5)
    assert clocks.clock.asked(clocks.clock.stamp(999.5)) == pytest.approx(999.5, abs=1e-5)
    assert clocks.clock.asked(rospy.Time()) == 0.0


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
