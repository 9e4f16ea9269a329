"""Sentences that stand beside the figures of one experiment."""

from __future__ import annotations

from twin_experiments.analysis import Result
from twin_experiments.metrics.pauses import AFTERMATH_S, LONGEST_SILENCE_S, longest_ms

MS = 1e3


def notes(result: Result, reach_mm: float) -> list[str]:
    """Return what a reader must know before taking the figures of an experiment for granted."""
    return [positioning_note(result, reach_mm), pause_note(result)]


def positioning_note(result: Result, reach_mm: float) -> str:
    """Say how far the tool is off at rest, and what of it calibration would remove."""
    found = result.true_positioning
    if found is None:
        return "At rest, against the robot's true geometry: not known."
    removable = "none of it"
    if found.removable_mm > 0.0:
        removable = f"{found.removable_mm:.3f} mm of it"
    return (
        f"At rest, against the robot's true geometry: max {found.max_mm:.3f} mm, "
        f"{100.0 * found.max_mm / reach_mm:.3f} % of reach. Calibration of lengths and zero "
        f"offsets would remove {removable} and leave {found.calibrated_mm:.3f} mm."
    )


def pause_note(result: Result) -> str:
    """Say whether the machine stood still, and what the path error is without these moments."""
    pauses = result.pauses
    if not pauses:
        return (
            "The machine did not pause: there was never more than "
            f"{LONGEST_SILENCE_S * MS:.0f} ms without any message."
        )
    count = "1 pause" if len(pauses) == 1 else f"{len(pauses)} pauses"
    text = (
        f"{count} of the machine, or of the recorder; the longest took {longest_ms(pauses):.0f} ms."
    )
    if result.comparison is None:
        return text
    rest = result.path_undisturbed
    without = "not known" if rest is None else f"{rest.max_percent:.3f} % of reach"
    return (
        f"{text} Path error max {result.comparison.path.max_percent:.3f} % of reach; "
        f"without the pauses and the {AFTERMATH_S:g} s after each: {without}."
    )
