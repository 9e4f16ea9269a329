"""Deadlines: every step once, stalls bounded, statistics right."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scara_simulation.real_time import PhysicsPace, WakeTimes

MS = 1_000_000


def test_each_wake_runs_what_is_due():
    """Late wakes catch up, early ones do nothing."""
    pace = PhysicsPace(MS, 1.0, 50 * MS, 0)
    assert [pace.due(t * MS // 10)[0] for t in (5, 10, 20, 21, 55)] == [0, 1, 1, 0, 3]


def test_long_stall_is_skipped_and_counted():
    """More than the allowed catch-up is never run in a burst."""
    pace = PhysicsPace(MS, 1.0, 50 * MS, 0)
    assert pace.due(1000 * MS) == (50, 950)
    assert pace.due(1002 * MS) == (2, 0)
    assert pace.skipped_steps == 950


@pytest.mark.parametrize(("factor", "steps"), [(2.0, 20), (0.5, 5)])
def test_real_time_factor_stretches_the_deadlines(factor, steps):
    """Twice real time makes twice the steps."""
    assert PhysicsPace(MS, factor, 50 * MS, 0).due(10 * MS)[0] == steps


@pytest.mark.parametrize(("factor", "most"), [(0.5, 50), (1.0, 50), (50.0, 2500)])
def test_stall_is_made_up_for_by_real_time_where_simulated_time_is_faster(factor, most):
    """A wake of 50 times real time alone has more steps than a stall of 50 ms at real time."""
    pace = PhysicsPace(MS, factor, 50 * MS, 0)
    assert pace.due(1000 * MS) == (most, 1000 * factor - most)


@given(st.lists(st.integers(0, 30 * MS), max_size=50))
def test_no_step_is_lost_or_made_twice(waits):
    """Made and skipped steps together are the time that has passed."""
    pace, now, made = PhysicsPace(MS, 1.0, 10 * MS, 7), 7, 0
    for wait in waits:
        now += wait
        made += pace.due(now)[0]
    assert made + pace.skipped_steps == (now - 7) // MS


def test_pause_is_not_made_up_for():
    """After a pause the steps go on with the next one; those made by hand count."""
    pace = PhysicsPace(MS, 1.0, 50 * MS, 0)
    pace.due(10 * MS)
    assert pace.restart(1010 * MS, steps_made=100) == 900
    assert pace.due(1011 * MS) == (1, 0)
    assert pace.skipped_steps == 0


def test_more_steps_by_hand_than_the_pause_held_are_waited_for():
    """Simulated time never runs backwards."""
    pace = PhysicsPace(MS, 1.0, 50 * MS, 0)
    assert pace.restart(10 * MS, steps_made=15) == 0
    assert [pace.due(t * MS)[0] for t in (12, 15, 16)] == [0, 0, 1]


def test_lateness_is_told_by_percentiles():
    """The median, the 99th of a hundred and the largest."""
    deadlines = WakeTimes(2 * MS, 0)
    for k in range(1, 101):
        deadlines.woke(2 * MS * k + k * 1000)
    report = deadlines.report()
    assert (report.wakes, report.missed) == (100, 0)
    assert (report.p50_ms, report.p99_ms, report.max_ms) == pytest.approx((0.050, 0.099, 0.100))
    assert deadlines.report().wakes == 0


def test_overslept_deadlines_are_missed_and_the_next_is_in_the_future():
    """Deadlines are absolute: one late wake does not shift those that follow."""
    deadlines = WakeTimes(2 * MS, 0)
    deadlines.woke(9 * MS)
    assert deadlines.report().missed == 3
    assert deadlines.wait_ns(9 * MS) == 1 * MS
    assert deadlines.wait_ns(11 * MS) == 0
