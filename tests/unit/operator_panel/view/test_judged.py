"""What the page says of the judge: how near bodies come, how well a motion was predicted."""

from __future__ import annotations

import pytest
from operator_panel.door import Answer
from operator_panel.retelling.taking import with_outcome
from operator_panel.view.judged import (
    JUDGE,
    SIGN_OF_LIFE_S,
    gate_text,
    made_text,
    preview_refusal,
    sentence_of,
)
from operator_panel.view.snapshot import Diagnosis, Snapshot
from scara_ros.diagnosis import Level

from scara_msgs.msg import MotionOutcome


@pytest.mark.parametrize(
    ("end", "predicted", "measured", "said"),
    [
        (
            MotionOutcome.REACHED,
            1.5,
            1.52,
            "Last motion: 1.52 s, predicted 1.50 s (+1.3 %).",
        ),
        (
            MotionOutcome.REACHED,
            2.0,
            1.9,
            "Last motion: 1.90 s, predicted 2.00 s (\N{MINUS SIGN}5.0 %).",
        ),
        (MotionOutcome.REACHED, 0.0, 0.1, "Last motion: 0.10 s, predicted 0.00 s."),
        (
            MotionOutcome.STOPPED,
            2.0,
            0.4,
            "Last motion: stopped on the way, so nothing to compare.",
        ),
    ],
)
def test_last_motion_is_told_with_both_times(
    end: str, predicted: float, measured: float, said: str
) -> None:
    """What came to its target; what did not teaches nothing."""
    message = MotionOutcome(end=end, time_predicted=predicted, time_measured=measured)
    assert made_text(with_outcome(Snapshot(), message)) == said


@pytest.mark.parametrize(
    ("clearance", "said"),
    [
        (0.0616, ", nearest 62 mm between link_2 and part_1"),
        (0.0016, ", nearest 1.6 mm between link_2 and part_1"),
        (-1.0, ""),
    ],
)
def test_clearance_is_told_as_it_was_measured(clearance: float, said: str) -> None:
    """It is no bound, and below 10 mm a tenth counts."""
    values = {"cause": "", "clearance": clearance, "clearance_between": ["link_2", "part_1"]}
    assert sentence_of(Answer(True, "OK: takes 1.20 s", values)) == f"OK: takes 1.20 s{said}"


def test_nothing_is_said_before_the_first_motion() -> None:
    """An empty place takes no room."""
    assert made_text(Snapshot()) == ""


@pytest.mark.parametrize(
    ("said", "now", "runs"),
    [
        ({}, 0.0, False),
        ({"what_if: predictions": 9.9}, 10.0, False),
        ({JUDGE: 9.9}, 10.0, True),
        ({f"/cell_2/{JUDGE}": 9.9}, 10.0, True),
        ({JUDGE: 10.0}, 10.0 + SIGN_OF_LIFE_S, False),
    ],
    ids=["never", "another status", "now", "of another cell's name", "silent since"],
)
def test_preview_is_refused_with_the_command_that_starts_a_judge(
    said: dict[str, float], now: float, runs: bool
) -> None:
    """Where none runs, or none has said anything for a while."""
    found = {name: Diagnosis(Level.OK, name, "", when) for name, when in said.items()}
    snapshot = Snapshot(diagnoses=found, gate="refuse")
    refused = preview_refusal(snapshot, now)
    assert (refused == "") is runs
    if not runs:
        assert refused.endswith("To start one: source env.sh; rosrun what_if what_if")
    assert gate_text(snapshot, now)[0].startswith("Judge runs" if runs else "No judge runs")
