"""What the monitor beside a cell says of itself and of the robot, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scara_ros.diagnosis import Diagnosis, Level

from twin_analysis.health.live.weeks import KindVerdict
from twin_analysis.health.trend import RECENT

RECENT_S = 7 * 24 * 3600.0
"""What a cycle said that was not seen for longer than the others no longer counts: after a repair
another program may run. Our choice."""


@dataclass(frozen=True)
class WearStatus:
    """How the monitor is.

    Attributes:
        told: Of each cycle that is kept.
        taken: Cycles that were taken since the start.
        note: What the last cycle could not say, and why; empty: all is well.
        problem: What is wrong with the monitor itself, and what to do; empty: nothing.
    """

    told: tuple[KindVerdict, ...] = ()
    taken: int = 0
    note: str = ""
    problem: str = ""


def diagnose(watched: WearStatus, name: str, now: float) -> Diagnosis:
    """Judge the robot, and the monitor of the node ``name``; ``now`` is Unix time [s]."""
    # What was seen while the clock was ahead makes nothing else old.
    seen = (each.kind.newest for each in watched.told if each.kind.newest <= now)
    newest = max(seen, default=0.0)
    recent = [each for each in watched.told if newest - each.kind.newest <= RECENT_S]
    worst = worst_of(recent)
    complete = [each for each in recent if each.kind.complete]
    compared = [each for each in complete if each.compared]
    values = {
        "taken": watched.taken,
        "compared": len(compared),
        "cycle": cycle_words(worst) if worst is not None else "",
        "left_out": "; ".join(sorted({each.left_out for each in complete if each.left_out})),
        "note": watched.note,
    }
    level = Level.OK
    if worst is not None and worst.finding is not None:
        level, message = Level.WARN, worst.finding.text
    elif watched.problem:
        level, message = Level.WARN, watched.problem
    elif compared:
        message = f"as in its first week: {', '.join(cycle_words(each) for each in compared)}"
    elif complete:
        fullest = max(complete, key=lambda each: len(each.kind.recent))
        count = len(fullest.kind.recent)
        message = f"the first week is over: {count} of {RECENT} cycles behind it so far"
        if count >= RECENT:
            message = f"nothing can be compared: {fullest.left_out}"
    elif recent:
        most = max(len(each.kind.week) for each in recent)
        message = f"first week: {most} times the same cycle so far"
    else:
        message = "no cycle was taken yet"
    return Diagnosis(level, name, message, values)


def worst_of(told: Sequence[KindVerdict]) -> KindVerdict | None:
    """Return what is furthest beyond its limit; None: nothing is."""
    # Its place beside the score, for of two equal scores the verdicts themselves have no order.
    found = [(each.finding.score, at) for at, each in enumerate(told) if each.finding is not None]
    return told[max(found)[1]] if found else None


def cycle_words(told: KindVerdict) -> str:
    """Return which cycle it is, for example ``PALLETISE of 42 s``."""
    shape = told.kind.shape
    return f"{shape.program or f'what the {shape.leader} leads'} of {shape.seconds:.0f} s"
