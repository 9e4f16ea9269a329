"""What the page says of the judge: how well the last motion was predicted."""

from __future__ import annotations

import pytest
from operator_panel.retelling.taking import with_outcome
from operator_panel.view.preview.judged import made_text
from operator_panel.view.snapshot import Snapshot

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


def test_nothing_is_said_before_the_first_motion() -> None:
    """An empty place takes no room."""
    assert made_text(Snapshot()) == ""
