"""Key figures count what a journal knows, and say nothing of what it does not."""

from __future__ import annotations

import pytest
from farm.desk.kpi import CountedEvent, KeyFigures, key_figures

CELL = "m/a"


def cycle(begin: float, end: float, **more: object) -> CountedEvent:
    """Return a cycle that ended as meant."""
    words = {
        "begin": begin,
        "end": end,
        "outcome": "done",
        "program": "MILK",
        "leader": "real",
    } | more
    return CountedEvent(CELL, end, "cycle", **words)  # type: ignore[arg-type]


def decision(time: float, stop: bool, asked: str = "") -> CountedEvent:
    """Return a change of the mode."""
    return CountedEvent(CELL, time, "decision", stop, True, asked)


def figures(*events: CountedEvent, begin: float = 0.0, end: float = 100.0) -> KeyFigures:
    """Return the figures of the only cell."""
    started = CountedEvent(CELL, 0.0, "start")
    rows = key_figures([started, *events], begin, end, {"MILK": 8.0}, "done")
    assert [row.cell for row in rows] == [CELL, ""]
    return rows[0]


def test_a_cell_that_works_half_of_the_time_is_half_available() -> None:
    """Production time by planned busy time; pauses within cycles are no production."""
    found = figures(cycle(0, 30), cycle(40, 65, paused_s=5.0))
    assert (found.busy_s, found.production_s, found.availability) == (100.0, 50.0, 0.5)
    assert (found.cycles, found.done, found.cycle_s) == (2, 2, 25.0)


def test_effectiveness_compares_with_the_planned_run_time() -> None:
    """What was begun and came to nothing costs; a program without a plan does not count."""
    found = figures(
        cycle(0, 10),
        cycle(10, 20, outcome="fault"),
        cycle(20, 90, program="OTHER"),
    )
    assert found.effectiveness == pytest.approx(8.0 / 20.0)
    assert figures(cycle(0, 10, program="OTHER")).effectiveness is None


def test_moves_of_twin_and_operator_are_counted_apart_from_programs() -> None:
    """They are production, but no run of a program, even where an old journal names one."""
    found = figures(
        cycle(0, 10),
        cycle(10, 12, leader="twin"),
        cycle(12, 15, leader="operator", program=""),
        cycle(15, 16, leader="twin", outcome="stopped"),
    )
    assert (found.cycles, found.done) == (4, 3)
    assert (found.programs, found.twin_moves, found.operator_moves) == (1, 1, 1)
    assert (found.production_s, found.cycle_s, found.effectiveness) == (16.0, 10.0, 0.8)


def test_quality_and_oee_are_known_only_with_parts() -> None:
    """A share of nothing is not 100 %."""
    assert figures(cycle(0, 50)).quality_ratio is None and figures(cycle(0, 50)).oee is None
    assert figures(cycle(0, 50, placed=1)).quality_ratio == 1.0
    found = figures(cycle(0, 50, placed=3, dropped=1))
    assert found.quality_ratio == 0.75 and found.parts == 4
    assert found.oee == pytest.approx(0.5 * (8.0 / 50.0) * 0.75)


def test_a_stop_that_somebody_asked_for_is_no_failure() -> None:
    """Times between failures and to restoration count those that nobody asked for."""
    found = figures(
        cycle(0, 40),
        decision(10, True, "ann"),
        decision(14, False, "ann"),
        decision(50, True),
        decision(56, False),
        decision(70, True),
        decision(72, True, "ann"),
        decision(80, False),
    )
    assert (found.stops, found.failures, found.stopped_s) == (4, 2, 4.0 + 6.0 + 10.0)
    assert (found.mean_between_failures_s, found.mean_restoration_s) == (20.0, 8.0)


def test_time_without_a_journal_is_off_and_no_stop() -> None:
    """From the last entry before a start; nobody knows what was then."""
    found = figures(
        CountedEvent(CELL, 0.0, "start"), decision(10, True), CountedEvent(CELL, 60.0, "start")
    )
    assert (found.off_s, found.busy_s, found.stopped_s) == (50.0, 50.0, 0.0)


def test_what_was_before_counts_only_for_how_the_cell_was() -> None:
    """A stop that lasts into the time looked at is no stop of it, but stopped time."""
    found = figures(cycle(0, 20), decision(30, True), decision(60, False), begin=50.0)
    assert (found.stops, found.cycles, found.stopped_s, found.production_s) == (0, 0, 10.0, 0.0)


def test_all_cells_are_added_up_and_the_worst_comes_first() -> None:
    """The last row is the farm."""
    other = CountedEvent("m/b", 100.0, "cycle", begin=0.0, end=100.0, outcome="done")
    first = CountedEvent("m/b", 0.0, "start")
    rows = key_figures(
        [CountedEvent(CELL, 0.0, "start"), cycle(0, 10), first, other], 0.0, 100.0, {}, "done"
    )
    assert [row.cell for row in rows] == [CELL, "m/b", ""]
    assert rows[-1].availability == pytest.approx(110.0 / 200.0) and rows[-1].cycles == 2
    assert key_figures([], 0.0, 1.0, {}, "done") == []


def test_a_cell_that_made_nothing_is_the_worst() -> None:
    """Then those that worked for a smaller part of their time."""
    made = {"m/a": 50.0, "m/b": 10.0, "m/c": 0.0}
    events = [CountedEvent(cell, 0.0, "start") for cell in made]
    for cell, worked in made.items():
        events.append(CountedEvent(cell, 100.0, "cycle", begin=100.0 - worked, end=100.0))
    rows = key_figures(events, 0.0, 100.0, {}, "done")
    assert [row.cell for row in rows] == ["m/c", "m/b", "m/a", ""]


def test_a_cell_that_came_later_takes_nothing_from_the_others() -> None:
    """Its journal begins behind the time looked at: it has no row, and no time in the sum."""
    later = CountedEvent("m/b", 150.0, "start")
    rows = key_figures([CountedEvent(CELL, 0.0, "start"), later], 0.0, 100.0, {}, "done")
    assert [(row.cell, row.busy_s) for row in rows] == [(CELL, 100.0), ("", 100.0)]
