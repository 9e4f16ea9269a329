"""Key figures count what a journal knows, and say nothing of what it does not."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import TypeAlias

import pytest
from farm.desk.class_io import MarkedExercise, class_of
from farm.desk.figures import KeyFigures
from farm.desk.figures_io import figures_of
from farm.desk.history_io import History, Kept
from farm.desk.reading_io import ask
from farm.keys import CellName
from farm.link.event_text import describe
from farm.wire import Event

from scara_msgs.msg import TwinControllerState as Mode

Rows: TypeAlias = Callable[..., list[KeyFigures]]
Figures: TypeAlias = Callable[..., KeyFigures]
NUMBERS = count(1)


def event(time: float, kind: str, stop: bool = False, cell: str = "a", **body: object) -> Kept:
    """Return an event of a cell's journal; each has a higher number than those before."""
    told = Event(next(NUMBERS), time, kind, stop, "", body)
    return Kept(CellName("site", "m", cell), 0, told)


def cycle(begin: float, end: float, /, cell: str = "a", **more: object) -> Kept:
    """Return a cycle that ended as meant."""
    usual = {"start": begin, "end": end, "outcome": "done", "program": "MILK", "leader": "real"}
    return event(end, "cycle", cell=cell, **{**usual, **more})


def start(time: float = 0.0, cell: str = "a") -> Kept:
    """Return the start of a journal."""
    return event(time, "start", cell=cell)


def decision(time: float, stop: bool, asked: str = "") -> Kept:
    """Return a change of the mode."""
    return event(time, "decision", stop, mode_before="A", mode_after="B", who=asked)


@pytest.fixture
def rows(tmp_path: Path) -> Rows:
    """Return what counts the figures of some events, which come in the order of their numbers."""

    def counted(*events: Kept, begin: float = 0.0, end: float = 100.0) -> list[KeyFigures]:
        with History(tmp_path / f"{next(NUMBERS)}", 4, 16.0) as history:
            history.write(events)
        return figures_of(history.folder, begin, end, {"MILK": 8.0})

    return counted


@pytest.fixture
def figures(rows: Rows) -> Figures:
    """Return what counts the figures of one cell, whose journal has begun at 0."""

    def counted(*events: Kept, **window: float) -> KeyFigures:
        found = rows(Kept(events[0].cell, 0, Event(0, 0.0, "start", False, "")), *events, **window)
        assert [row.cell for row in found] == ["m/a", ""]
        return found[0]

    return counted


def test_a_cell_that_works_half_of_the_time_is_half_available(figures: Figures) -> None:
    """Production time by planned busy time; pauses within cycles are no production."""
    found = figures(cycle(0, 30), cycle(40, 65, paused_s=5.0))
    assert (found.busy_s, found.production_s, found.availability) == (100.0, 50.0, 0.5)
    assert (found.cycles, found.done, found.cycle_s) == (2, 2, 25.0)


def test_effectiveness_compares_with_the_planned_run_time(figures: Figures) -> None:
    """What was begun and came to nothing costs; a program without a plan does not count."""
    found = figures(
        cycle(0, 10),
        cycle(10, 20, outcome="fault"),
        cycle(20, 90, program="OTHER"),
    )
    assert found.effectiveness == pytest.approx(8.0 / 20.0)
    assert figures(cycle(0, 10, program="OTHER")).effectiveness is None


def test_moves_of_twin_and_operator_are_counted_apart_from_programs(figures: Figures) -> None:
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


def test_quality_and_oee_are_known_only_with_parts(figures: Figures) -> None:
    """A share of nothing is not 100 %."""
    assert figures(cycle(0, 50)).quality_ratio is None and figures(cycle(0, 50)).oee is None
    assert figures(cycle(0, 50, parts_placed=1)).quality_ratio == 1.0
    found = figures(cycle(0, 50, parts_placed=3, parts_dropped=1))
    assert found.quality_ratio == 0.75 and found.parts == 4
    assert found.oee == pytest.approx(0.5 * (8.0 / 50.0) * 0.75)


def test_a_stop_that_somebody_asked_for_is_no_failure(figures: Figures) -> None:
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


def test_reset_is_no_other_stop_and_the_pair_does_not_go_on_by_it(figures: Figures) -> None:
    """It stands until ALIGN."""
    told = []
    for at, before, after, who in (
        (10.0, Mode.IDLE, Mode.ESTOP, "ann"),
        (14.0, Mode.ESTOP, Mode.STOPPED, ""),
        (20.0, Mode.STOPPED, Mode.ALIGNING, "ann"),
    ):
        body = {"mode_before": before, "mode_after": after, "who": who}
        told.append(event(at, "decision", describe("decision", body)[0], **body))
    found = figures(*told)
    assert (found.stops, found.failures, found.stopped_s) == (1, 0, 10.0)


def test_time_without_a_journal_is_off_and_no_stop(figures: Figures) -> None:
    """From the last entry before a start; nobody knows what was then."""
    found = figures(decision(10, True), start(60.0))
    assert (found.off_s, found.busy_s, found.stopped_s) == (50.0, 50.0, 0.0)


def test_an_idle_cell_is_off_from_its_last_entry_of_any_kind(figures: Figures) -> None:
    """But not from what its journal has found in its files at the start, and tells before it."""
    idle = figures(decision(10, True), event(55, "alarm"), start(60.0))
    assert (idle.off_s, idle.busy_s) == (5.0, 95.0)
    assert figures(event(55, "audit"), event(59, "torn"), event(59, "gap"), start(60)).off_s == 5.0


def test_what_was_before_counts_only_for_how_the_cell_was(figures: Figures) -> None:
    """A stop that lasts into the time looked at is no stop of it, but stopped time."""
    found = figures(cycle(0, 20), decision(30, True), decision(60, False), begin=50.0)
    assert (found.stops, found.cycles, found.stopped_s, found.production_s) == (0, 0, 10.0, 0.0)


def test_all_cells_are_added_up_and_the_worst_comes_first(rows: Rows) -> None:
    """The last row is the farm."""
    found = rows(start(), cycle(0, 10), start(cell="b"), cycle(0, 90, "b"))
    assert [row.cell for row in found] == ["m/a", "m/b", ""]
    assert found[-1].availability == pytest.approx(100.0 / 200.0) and found[-1].cycles == 2


def test_a_cell_that_made_nothing_is_the_worst(rows: Rows) -> None:
    """Then those that worked for a smaller part of their time."""
    made = {"a": 50.0, "b": 10.0, "c": 0.0}
    found = rows(*map(start, [0.0] * 3, made), *(cycle(90 - s, 90, c) for c, s in made.items()))
    assert [row.cell for row in found] == ["m/c", "m/b", "m/a", ""]


def test_a_cell_that_came_later_takes_nothing_from_the_others(rows: Rows) -> None:
    """Its journal begins behind the time looked at: it has no row, and no time in the sum."""
    found = rows(start(), start(150.0, "b"))
    assert [(row.cell, row.busy_s) for row in found] == [("m/a", 100.0), ("", 100.0)]


@pytest.mark.parametrize(
    ("odd", "production_s"),
    [
        ({"start": "08:15"}, 0.0),
        ({"start": None}, 0.0),
        ({"end": "08:15"}, 0.0),
        ({"paused_s": "soon"}, 10.0),
        ({"parts_placed": "three", "parts_dropped": {}}, 10.0),
    ],
)
def test_an_odd_entry_takes_nothing_from_the_other_cells(
    rows: Rows, odd: dict[str, object], production_s: float
) -> None:
    """What is no number is not known, and a cycle without both times is none."""
    found = rows(start(), cycle(5, 15, **odd), start(cell="b"), cycle(0, 90, "b"))
    made = {row.cell: row.production_s for row in found}
    assert made == {"m/a": production_s, "m/b": 90.0, "": production_s + 90.0}


def test_an_odd_figure_of_a_cycle_leaves_the_other_ones(tmp_path: Path) -> None:
    """Drift and comparison are counted of these."""
    with History(tmp_path / "events", 4, 16.0) as history:
        history.write([cycle(0, 10, worst_error_mm="far", follower_lag_s=[])])
        history.write([cycle(0, 10, "b", worst_error_mm=0.5, follower_lag_s=0.1)])
    asked = "SELECT name, value FROM cycle_figures WHERE figure LIKE '% MILK' ORDER BY ALL"
    assert ask(tmp_path / "events", asked).rows == [
        ("m/a", 10.0),
        ("m/b", 0.1),
        ("m/b", 0.5),
        ("m/b", 10.0),
    ]


def test_a_result_that_is_not_whole_takes_nothing_from_the_other_learners(tmp_path: Path) -> None:
    """It does not count."""
    good = {
        "learner": "ann",
        "exercise": "e1_look",
        "title": "1 Look",
        "passed": True,
        "marked": 5.0,
        "signature": "x",
    }
    odd = [{**good, key: None} for key in good]
    odd += [{**good, "passed": "maybe"}, {**good, "marked": "noon"}]
    with History(tmp_path / "events", 4, 16.0) as history:
        history.write([event(6.0, "exercise", cell="b", **body) for body in odd])
        history.write([event(6.0, "exercise", **good)])
    found = class_of(tmp_path / "events", 0.0)
    assert found == [MarkedExercise("m/a", "ann", "e1_look", "1 Look", True, 1, 5.0)]
