"""Set points look ahead by the delay of the robot that follows."""

from __future__ import annotations

import math

import pytest
from harness.opponents.ideal_twin import CONFIG, DT, Bench


def test_set_points_look_ahead_by_the_delay_of_the_follower():
    """A robot that is 0.15 s late is announced a move 0.15 s earlier, and told as much more."""
    bench = Bench()
    bench.core.look_ahead(0.15)
    bench.move()
    bench.tick(round((CONFIG.move.announce + 0.15) / DT))
    assert set(bench.states[1:-1]) == {"announcing"}
    bench.tick()
    assert bench.states[-1] == "moving"
    assert len(bench.packets[0].points) == round((CONFIG.move.horizon + 0.15) / DT) + 1


@pytest.mark.parametrize(("said", "believed"), [(math.nan, 0.0), (-1.0, 0.0), (7.0, 0.5)])
def test_a_follower_that_cannot_be_is_not_believed(said, believed):
    """No move waits for ever."""
    bench = Bench()
    bench.core.look_ahead(said)
    bench.move()
    bench.tick()
    assert len(bench.packets[-1].points) == round((CONFIG.move.horizon + believed) / DT) + 1


def test_a_cap_keeps_what_a_late_follower_was_promised():
    """Whatever was promised for the time of its delay comes; then the move is slower."""
    bench = Bench()
    bench.core.look_ahead(0.15)
    bench.move(percent=100.0)
    bench.tick(30)
    promised = dict(zip(bench.packets[-1].times, bench.packets[-1].points))
    capped = bench.now
    bench.core.limit_speed(20.0, capped)
    bench.tick(40)
    come = {packet.times[0]: packet.points[0] for packet in bench.packets}
    kept = [time for time in promised if time <= capped + 0.15 - DT]
    assert len(kept) >= 14
    for time in kept:
        assert come[min(come, key=lambda at: abs(at - time))].q == pytest.approx(promised[time].q)
    assert bench.report.speed_applied_percent == pytest.approx(20.0)


@pytest.mark.parametrize(("percent", "waits"), [(10.0, 0.05), (40.0, 0.05 + 0.1)])
def test_a_higher_cap_waits_for_what_the_follower_was_given_ahead(percent, waits):
    """It would be faster than what it has already; a lower one waits for its delay alone."""
    bench = Bench()
    bench.core.look_ahead(0.05, 0.1)
    bench.core.limit_speed(20.0, bench.now)
    bench.move(percent=100.0)
    bench.tick(60)
    assert bench.report.speed_applied_percent == pytest.approx(20.0)
    changed = bench.now
    bench.core.limit_speed(percent, changed)
    while bench.report.speed_applied_percent == pytest.approx(20.0):
        bench.tick()
    assert bench.now - changed == pytest.approx(waits, abs=1.5 * DT)
