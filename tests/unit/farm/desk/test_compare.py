"""What differs by more than its own scatter is marked, and nothing else."""

from __future__ import annotations

import random
from datetime import datetime, timezone

import pytest
from farm.desk.compare import Difference, EndedCycle, PairStop, Side, compare, week
from farm.desk.questions import QuestionError

DAY = 86400.0
NOON = datetime(2026, 11, 18, 12, tzinfo=timezone.utc)


def side(
    name: str, seed: int, error: float = 0.4, seconds: float = 12.0, jams: int = 0, days: int = 7
) -> Side:
    """Return a week of a cell: a hundred cycles a day, each day a little different."""
    chance, cycles = random.Random(seed), []
    for day in range(days):
        level = chance.gauss(1.0, 0.02)
        for k in range(100):
            at = DAY * (day + (k + 0.5) / 100.0)
            worst = error * level * chance.gauss(1.0, 0.1)
            cycles.append(
                EndedCycle(at, "MILK", seconds * chance.gauss(1.0, 0.01), worst, None, 3, 0)
            )
    stops = [PairStop(DAY * (k % days + 0.5), "jam") for k in range(jams)]
    return Side(name, 0.0, days * DAY, tuple(cycles), tuple(stops))


def marked(a: Side, b: Side) -> set[str]:
    """Return the figures that differ."""
    return {each.figure for each in compare(a, b) if each.differs}


@pytest.mark.parametrize("seed", range(50))
def test_two_weeks_of_a_steady_cell_do_not_differ(seed: int) -> None:
    """Though the days do."""
    assert marked(side("a", seed), side("b", seed + 1000, jams=1)) == set()


@pytest.mark.parametrize("seed", range(20))
def test_what_was_changed_is_marked_and_nothing_else(seed: int) -> None:
    """An error larger by a quarter, programs that take 10 % longer, three jams a day."""
    usual = side("a", seed)
    other = seed + 1000
    assert marked(usual, side("b", other, error=0.5)) == {"following error [mm] MILK"}
    assert marked(usual, side("b", other, seconds=13.2)) == {"cycle time [s] MILK"}
    assert marked(usual, side("b", other, jams=21)) == {"stops: jam [1/h]"}


def test_those_that_differ_come_first_with_their_values() -> None:
    """Rates are per hour of the time looked at; what one side does not have stays empty."""
    found = compare(side("a", 1), side("b", 2, jams=21))
    assert found[0] == Difference("stops: jam [1/h]", 0.0, 21 / 168, 0.0, True)
    rates = {each.figure: each for each in found}
    assert rates["parts placed [1/h]"].a == pytest.approx(2100 / 168)
    empty = Side("b", 0.0, 7 * DAY, (), ())
    alone = {each.figure: each for each in compare(side("a", 1), empty)}
    assert alone["cycle time [s] MILK"].b is None and not alone["cycle time [s] MILK"].differs
    assert alone["cycles done [1/h]"].b == 0.0 and alone["cycles done [1/h]"].differs


def test_too_few_days_mark_nothing() -> None:
    """A figure that was there in two spans has no scatter that is known."""
    short = side("b", 2, error=0.8)
    few = Side("b", 0.0, 7 * DAY, tuple(c for c in short.cycles if c.time < 2 * DAY), ())
    found = {each.figure: each for each in compare(side("a", 1), few)}
    assert found["following error [mm] MILK"].scatter is None
    assert not found["following error [mm] MILK"].differs


def test_a_short_time_is_looked_at_in_eighths() -> None:
    """Half a day has a scatter too."""
    usual, slow = side("a", 1, days=1), side("b", 2, seconds=15.0, days=1)
    assert "cycle time [s] MILK" in marked(usual, slow)


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
