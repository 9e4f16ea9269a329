"""Key figures and drift out of the history's files, with invented cells."""

from __future__ import annotations

from pathlib import Path

import pytest
from cell_recorder.journal import entries
from farm.desk.figures import DONE, DRIFTING
from farm.desk.figures_io import figures_of, figures_over, stops_by_cause
from farm.desk.history_io import History, Kept
from farm.desk.questions import Wanted, causes
from farm.desk.reading_io import ask
from farm.keys import CellName

from bench.synthetic.invented import CYCLE_S, Invented

CELLS, EVENTS, BEGIN = 20, 600, 1_700_000_000.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a history of twenty cells, the 17th of which drifts."""
    made = tmp_path_factory.mktemp("history") / "events"
    cells = [Invented(k, BEGIN, 1.0 / 60.0, drifts=k == 17) for k in range(CELLS)]
    with History(made, 4, 16.0) as history:
        history.write(
            [
                Kept(CellName("site", "m", cell.name), 0, cell.event(number))
                for cell in cells
                for number in range(1, EVENTS + 1)
            ]
        )
    return made


def test_the_cell_with_the_growing_lag_is_named_and_no_other(folder: Path) -> None:
    """Ten hours of cycles, in spans of half an hour; its lag has grown to 0.110 s."""
    end = BEGIN + EVENTS * 60.0
    found = figures_over(folder, BEGIN, end, 1800.0)
    assert {(d.cell, d.figure) for d in found if d.drifts} == {
        ("m/made_up_017", "lag of the robot [s] MILK")
    }
    assert len(found) == 2 * CELLS
    assert found[0].now == pytest.approx(0.110, abs=0.006)


def test_figures_are_counted_from_the_files(folder: Path) -> None:
    """By the kinds, keys and outcomes that a cell's journal writes."""
    end = BEGIN + EVENTS * 60.0
    rows = figures_of(folder, end - 6000.0, end, {"MILK": 6.0})
    assert len(rows) == CELLS + 1 and rows[-1].cell == ""
    row = next(row for row in rows if row.cell == "m/made_up_002")
    # Of ten events seven are cycles; one is a start, one a pause.
    assert row.cycles == row.done == 70 and row.cycle_s == pytest.approx(CYCLE_S)
    assert (row.stops, row.failures, row.parts) == (10, 0, 210)
    assert row.quality_ratio == 1.0 and row.effectiveness == pytest.approx(6.0 / CYCLE_S)
    assert rows[0].effectiveness is None


def test_stops_are_counted_by_their_cause(folder: Path) -> None:
    """Of ten events of each cell one is a pause: all have one cause, and the last is told."""
    since = BEGIN + (EVENTS - 100) * 60.0
    (found,) = stops_by_cause(folder, since)
    assert (found.cause, found.times, found.cells) == ("PAUSE", 10 * CELLS, CELLS)
    assert since <= found.first < found.last == BEGIN + (EVENTS - 5) * 60.0
    assert found.last_in.startswith("m/made_up_") and "PAUSE by the operator" in found.last_text
    sql, values = causes(Wanted(since, cell="made_up_003", limit=2))
    answer = ask(folder, sql, values)
    assert answer.names[:3] == ["cause", "times", "cells"]
    # Without a choice all kinds count; the most frequent first, and no more than asked for.
    assert [row[:3] for row in answer.rows] == [("done", 71, 1), ("R[5] is slow", 10, 1)]


def test_a_farm_without_history_has_no_figures(tmp_path: Path) -> None:
    """And that is no fault."""
    assert figures_of(tmp_path, 0.0, 1.0, {}) == [] == figures_over(tmp_path, 0.0, 1e6, 86400.0)
    assert stops_by_cause(tmp_path, 0.0) == []


def test_the_words_are_those_of_the_journal() -> None:
    """The desk knows no ROS, so it has its own; they must not part."""
    assert entries.DONE == DONE
    assert set(DRIFTING.values()) <= set(entries.Cycle.__struct_fields__)
