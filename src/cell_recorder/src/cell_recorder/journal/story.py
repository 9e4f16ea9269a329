"""Tell a journal to a person: what stopped the cell and why, who asked, what became of it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import datetime, tzinfo

from cell_recorder.journal.cycles import LEADS
from cell_recorder.journal.entries import (
    DONE,
    Alarm,
    AnyEntry,
    Audit,
    Cycle,
    Decision,
    ExerciseMarked,
    Gap,
    Start,
    Torn,
)
from cell_recorder.journal.health import counted
from scara_msgs.msg import TwinControllerState

LATCHED = (
    TwinControllerState.STANDSTILL,
    TwinControllerState.ESTOP,
    TwinControllerState.FAULT,
    TwinControllerState.OFFLINE,
)
"""From these into STOPPED is a step on the way out: RESET, or links that are up again."""
STOPS = (TwinControllerState.STOPPED, TwinControllerState.PAUSED, *LATCHED)
WORKS = (*LEADS, TwinControllerState.IDLE)
_DIGITS = re.compile(r"\d+(?:[.,]\d+)*")


@dataclass(frozen=True)
class StoryLine:
    """One thing that happened, or the same one several times.

    Args:
        first: Number of its entry.
        last: Of the last one.
        begun: Time of the first [s], Unix time.
        ended: Of the last.
        what: In one or two words.
        words: What happened and why.
        who: Who asked for it; empty: nobody.
        outcome: What became of it; empty: nothing more to tell.
        is_stop: Whether it stopped the cell.
        times: How often it happened one after the other.
    """

    first: int
    last: int
    begun: float
    ended: float
    what: str
    words: str
    who: str = ""
    outcome: str = ""
    is_stop: bool = False
    times: int = 1


def is_stop(entry: AnyEntry) -> bool:
    """Return whether an entry stopped a cell, which stood not already for the same reason."""
    return (
        isinstance(entry, Decision)
        and entry.mode_after in STOPS
        and entry.mode_before != entry.mode_after
        and not (entry.mode_before in LATCHED and entry.mode_after == TwinControllerState.STOPPED)
    )


def is_told(entry: AnyEntry) -> bool:
    """Return whether a person wants to read it: no command that was obeyed, its decision is there.

    Nor what clients published; what was refused, or moved a stopped twin, stays.
    """
    return not isinstance(entry, Audit) or not entry.success


def tell(entries: Iterable[AnyEntry], stops_only: bool = False) -> list[StoryLine]:
    """Return the story of some entries, the same things one after the other as one line.

    Args:
        entries: In the order of their numbers, all kinds: what became of a stop is in the later
            ones.
        stops_only: Leave out all but the stops.
    """
    held = list(entries)
    lines = (
        _line(entry, (held[n] for n in range(place + 1, len(held))))
        for place, entry in enumerate(held)
        if is_stop(entry) or not stops_only
    )
    return list(grouped(lines))


def grouped(lines: Iterable[StoryLine]) -> Iterator[StoryLine]:
    """Make one line of those that follow each other and differ in numbers only."""
    held: StoryLine | None = None
    for line in lines:
        if held is not None and _alike(held) == _alike(line):
            held = replace(line, first=held.first, begun=held.begun, times=held.times + 1)
            continue
        if held is not None:
            yield held
        held = line
    if held is not None:
        yield held


def _alike(line: StoryLine) -> tuple[str, str, str]:
    """Return what lines of one group have in common."""
    return line.what, _DIGITS.sub("#", line.words), line.who


def _line(entry: AnyEntry, later: Iterable[AnyEntry]) -> StoryLine:
    """Tell one entry."""
    line = StoryLine(entry.number, entry.number, entry.time, entry.time, entry.kind, "")
    if isinstance(entry, Decision):
        stop = is_stop(entry)
        return replace(
            line,
            what=entry.mode_after if entry.mode_before != entry.mode_after else entry.kind,
            words=entry.why or _words(entry.event),
            who=entry.who,
            outcome=_became(entry, later) if stop else "",
            is_stop=stop,
        )
    if isinstance(entry, Audit):
        verdict = "" if entry.success else "refused: "
        return replace(line, words=entry.what, who=entry.who, outcome=verdict + entry.outcome)
    if isinstance(entry, Alarm):
        what = entry.level if entry.active else "cleared"
        lasted = f"after {duration(entry.seconds)}" if not entry.active else ""
        return replace(line, what=what, words=f"{entry.source}: {entry.text}", outcome=lasted)
    if isinstance(entry, Cycle):
        why = f": {entry.why}" if entry.why and entry.outcome != DONE else ""
        return replace(line, words=_of_cycle(entry), who=entry.who, outcome=entry.outcome + why)
    if isinstance(entry, ExerciseMarked):
        passed = "passed" if entry.passed else "not yet"
        words = f"{entry.learner}: {entry.title}"
        return replace(line, what=passed, words=words, outcome=entry.reason)
    if isinstance(entry, Start):
        stand_in = f", stand-in {entry.plant}" if entry.plant else ""
        return replace(line, words=f"the journal began: {entry.robot}{stand_in}")
    if isinstance(entry, Gap):
        verb = "is" if entry.lost == 1 else "are"
        lost = f"{counted(entry.lost)} {verb} missing here: " if entry.lost else ""
        return replace(line, words=lost + entry.why)
    assert isinstance(entry, Torn)
    words = f"the last line of {entry.file} was torn: {entry.size} bytes, kept in {entry.kept}"
    return replace(line, words=words)


def _became(stop: Decision, later: Iterable[AnyEntry]) -> str:
    """Say how the cell went on after a stop."""
    mode = stop.mode_after
    for entry in later:
        after = duration(max(0.0, entry.time - stop.time))
        if isinstance(entry, Start):
            return f"the cell was started again {after} later"
        if not isinstance(entry, Decision) or entry.mode_before == entry.mode_after:
            continue
        if entry.mode_after in WORKS:
            by = f" ({entry.who})" if entry.who else ""
            return f"went on after {after}: {_words(entry.event)}{by}"
        if is_stop(entry):
            return f"{entry.mode_after} after {after}: {_words(entry.event)}"
        mode = entry.mode_after
    return f"{mode} since then, as far as the journal goes"


def _words(event: str) -> str:
    """Return the name of an event as words."""
    return event.lower().replace("_", " ") if event.isupper() else event


def _of_cycle(cycle: Cycle) -> str:
    """Say what was done in a cycle."""
    parts = [cycle.program or "a motion", f"{cycle.leader} led"]
    parts.append(duration(cycle.end - cycle.start))
    if cycle.parts_placed or cycle.parts_dropped:
        dropped = f", {cycle.parts_dropped} dropped" if cycle.parts_dropped else ""
        parts.append(f"{cycle.parts_placed} parts placed{dropped}")
    if cycle.worst_error_mm is not None:
        parts.append(f"at most {cycle.worst_error_mm:.2f} mm apart")
    return ", ".join(parts)


def duration(seconds: float) -> str:
    """Say how long something took.

    Example:
        >>> duration(2.34), duration(75.0), duration(7260.0), duration(200000.0)
        ('2.3 s', '1 min 15 s', '2 h 1 min', '2 d 7 h')
    """
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    for large, small, unit, below in ((86400, 3600, "d", "h"), (3600, 60, "h", "min")):
        if whole >= large:
            return f"{whole // large} {unit} {whole % large // small} {below}"
    return f"{whole // 60} min {whole % 60} s"


def local_time(time: float, zone: tzinfo | None) -> str:
    """Return a time [s] (Unix time) as people of a zone write it."""
    return f"{datetime.fromtimestamp(time, zone):%Y-%m-%d %H:%M:%S}"
