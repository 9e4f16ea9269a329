"""A side that stays connected but says nothing any more."""

from __future__ import annotations

from harness.pair import Pair
from twin_controller.core.lead.modes import Mode


def test_silent_pose_controller_counts_as_a_lost_twin(pair: Pair) -> None:
    """Joint states alone do not tell whether the twin obeys; with its state the pair aligns."""
    report = pair.report_motion
    pair.report_motion = lambda: None  # type: ignore[method-assign]
    pair.run(0.3)
    assert pair.mode == "OFFLINE"
    assert "its pose controller was silent" in pair.decisions()[-1].why
    pair.report_motion = report  # type: ignore[method-assign]
    pair.until(Mode.IDLE, 5.0)
