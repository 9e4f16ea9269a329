"""A scenario is repeated for what a busy machine may disturb, and what was missed is told; what may never happen is final."""

from __future__ import annotations

import pytest
from harness.faults.rows import Row, repeated

GOOD = Row("cut", "found after [s]", 0.1, 0.05)
SLOW = Row("cut", "found after [s]", 0.1, 0.2)
WRONG = Row("cut", "lost", 0.0, 1.0, always=True)


def script(*outcomes: Row | str):
    """Return a scenario that ends in these ways, one after the other: with a row, or not as described."""
    coming = iter(outcomes)

    def measure() -> list[Row]:
        outcome = next(coming)
        if isinstance(outcome, str):
            raise AssertionError(outcome)
        return [outcome]

    return measure


def test_what_was_missed_is_told() -> None:
    """Both a broken limit and a wait in vain stand in the answer, in their order."""
    rows, missed = repeated(script(SLOW, "waited in vain", GOOD))
    assert rows == [GOOD]
    assert missed == [SLOW.text, "not measured: waited in vain"]


def test_the_last_attempt_is_final() -> None:
    """After three the broken row stays."""
    rows, missed = repeated(script(SLOW, SLOW, SLOW, GOOD))
    assert rows == [SLOW] and len(missed) == 2


def test_what_may_never_happen_is_not_tried_again() -> None:
    """A lost stop is lost."""
    assert repeated(script(WRONG, GOOD)) == ([WRONG], [])


def test_a_scenario_that_never_ends_as_described_fails() -> None:
    """The last reason is raised."""
    with pytest.raises(AssertionError, match="third"):
        repeated(script("first", "second", "third"))
