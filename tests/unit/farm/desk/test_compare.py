"""What differs by more than its own scatter is marked, and nothing else."""

from __future__ import annotations

import random
from collections.abc import Callable
from datetime import datetime, timezone
from itertools import count
from pathlib import Path
from typing import TypeAlias

import pytest
from farm.desk.figures import Difference
from farm.desk.figures_io import compare_cells
from farm.desk.history_io import History, Kept
from farm.desk.questions import QuestionError, week
from farm.keys import CellName
from farm.wire import Event
from harness.running.thorough import thorough

DAY = 86400.0
NOON = datetime(2026, 11, 18, 12, tzinfo=timezone.utc)
JAM = {"event": "jam"}
Compare: TypeAlias = Callable[..., dict[str, Difference]]


def side(
    seed: int, error: float = 0.4, seconds: float = 12.0, jams: int = 0, days: int = 7
) -> list[Event]:
    """Return a week of a cell: a hundred cycles a day, each day a little different."""
    chance, events = random.Random(seed), []
    for day in range(days):
        level = chance.gauss(1.0, 0.02)
        for k in range(100):
            at = DAY * (day + (k + 0.5) / 100.0)
            body = {
                "worst_error_mm": error * level * chance.gauss(1.0, 0.1),
                "start": at - seconds * chance.gauss(1.0, 0.01),
                "end": at,
                "program": "MILK",
                "outcome": "done",
                "parts_placed": 3,
            }
            events.append(Event(0, at, "cycle", body=body))
    stops = (Event(0, DAY * (k % days + 0.5), "decision", True, "", JAM) for k in range(jams))
    return [*events, *stops]


@pytest.fixture
def compare(tmp_path: Path) -> Compare:
    """Return what compares two sides that begin at 0; its answer is in the order of the desk's."""
    numbers = count()

    def compared(a: list[Event], b: list[Event], days: int = 7) -> dict[str, Difference]:
        with History(tmp_path / f"{next(numbers)}", 4, 16.0) as history:
            for name, events in (("a", a), ("b", b)):
                history.write([Kept(CellName("s", "m", name), 0, event) for event in events])
        found = compare_cells(history.folder, ("a", "b"), 0.0, DAY * days).figures
        return {each.figure: each for each in found}

    return compared


def marked(found: dict[str, Difference]) -> set[str]:
    """Return the figures that differ."""
    return {each.figure for each in found.values() if each.differs}


@pytest.mark.parametrize("seed", [*range(2), *thorough(*range(2, 20))])
def test_two_weeks_of_a_steady_cell_do_not_differ(compare: Compare, seed: int) -> None:
    """Though the days do."""
    assert marked(compare(side(seed), side(seed + 1000, jams=1))) == set()


@pytest.mark.parametrize("seed", [0, 1, *thorough(*range(2, 7))])
@pytest.mark.parametrize(
    ("change", "figure"),
    [
        ({"error": 0.5}, "following error [mm] MILK"),
        ({"seconds": 13.2}, "cycle time [s] MILK"),
        ({"jams": 21}, "stops: jam [1/h]"),
    ],
    ids=["error larger by a quarter", "10 % slower", "three jams a day"],
)
def test_what_was_changed_is_marked_and_nothing_else(
    compare: Compare, seed: int, change: dict[str, float], figure: str
) -> None:
    """Against the scatter of the days."""
    assert marked(compare(side(seed), side(seed + 1000, **change))) == {figure}


def test_those_that_differ_come_first_with_their_values(compare: Compare) -> None:
    """Rates are per hour of the time looked at; what one side does not have stays empty."""
    found = compare(side(1), side(2, jams=21))
    assert next(iter(found.values())) == Difference("stops: jam [1/h]", 0.0, 21 / 168, 0.0, True)
    assert found["parts placed [1/h]"].a == pytest.approx(2100 / 168)
    alone = compare(side(1), [Event(0, 0.0, "start")])
    assert alone["cycle time [s] MILK"].b is None and not alone["cycle time [s] MILK"].differs
    assert alone["cycles done [1/h]"].b == 0.0 and alone["cycles done [1/h]"].differs


def test_too_few_days_mark_nothing(compare: Compare) -> None:
    """A figure that was there in two spans has no scatter that is known."""
    found = compare(side(1), side(2, error=0.8, days=2))
    assert found["following error [mm] MILK"].scatter is None
    assert not found["following error [mm] MILK"].differs


def test_a_short_time_is_looked_at_in_eighths(compare: Compare) -> None:
    """Half a day has a scatter too."""
    found = compare(side(1, days=1), side(2, seconds=15.0, days=1), days=1)
    assert "cycle time [s] MILK" in marked(found)


def test_weeks_are_named_or_counted_back() -> None:
    """This one goes as far as now."""
    assert week("0", NOON) == week("2026-W47", NOON)
    begin, end = week("1", NOON)
    assert end - begin == 7 * DAY and datetime.fromtimestamp(end, timezone.utc).weekday() == 0


@pytest.mark.parametrize("text", ["", "2026-W60", "next", "2026-W48", "-1"])
def test_what_is_no_week_is_told(text: str) -> None:
    """Nor is one that has not begun."""
    with pytest.raises(QuestionError, match="--weeks"):
        week(text, NOON)
