"""A scenario is repeated for what a busy machine may disturb, and what was missed is told.

What may never happen is final.
"""

from __future__ import annotations

import pytest
from harness.faults.rows import Row, repeated

GOOD = Row("cut", "found after [s]", 0.1, 0.05)
SLOW = Row("cut", "found after [s]", 0.1, 0.2)
WRONG = Row("cut", "lost", 0.0, 1.0, always=True)


class Looks:
    """A machine that stood still for so long [s], whatever the scene."""

    def __init__(self, gap: float) -> None:
        self.gap = gap

    def now(self) -> float:
        """Return the time; nothing here depends on it."""
        return 0.0

    def stood_still(self, since: float) -> float:
        """Return the gap, whatever the time."""
        return self.gap


LATE, IN_TIME = Looks(0.045), Looks(0.0)
WHY = "the machine stood still for 45 ms; "


def script(*outcomes: Row | str):
    """Return a scenario that ends in these ways, one after the other.

    With a row, or not as described.
    """
    coming = iter(outcomes)

    def measure() -> list[Row]:
        outcome = next(coming)
        if isinstance(outcome, str):
            raise AssertionError(outcome)
        return [outcome]

    return measure


def test_what_was_missed_is_told() -> None:
    """Both a broken limit and a wait in vain stand in the answer, in their order."""
    rows, missed = repeated(script(SLOW, "waited in vain", GOOD), looks=LATE)
    assert rows == [GOOD]
    assert missed == [WHY + SLOW.text, WHY + "not measured: waited in vain"]


def test_the_last_attempt_is_final() -> None:
    """After three the broken row stays."""
    rows, missed = repeated(script(SLOW, SLOW, SLOW, GOOD), looks=LATE)
    assert rows == [SLOW] and len(missed) == 2


def test_what_may_never_happen_is_not_tried_again() -> None:
    """A lost stop is lost."""
    assert repeated(script(WRONG, GOOD), looks=LATE) == ([WRONG], [])


def test_nothing_is_repeated_on_a_machine_that_was_in_time() -> None:
    """Then the limit is broken by the software, once is enough."""
    assert repeated(script(SLOW, GOOD), looks=IN_TIME) == ([SLOW], [])
    with pytest.raises(AssertionError, match="first"):
        repeated(script("first", GOOD), looks=IN_TIME)


def test_a_scenario_that_never_ends_as_described_fails() -> None:
    """The last reason is raised."""
    with pytest.raises(AssertionError, match="third"):
        repeated(script("first", "second", "third"), looks=LATE)
