"""Publish at a rate, and at once when what is shown changes."""

from __future__ import annotations

import pytest
from scara_ros.pacing import Pace


def test_the_first_question_is_due() -> None:
    """Also with nothing to show."""
    assert Pace(1.0).is_due(100.0)


def test_the_same_is_due_again_after_a_period() -> None:
    """Not before."""
    pace = Pace(0.5)
    assert [pace.is_due(0.25 * k, "a") for k in range(5)] == [True, False, True, False, True]


def test_the_same_instant_is_due_once() -> None:
    """Whatever the rounding of the sum of now and period."""
    pace = Pace(0.1)
    assert [pace.is_due(1e5, "a") for _ in range(3)] == [True, False, False]


def test_a_change_is_due_at_once_and_begins_a_new_period() -> None:
    """The next one follows a period after the change."""
    pace = Pace(1.0)
    asked = [(0.0, "a"), (0.5, "b"), (1.0, "b"), (1.5, "b")]
    assert [pace.is_due(*question) for question in asked] == [True, True, False, True]


def test_a_change_back_counts_as_one() -> None:
    """What was shown last counts, not what was shown once."""
    pace = Pace(10.0)
    assert [pace.is_due(0.1 * k, shown) for k, shown in enumerate("aba")] == [True] * 3


def test_a_clock_that_runs_back_is_due() -> None:
    """A simulation that was reset must not be silent until its clock has caught up."""
    pace = Pace(1_000)
    assert [pace.is_due(now) for now in (5_000, 5_000, 200, 300)] == [True, False, True, False]


@pytest.mark.parametrize("now", [0.1, 0.9])
def test_hurry_makes_the_next_question_due(now: float) -> None:
    """For a listener that has just come."""
    pace = Pace(1.0)
    assert pace.is_due(0.0)
    pace.hurry()
    assert pace.is_due(now) and not pace.is_due(now)
