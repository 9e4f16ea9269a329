"""What a recording without ground truth cannot see is bounded; no shift within shows more."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from twin_experiments.metrics.errors import Trace
from twin_experiments.metrics.needles import tool_speeds
from twin_experiments.metrics.unseen import UnseenDelay, unseen_delay
from twin_experiments.report.label.notes import unseen_note
from twin_experiments.report.run_reader_io import _clock_half_widths

from scara_msgs.msg import LinkState, TwinControllerState

RATE, SPEED = 1000.0, 1.2


def swings(delay: float = 0.0) -> Trace:
    """Return two tools that swing along x, the real one so late [s]; fastest SPEED [m/s]."""
    instants = np.arange(0.0, 2.0, 1.0 / RATE)
    real, twin = (
        np.stack([SPEED / 5.0 * np.sin(5.0 * (instants - late)), *2 * [0.0 * instants]], axis=1)
        for late in (delay, 0.0)
    )
    apart = 1e3 * np.linalg.norm(real - twin, axis=1)
    moving = np.ones(len(instants), dtype=bool)
    aligned: Any = SimpleNamespace(instants=instants, rate=RATE, segments=((0, len(instants)),))
    return Trace(aligned, real, twin, apart, moving, moving)


def bounds(half_widths: list[float], period: float = 0.008) -> UnseenDelay | None:
    """Return the bounds of readings that come once a period."""
    return unseen_delay(swings(), np.arange(0.0, 2.0, period), np.array(half_widths))


def test_a_reading_is_at_most_a_period_older_and_the_clock_counts_both_ways() -> None:
    """The worst of the experiment counts, unknown clocks do not."""
    found = bounds([0.001, 0.0015, float("inf")])
    assert found is not None
    assert found.bounds_ms == pytest.approx((-1.5, 9.5))
    assert found.speed == pytest.approx(SPEED, rel=1e-3)
    assert found.bounds_mm == pytest.approx((-1.5 * found.speed, 9.5 * found.speed))


@pytest.mark.parametrize("half_widths", [[], [float("inf")]], ids=["no state", "clock not known"])
def test_without_a_clock_nothing_is_promised(half_widths: list[float]) -> None:
    """No bound is better than a wrong one."""
    assert bounds(half_widths) is None


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_no_delay_within_the_bounds_moves_the_tools_further_apart_than_they_say(
    share: float,
) -> None:
    """Tools that are one by their stamps are so far apart at most, if the stamps are wrong."""
    found = bounds([0.0012])
    assert found is not None
    delay = found.earliest + share * (found.latest - found.earliest)
    low, high = found.bounds_mm
    assert swings(delay).deviation_mm.max() <= max(-low, high) + 1e-6
    assert swings(2.0 * found.latest).deviation_mm.max() > high


def test_an_instant_between_two_holes_has_no_speed() -> None:
    """A speed needs two; the others are those of the faster tool, one for each instant."""
    assert tool_speeds(swings(), slice(3, 4)).tolist() == [0.0]
    assert tool_speeds(swings(), slice(3, 5)) == pytest.approx([SPEED] * 2, rel=1e-3)


def test_the_clock_is_that_of_the_robot_while_it_is_connected() -> None:
    """Other links, and times without a robot, say nothing of it."""

    def state(connected: bool, half_width: float) -> TwinControllerState:
        links = [LinkState(name="real", connected=connected, clock_uncertainty=half_width)]
        return TwinControllerState(links=[LinkState(name="twin", connected=True), *links])

    told = [(10.0, state(True, 0.002)), (10.5, state(False, 9.0)), (11.0, state(True, 0.001))]
    bag: Any = SimpleNamespace(messages=lambda topic: told if topic.endswith("state") else [])
    times, half_widths = _clock_half_widths(bag, 10.0)
    assert times.tolist() == [0.0, 1.0] and half_widths.tolist() == [0.002, 0.001]


def test_the_note_says_time_speed_and_way() -> None:
    """All that a reader needs to judge a small error of a real robot."""
    note = unseen_note(UnseenDelay(-0.0015, 0.0095, 1.2))
    assert "from -1.5 to +9.5 ms" in note and "1.20 m/s" in note and "-1.8 to +11.4 mm" in note
