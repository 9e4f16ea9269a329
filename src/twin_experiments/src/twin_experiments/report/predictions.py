"""What the second world predicted of the motions of a run, beside what happened."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from scara_msgs.msg import MotionOutcome

TITLE = "Predicted and measured"
HEADINGS = (
    "s",
    "motion",
    "end",
    "time predicted",
    "measured",
    "difference",
    "way predicted",
    "measured",
    "difference",
    "effort predicted",
    "measured",
    "difference",
)
NOTHING = "-"
MEASURES = ("time", "way", "effort")
MORE = {
    "time": ("a motion took", "longer than predicted", "less than predicted"),
    "way": ("the tool's way was", "longer", "shorter"),
    "effort": ("the largest effort was", "larger", "smaller"),
}
"""Each measure in words: what it did, and what more and less of it is called."""


@dataclass(frozen=True)
class Both:
    """One measure of a motion; None: it is not known.

    Attributes:
        predicted: Before the motion began.
        measured: When it had ended.
    """

    predicted: float | None
    measured: float | None

    @property
    def off_percent(self) -> float | None:
        """How much more was measured than predicted [%]; None where that cannot be said."""
        if not self.predicted or self.measured is None:
            return None
        return 100.0 * (self.measured / self.predicted - 1.0)


@dataclass(frozen=True)
class Foretold:
    """A motion that was judged before it began, and has ended.

    Attributes:
        at: When its end was told, since the start of the recording [s].
        what: The motion in words.
        end: How it ended, as in scara_msgs/MotionOutcome.
        time: Moving time [s].
        way: Of the tool [m].
        effort: Of the joint that needs most [%].
        drift: What was outside the limits of what_if.yaml by then, with what to do; empty: nothing.
    """

    at: float
    what: str
    end: str
    time: Both
    way: Both
    effort: Both
    drift: str

    @property
    def is_reached(self) -> bool:
        """Whether it came to its target; only then the figures can be compared."""
        return bool(self.end == MotionOutcome.REACHED)

    def off_percent(self, measure: str) -> float | None:
        """Return how far a measure is off its prediction [%]; None if it cannot be compared."""
        both: Both = getattr(self, measure)
        return both.off_percent if self.is_reached else None


def summary(found: Sequence[Foretold]) -> list[str]:
    """Return in plain words how good the predictions were, and what drifts; empty: no motion."""
    if not found:
        return []
    reached = [motion for motion in found if motion.is_reached]
    motions = "1 motion" if len(found) == 1 else f"{len(found)} motions"
    text = (
        f"Before they began, {motions} of this run were judged in the second world and let "
        f"through; {len(reached)} of them came to their target."
    )
    return [text, *_compared(reached), _drifted(found)]


def _compared(reached: Sequence[Foretold]) -> list[str]:
    """Return one sentence about all measures that are known."""
    parts = []
    for measure in MEASURES:
        offs = _offs(reached, measure)
        if offs:
            did, more, less = MORE[measure]
            middle, worst = median(offs), max(offs, key=abs)
            words = f"{abs(middle):.1f} % {more if middle >= 0.0 else less}"
            if abs(middle) < 0.05:
                words = f"as {'long' if measure != 'effort' else 'large'} as predicted"
            parts.append(f"{did} {words} (a single one by up to {worst:+.1f} %)")
    return [f"In the middle of all, {', '.join(parts)}."] if parts else []


def _offs(motions: Sequence[Foretold], measure: str) -> list[float]:
    """Return how far a measure is off [%], of the motions that can be compared."""
    offs = (motion.off_percent(measure) for motion in motions)
    return [off for off in offs if off is not None]


def _drifted(found: Sequence[Foretold]) -> str:
    """Return what drifts away from its prediction, at the end or before."""
    last = found[-1]
    if last.drift:
        return f"At the end something drifted: {last.drift}."
    before = [motion for motion in found if motion.drift]
    if before:
        at, drift = before[-1].at, before[-1].drift
        return f"Nothing drifted at the end; {at:.1f} s after the start it was this: {drift}."
    return "Nothing drifted: no median of the last motions was outside learning of what_if.yaml."


def motion_rows(found: Sequence[Foretold]) -> list[tuple[str, ...]]:
    """Return one row of text for each motion, cells as in ``HEADINGS``."""
    return [
        (
            f"{motion.at:.1f}",
            motion.what,
            motion.end,
            *_cells(motion, "time", 1.0, ".2f", "s"),
            *_cells(motion, "way", 1e3, ".0f", "mm"),
            *_cells(motion, "effort", 1.0, ".0f", "%"),
        )
        for motion in found
    ]


def _cells(motion: Foretold, measure: str, scale: float, form: str, unit: str) -> tuple[str, ...]:
    """Return a measure: predicted, measured, difference."""
    both: Both = getattr(motion, measure)
    values = (
        NOTHING if value is None else f"{scale * value:{form}} {unit}"
        for value in (both.predicted, both.measured)
    )
    off = motion.off_percent(measure)
    # A difference that rounds to nothing is no shortfall.
    shown = NOTHING if off is None else f"{off:+.1f} %".replace("-0.0", "+0.0")
    return (*values, shown)


def as_document(found: Sequence[Foretold]) -> dict[str, Any]:
    """Return the section ``predictions`` of report.json; None: it is not known."""
    reached = [motion for motion in found if motion.is_reached]
    middles: dict[str, float | None] = {}
    for measure in MEASURES:
        offs = _offs(reached, measure)
        middles[f"{measure}_off_median_percent"] = median(offs) if offs else None
        middles[f"{measure}_off_max_percent"] = max(map(abs, offs)) if offs else None
    return {
        "motions": len(found),
        "reached": len(reached),
        **middles,
        "drift": found[-1].drift if found else "",
        "each": [_motion(motion) for motion in found],
    }


def _motion(motion: Foretold) -> dict[str, Any]:
    """Return one motion of report.json."""
    return {
        "at_s": motion.at,
        "what": motion.what,
        "end": motion.end,
        "time_predicted_s": motion.time.predicted,
        "time_measured_s": motion.time.measured,
        "way_predicted_m": motion.way.predicted,
        "way_measured_m": motion.way.measured,
        "effort_predicted_percent": motion.effort.predicted,
        "effort_measured_percent": motion.effort.measured,
        "drift": motion.drift,
    }
