"""What became of a motion is in the journal, beside what was predicted."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from cell_recorder.journal.entries import outcome_entry


@dataclass
class Said:
    """A message's fields."""

    what: str = "MOVE (0.5, 0.1, 0.1)"
    end: str = "reached"
    time_predicted: float = 1.5
    time_measured: float = 1.52
    way_predicted: float = 0.61
    way_measured: float = 0.612
    drift: str = ""


@pytest.mark.parametrize(("drift", "success"), [("", True), ("moving time is off", False)])
def test_outcome_is_written_with_both_numbers(drift: str, success: bool) -> None:
    """An entry without success is what somebody looks for."""
    entry = outcome_entry(Said(drift=drift))
    assert entry.who == "what_if" and entry.what == "predicted: MOVE (0.5, 0.1, 0.1)"
    assert entry.outcome.startswith(
        "reached: 1.52 s, predicted 1.50 s; 0.612 m of the tool, predicted 0.610 m"
    )
    assert entry.success is success and entry.outcome.endswith(drift)
