"""What became of a motion beside what was predicted, as an entry of the journal."""

from __future__ import annotations

from typing import Protocol

from cell_recorder.journal.entries import Audit

WHO = "what_if"


class WrittenOutcome(Protocol):
    """Fields of scara_msgs/MotionOutcome that are written down."""

    what: str
    end: str
    time_predicted: float
    time_measured: float
    way_predicted: float
    way_measured: float
    drift: str


def outcome_entry(said: WrittenOutcome) -> Audit:
    """Return an entry; one without success tells that predictions drift away."""
    text = (
        f"{said.end}: {said.time_measured:.2f} s, predicted {said.time_predicted:.2f} s; "
        f"{said.way_measured:.3f} m of the tool, predicted {said.way_predicted:.3f} m"
    )
    if said.drift:
        text += f"; drift: {said.drift}"
    return Audit(who=WHO, what=f"predicted: {said.what}", success=not said.drift, outcome=text)
