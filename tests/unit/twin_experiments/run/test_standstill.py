"""Whether both sides stand still."""

from __future__ import annotations

import pytest
from twin_experiments.run.standstill import Activity, observe, still_for

THRESHOLDS = [0.1, 0.1]


def watch(samples: list[tuple[float, float]]) -> Activity:
    """Feed times and speeds of the second joint."""
    activity = Activity()
    for now, speed in samples:
        activity = observe(activity, now, [0.0, speed], THRESHOLDS)
    return activity


def test_a_side_stands_still_since_its_last_motion() -> None:
    """Either direction counts as motion."""
    side = watch([(1.0, 0.0), (2.0, -0.5), (2.5, 0.05), (3.0, 0.0)])
    assert still_for([side], 3.0, 0.5) == pytest.approx(1.0)


def test_both_sides_must_stand_still() -> None:
    """The later one decides."""
    assert still_for(
        [watch([(1.0, 1.0), (4.0, 0.0)]), watch([(3.0, 1.0), (4.0, 0.0)])], 4.0, 0.5
    ) == pytest.approx(1.0)


@pytest.mark.parametrize("silent", [Activity(), watch([(1.0, 0.0)])])
def test_a_silent_side_does_not_stand_still(silent: Activity) -> None:
    """No data is no standstill."""
    assert still_for([silent, watch([(1.0, 0.0), (9.0, 0.0)])], 9.0, 0.5) == 0.0


def test_a_side_that_was_never_seen_moving_stands_still_since_its_first_sample() -> None:
    """What was before it appeared is unknown."""
    assert still_for([watch([(5.0, 0.0), (5.3, 0.0)])], 5.3, 0.5) == pytest.approx(0.3)


def test_moves_are_counted_when_they_begin_after_a_standstill() -> None:
    """A speed that touches zero within a move starts no new one."""
    assert (
        watch([(0.0, 0.0), (1.0, 1.0), (1.1, 0.0), (1.15, 1.0), (2.0, 0.0), (3.0, 1.0)]).moves == 2
    )
