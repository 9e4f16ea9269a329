"""Sentences that stand beside the figures of one experiment."""

from __future__ import annotations

from collections import Counter

from twin_experiments.metrics.needles import WIDEST_S
from twin_experiments.metrics.pauses import AFTERMATH_S, LONGEST_SILENCE_S, longest_ms
from twin_experiments.metrics.unseen import UnseenDelay
from twin_experiments.report.analysis import Result

MS = 1e3


def notes(result: Result, reach_mm: float) -> list[str]:
    """Return what a reader must know before taking the figures of an experiment for granted."""
    found = [positioning_note(result, reach_mm), pause_note(result)]
    if result.unseen is not None:
        found.append(unseen_note(result.unseen))
    return [*found, needle_note(result)] if result.comparison is not None else found


def unseen_note(unseen: UnseenDelay) -> str:
    """Say what the figures of a robot without ground truth cannot see, as time and as way."""
    (early, late), (less, more) = unseen.bounds_ms, unseen.bounds_mm
    return (
        "The real positions are what the robot's registers said. When they were true is known "
        f"from {early:+.1f} to {late:+.1f} ms: the clocks agree no better, and a reading may be as "
        f"old as the one before it. At {unseen.speed:.2f} m/s, the largest speed here, these "
        f"figures cannot see from {less:+.1f} to {more:+.1f} mm: measure it once (acceptance, F3)."
    )


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


def needle_note(result: Result) -> str:
    """Say how many needles there are, what the highest means as time, and what was going on."""
    needles = result.needles
    if not needles:
        return (
            f"No needles: the distance has no peak shorter than {WIDEST_S * MS:.0f} ms that stands "
            "out."
        )
    count = "1 needle" if len(needles) == 1 else f"{len(needles)} needles"
    highest = max(needles, key=lambda needle: needle.height_mm)
    since = highest.at - result.span.start
    text = (
        f"{count} (peaks of the distance shorter than {WIDEST_S * MS:.0f} ms, violet bands); the "
        f"highest is {highest.height_mm:.2f} mm at {since:.2f} s."
    )
    if highest.timing_ms is not None:
        text += (
            f" There the tool moves at {highest.speed:.2f} m/s, so a difference of "
            f"{highest.timing_ms:.1f} ms in time between both sides is that long."
        )
    causes = Counter(needle.cause for needle in needles)
    told = "; ".join(f"at {number} of them {cause}" for cause, number in causes.most_common())
    return f"{text} {told[0].upper()}{told[1:]}."
