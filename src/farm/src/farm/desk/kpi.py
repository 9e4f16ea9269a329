"""Key figures of cells from their journals, in the words of ISO 22400-2; pure.

A cell's journal knows cycles, stops and starts. What needs more (a shift calendar, a planned time
of each item, who judged a part) is not known to it: a figure that needs it is None, never guessed.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import msgspec

REAL, TWIN, OPERATOR = "real", "twin", "operator"
"""Who led a cycle, as the journal writes it."""


class CountedEvent(NamedTuple):
    """What the figures need of an event; those of a cell come in the order of their numbers.

    Attributes:
        cell: MACHINE/CELL.
        time: When [s since 1970].
        kind: As in the journal.
        stop: Whether it stopped the pair.
        changed: Of a decision: whether the mode changed.
        asked: Of a decision: who asked for it; empty: nobody.
        begin, end, paused_s: Of a cycle.
        program, outcome, leader: Of a cycle.
        placed, dropped: Parts of a cycle.
    """

    cell: str
    time: float
    kind: str
    stop: bool = False
    changed: bool = False
    asked: str = ""
    begin: float = 0.0
    end: float = 0.0
    paused_s: float = 0.0
    program: str = ""
    outcome: str = ""
    leader: str = ""
    placed: int = 0
    dropped: int = 0


class KeyFigures(msgspec.Struct, frozen=True):
    """Figures of one cell, or of all; a share is 0 to 1, None: it is not known.

    Attributes:
        cell: MACHINE/CELL, or empty: all.
        busy_s: Planned busy time: the time looked at, without what the cell was off.
        production_s: Actual production time: cycles, without their pauses.
        stopped_s: Time in which the pair did not go on by itself.
        off_s: Time without a running journal.
        availability: production_s / busy_s.
        effectiveness: Planned run time of what was made / production time of those programs
            (performance).
        quality_ratio: Good parts / parts.
        oee: Product of the three.
        cycles: Cycles that ended, whoever led.
        done: Those that ended as meant: ``programs`` of the real robot, ``twin_moves`` and
            ``operator_moves``.
        programs, twin_moves, operator_moves: See above.
        cycle_s: Median of the programs among them.
        parts: Placed and dropped.
        stops: All; ``failures``: those that nobody asked for.
        failures: See above.
        mean_between_failures_s: production_s / failures.
        mean_restoration_s: Mean time from a failure until the pair went on.
    """

    cell: str
    busy_s: float
    production_s: float
    stopped_s: float
    off_s: float
    availability: float | None
    effectiveness: float | None
    quality_ratio: float | None
    oee: float | None
    cycles: int
    done: int
    programs: int
    twin_moves: int
    operator_moves: int
    cycle_s: float | None
    parts: int
    stops: int
    failures: int
    mean_between_failures_s: float | None
    mean_restoration_s: float | None


@dataclass
class _Sums:
    """What is counted of one cell."""

    busy: float = 0.0
    production: float = 0.0
    stopped: float = 0.0
    off: float = 0.0
    planned: float = 0.0
    # Production time of cycles whose program has a planned run time.
    planned_production: float = 0.0
    placed: int = 0
    dropped: int = 0
    cycles: int = 0
    stops: int = 0
    failures: int = 0
    twin_moves: int = 0
    operator_moves: int = 0
    # Of the real robot's programs that ended as meant.
    seconds: list[float] = field(default_factory=list)
    restorations: list[float] = field(default_factory=list)


def key_figures(
    events: Iterable[CountedEvent],
    begin: float,
    end: float,
    planned_s: Mapping[str, float],
    done: str,
) -> list[KeyFigures]:
    """Return the figures of each cell, the least available first, and of all cells last.

    Args:
        events: Of all cells; each cell's in the order of its numbers. Also those before ``begin``
            may be among them: they say how the cell was then.
        begin: From when [s since 1970].
        end: Until when.
        planned_s: Planned run time of a program [s]; of those that are named.
        done: Outcome of a cycle that ended as meant.
    """
    of_cells: dict[str, list[CountedEvent]] = {}
    for event in events:
        of_cells.setdefault(event.cell, []).append(event)
    sums = {
        cell: _summed(row, begin, end, planned_s, done) for cell, row in of_cells.items() if row
    }
    rows = [_figures(cell, each) for cell, each in sums.items() if each.busy > 0.0]
    rows.sort(key=lambda row: (row.availability or 0.0, row.cell))
    return [*rows, _figures("", _total(sums.values()))] if rows else []


def _summed(
    events: Sequence[CountedEvent],
    begin: float,
    end: float,
    planned_s: Mapping[str, float],
    done: str,
) -> _Sums:
    """Count one cell's events."""
    sums, begin = _Sums(), max(begin, events[0].time)
    down: float | None = None
    failed: float | None = None
    last = events[0].time

    def goes_on(now: float) -> None:
        nonlocal down, failed
        if down is not None:
            sums.stopped += _inside(down, now, begin, end)
        if failed is not None and begin <= failed <= end:
            sums.restorations.append(max(0.0, now - failed))
        down = failed = None

    for event in events:
        if event.kind == "start":
            # Whether it was stopped while it was off nobody knows.
            goes_on(last)
            sums.off += _inside(last, event.time, begin, end)
        elif event.kind == "cycle":
            _count_cycle(sums, event, (begin, end), planned_s, done)
        elif event.stop:
            inside = begin <= event.time <= end
            sums.stops += inside
            down = event.time if down is None else down
            if not event.asked:
                sums.failures += inside
                failed = event.time if failed is None else failed
        elif event.changed:
            goes_on(event.time)
        last = max(last, event.time)
    if down is not None:
        sums.stopped += _inside(down, end, begin, end)
    sums.busy = max(0.0, end - begin - sums.off)
    return sums


def _count_cycle(
    sums: _Sums,
    event: CountedEvent,
    window: tuple[float, float],
    planned_s: Mapping[str, float],
    done: str,
) -> None:
    """Count a cycle that ended within the time looked at."""
    begin, end = window
    worked = max(0.0, _inside(event.begin, event.end, begin, end) - event.paused_s)
    sums.production += worked
    if not begin <= event.end <= end:
        return
    sums.cycles += 1
    sums.placed += event.placed
    sums.dropped += event.dropped
    lasted = event.end - event.begin - event.paused_s
    if event.outcome == done:
        if event.leader == REAL:
            sums.seconds.append(lasted)
        sums.twin_moves += event.leader == TWIN
        sums.operator_moves += event.leader == OPERATOR
    if event.leader == REAL and event.program in planned_s:
        # What was begun and not ended as meant has cost time and made nothing.
        sums.planned += planned_s[event.program] * (event.outcome == done)
        sums.planned_production += lasted


def _total(sums: Iterable[_Sums]) -> _Sums:
    """Return the sums of all cells."""
    total = _Sums()
    for each in sums:
        for name in _Sums.__dataclass_fields__:
            setattr(total, name, getattr(total, name) + getattr(each, name))
    return total


def _figures(cell: str, sums: _Sums) -> KeyFigures:
    parts = sums.placed + sums.dropped
    availability = _share(sums.production, sums.busy)
    effectiveness = _share(sums.planned, sums.planned_production)
    quality = _share(sums.placed, parts)
    oee = None
    if availability is not None and effectiveness is not None and quality is not None:
        oee = availability * effectiveness * quality
    return KeyFigures(
        cell=cell,
        busy_s=sums.busy,
        production_s=sums.production,
        stopped_s=sums.stopped,
        off_s=sums.off,
        availability=availability,
        effectiveness=effectiveness,
        quality_ratio=quality,
        oee=oee,
        cycles=sums.cycles,
        done=len(sums.seconds) + sums.twin_moves + sums.operator_moves,
        programs=len(sums.seconds),
        twin_moves=sums.twin_moves,
        operator_moves=sums.operator_moves,
        cycle_s=statistics.median(sums.seconds) if sums.seconds else None,
        parts=parts,
        stops=sums.stops,
        failures=sums.failures,
        mean_between_failures_s=_share(sums.production, sums.failures),
        mean_restoration_s=statistics.fmean(sums.restorations) if sums.restorations else None,
    )


def _inside(first: float, last: float, begin: float, end: float) -> float:
    """Return how much of a time lies within another [s]."""
    return max(0.0, min(last, end) - max(first, begin))


def _share(part: float, whole: float) -> float | None:
    return part / whole if whole > 0 else None
