"""Who is there, worst first."""

from __future__ import annotations

import pytest
from farm.desk.roster import LOST, SILENT, Roster
from farm.keys import CellName
from farm.wire import CellState, Health, Level

A, B, C, D = (CellName("s", "m", name) for name in "abcd")


def state(
    sequence: int, level: Level = Level.GOOD, mode: str = "working", **more: str
) -> CellState:
    """Return a state."""
    return CellState(sequence, float(sequence), 1, level, mode, **more)


def there(now: float) -> Roster:
    """Return a roster with one cell, whose link has come."""
    roster = Roster(2.0)
    roster.alive(A, now)
    return roster


def test_the_worst_cell_comes_first() -> None:
    """Lost above bad, bad above a warning, then who became so last, then by name."""
    roster = Roster(2.0)
    for cell in (A, B, C, D):
        roster.alive(cell, 10.0)
    roster.shown(A, state(1), 10.0)
    roster.shown(B, state(1, Level.BAD, alarm="fan"), 10.0)
    roster.shown(C, state(1, Level.WARN), 10.0)
    roster.gone(D, 11.0)
    rows = roster.rows(11.5)
    assert [row.name for row in rows] == ["m/d", "m/b", "m/c", "m/a"]
    assert (rows[0].status, rows[0].since) == (LOST, 11.0) and rows[1].text == "fan"
    assert roster.lost() == {"m/d": 11.0}
    roster.gone(A, 12.0)
    assert [row.name for row in roster.rows(12.0)][:2] == ["m/a", "m/d"]


def test_a_cell_that_is_there_and_says_nothing_is_silent() -> None:
    """Its last state is old; it is shown as what it is."""
    roster = there(0.0)
    row = roster.rows(1.0)[0]
    assert (row.age_s, row.last_event, row.cpu_percent, row.memory_mb) == (0.0, 0, 0.0, 0.0)
    roster.shown(A, state(1), 1.0)
    assert (roster.rows(2.9)[0].status, roster.rows(2.5)[0].age_s) == ("working", 1.5)
    row = roster.rows(3.1)[0]
    assert (row.status, row.level, row.since) == (SILENT, Level.BAD, 1.0)
    # The desk's clock was set back meanwhile.
    assert roster.rows(-9.0)[0].status == SILENT


def test_a_cell_of_the_history_is_lost_until_it_comes() -> None:
    """A desk that was off knows whom to miss, and since when."""
    roster = Roster(2.0)
    roster.remember(A, 5.0)
    assert [(r.status, r.since) for r in roster.rows(9.0)] == [(LOST, 5.0)]
    roster.alive(A, 9.0)
    roster.remember(A, 5.0)
    assert roster.rows(9.1)[0].status != LOST


def test_a_clock_that_is_not_known_yet_counts_as_the_desks() -> None:
    """What is sent a tenth of a second after a cell has joined is missed already."""
    roster = there(10.0)
    for sequence, stamp in ((7, 9.9), (9, 10.1), (12, 10.2)):
        roster.shown(A, CellState(sequence, stamp, 1, Level.GOOD, "working"), 10.3)
    assert roster.counted()[A] == (3, 2)


def test_states_that_did_not_come_are_counted() -> None:
    """A link that was started again counts from 1; an old state is left out."""
    roster = Roster(2.0)
    for sequence in (1, 2, 5, 4):
        roster.shown(A, state(sequence), 0.0)
    roster.shown(A, CellState(1, 9.0, 2, Level.GOOD, "working"), 1.0)
    assert roster.counted()[A] == (4, 2)
    assert roster.entries[A].state is not None and roster.entries[A].state.stamp == 9.0


def test_a_journal_that_cannot_be_read_is_told() -> None:
    """A good cell without its memory needs a look."""
    roster = there(0.0)
    roster.shown(A, state(1), 0.0)
    roster.told(A, Health(0.0, 1.0, 0.5, 30.0, 1, 7, 0, "permission denied"), 0.0)
    row = roster.rows(0.1)[0]
    assert row.level == Level.WARN and "permission denied" in row.text and row.last_event == 7


def test_since_is_when_the_mode_began() -> None:
    """Not when the last state came."""
    roster = there(0.0)
    for sequence, mode in enumerate(("one", "two", "two"), 1):
        roster.shown(A, state(sequence, mode=mode), float(sequence))
    assert roster.rows(3.5)[0].since == 2.0


@pytest.mark.parametrize("ahead", [-3600.0, -62.0, -0.6, -0.4, 0.0, 0.4, 0.6, 62.0, 3600.0])
def test_a_clock_that_differs_is_shown_and_warned_of(ahead: float) -> None:
    """From half a second on; a message that was long on its way is not the clock."""
    roster = there(10.0)
    roster.shown(A, state(1), 10.0)
    assert roster.rows(10.0)[0].clock_s is None
    for now, way in ((10.0, 0.9), (11.0, 0.01), (12.0, 0.3)):
        roster.told(A, Health(now + ahead - way, 1.0, 0.5, 30.0, 1, 7, 0), now)
    row = roster.rows(11.9)[0]
    assert row.clock_s == pytest.approx(ahead - 0.01)
    assert (row.level is Level.WARN) == (abs(ahead) > 0.5) == ("the desk's" in row.text)


def test_a_clock_does_not_hide_an_alarm() -> None:
    """What is worse is told."""
    roster = there(10.0)
    roster.shown(A, state(1, Level.BAD, alarm="fan"), 10.0)
    roster.told(A, Health(72.0, 1.0, 0.5, 30.0, 1, 7, 0), 10.0)
    assert (roster.rows(10.0)[0].level, roster.rows(10.0)[0].text) == (Level.BAD, "fan")


@pytest.mark.parametrize("ahead", [None, -3600.0, 0.0, 3600.0])
def test_what_was_sent_before_a_cell_had_joined_is_not_lost(ahead: float | None) -> None:
    """A desk that comes late gets one old state that waited; by the desk's clock, if it knows."""
    roster = there(10.0)
    if ahead is not None:
        roster.told(A, Health(10.0 + ahead, 1.0, 0.5, 30.0, 1, 7, 0), 10.0)
    for sequence in (7, 12, 13, 15):
        at = sequence + (ahead or 0.0)
        roster.shown(A, CellState(sequence, at, 1, Level.GOOD, "working"), 20.0)
    assert roster.counted()[A] == (4, 1)


def test_a_link_that_begins_anew_with_a_clock_set_back_is_shown() -> None:
    """It counts from 1 at an earlier time; without a word it would be silent for an hour."""
    roster = there(5000.0)
    roster.shown(A, CellState(900, 5000.0, 1, Level.GOOD, "working"), 5000.0)
    roster.gone(A, 5001.0)
    roster.alive(A, 5002.0)
    roster.shown(A, CellState(1, 1402.0, 1, Level.GOOD, "IDLE"), 5002.0)
    assert roster.rows(5002.1)[0].status == "IDLE"
