"""Sentences that stand beside the figures of one experiment."""

from __future__ import annotations

from twin_experiments.analysis import Result
from twin_experiments.metrics.pauses import AFTERMATH_S, LONGEST_SILENCE_S, longest_ms

MS = 1e3


def notes(result: Result) -> list[str]:
    """Return what a reader must know before taking the figures of an experiment for granted."""
    return [pause_note(result)]


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
