"""An alarm stays until somebody has looked, and who did what to it is kept."""

from __future__ import annotations

import pytest
from farm.desk.alarms import AlarmBook, AlarmStatus, Mark, MarkError, alarm_id
from farm.wire import Event
from hypothesis import given
from hypothesis import strategies as st

CELL, SOURCE = "m/a", "real: link"
NAME = alarm_id(CELL, SOURCE)


def said(time: float, active: bool = True, level: str = "warning", text: str = "slow") -> Event:
    """Return an alarm of the journal; one that does not say whether it lasts does."""
    body = {"source": SOURCE, "level": level, "text": text} | ({} if active else {"active": False})
    return Event(int(time), time, "alarm", False, text, body)


def told(*events: Event) -> AlarmBook:
    """Return a book that was told events."""
    book = AlarmBook()
    for event in events:
        book.told(CELL, event)
    return book


def statuses(book: AlarmBook, now: float = 100.0) -> list[AlarmStatus]:
    """Return how all alarms are."""
    return [row.status for row in book.rows(now)]


def acknowledge(book: AlarmBook, now: float) -> Mark:
    """Let somebody look."""
    mark = book.acknowledge(NAME, "ann@desk", now)
    book.read(mark)
    return mark


def test_an_alarm_that_went_stays_until_somebody_looks() -> None:
    """And is gone then."""
    book = told(said(1), said(2, active=False))
    (row,) = book.rows(100.0)
    assert (row.status, row.raised, row.cleared, row.times) == (AlarmStatus.CLEARED, 1.0, 2.0, 1)
    acknowledge(book, 3.0)
    assert book.rows(100.0) == []


def test_an_acknowledged_alarm_is_listed_while_it_lasts() -> None:
    """With who and when."""
    book = told(said(1))
    assert acknowledge(book, 3.0).until == 0.0
    (row,) = book.rows(100.0)
    assert (row.status, row.person, row.marked) == (AlarmStatus.ACKNOWLEDGED, "ann@desk", 3.0)
    book.told(CELL, said(9, active=False))
    assert book.rows(100.0) == []


def test_what_is_raised_after_a_look_asks_again() -> None:
    """Each raising is counted from the look on; a mark may come from a longer history."""
    book = told(said(1), said(2, active=False), said(3))
    assert book.rows(9.0)[0].times == 2
    acknowledge(book, 4.0)
    book.told(CELL, said(5, active=False))
    assert statuses(book) == []
    book.told(CELL, said(6))
    (row,) = book.rows(9.0)
    assert (row.status, row.times, row.raised) == (AlarmStatus.RAISED, 1, 6.0)
    book.read(Mark(NAME, "ann@desk", 4.0, 4.0, 9, 0.0, "", True))
    assert book.rows(9.0)[0].times == 1


def test_what_is_raised_after_a_look_asks_again_whatever_the_cells_clock_says() -> None:
    """Set back, it raises at a time before that of the look."""
    book = told(said(9))
    acknowledge(book, 10.0)
    book.told(CELL, said(11, active=False))
    book.told(CELL, said(3))
    assert statuses(book) == [AlarmStatus.RAISED]
    acknowledge(book, 12.0)
    assert statuses(book) == [AlarmStatus.ACKNOWLEDGED]


def test_other_words_are_no_new_alarm_and_something_worse_is() -> None:
    """Who has acknowledged a warning has not seen the error."""
    book = told(said(1))
    acknowledge(book, 2.0)
    book.told(CELL, said(3, text="slower"))
    assert statuses(book) == [AlarmStatus.ACKNOWLEDGED] and book.rows(9.0)[0].text == "slower"
    book.told(CELL, said(4, level="error"))
    assert statuses(book) == [AlarmStatus.RAISED]


def test_a_shelved_alarm_is_still_listed_and_comes_back_by_itself() -> None:
    """With who, until when, and why."""
    book = told(said(1))
    book.read(book.shelve(NAME, "ben@desk", 10.0, 60.0, "the fan comes tomorrow"))
    (row,) = book.rows(69.0)
    assert (row.status, row.person, row.until) == (AlarmStatus.SHELVED, "ben@desk", 70.0)
    assert row.why == "the fan comes tomorrow"
    assert statuses(book, 70.0) == [AlarmStatus.RAISED]
    taken_off = book.shelve(NAME, "ben@desk", 20.0, 0.0, "")
    book.read(taken_off)
    assert taken_off.until == 0.0 and statuses(book, 21.0) == [AlarmStatus.RAISED]


def test_a_shelf_does_not_hide_what_is_worse() -> None:
    """Who has shelved a warning has not seen the error; an equal one stays shelved."""
    book = told(said(1))
    book.read(book.shelve(NAME, "ben@desk", 10.0, 60.0, "the fan comes tomorrow"))
    book.told(CELL, said(11, active=False))
    book.told(CELL, said(12))
    assert statuses(book, 13.0) == [AlarmStatus.SHELVED]
    book.told(CELL, said(14, level="error"))
    assert statuses(book, 15.0) == [AlarmStatus.RAISED]
    book.read(book.shelve(NAME, "ben@desk", 16.0, 60.0, "the fan comes tomorrow"))
    assert statuses(book, 17.0) == [AlarmStatus.SHELVED]


def test_a_journal_that_begins_again_clears_what_it_does_not_tell_again() -> None:
    """It stays on the list, because nobody has looked."""
    book = told(said(1), Event(2, 5.0, "start"))
    assert statuses(book) == [AlarmStatus.CLEARED]


def test_a_journal_that_begins_again_says_nothing_of_other_alarms() -> None:
    """The desk raises the lost link itself; another cell has a journal of its own."""
    book = told(said(1))
    book.lost(CELL, 2.0)
    book.told("m/b", said(3))
    book.told(CELL, Event(4, 4.0, "start"))
    cleared = {row.id: row.cleared for row in book.rows(100.0)}
    other = alarm_id("m/b", SOURCE)
    assert cleared == {NAME: 4.0, alarm_id(CELL, "link"): 0.0, other: 0.0}


def test_a_lost_cell_is_an_alarm() -> None:
    """Until it is back and somebody has looked."""
    book = AlarmBook()
    book.lost(CELL, 7.0)
    book.lost(CELL, 7.0)
    (row,) = book.rows(9.0)
    assert (row.level, row.status, row.times) == ("error", AlarmStatus.RAISED, 1)
    book.found(CELL, 8.0)
    assert statuses(book) == [AlarmStatus.CLEARED]


@pytest.mark.parametrize(
    ("ask", "text"),
    [
        (lambda book: book.acknowledge("m/b: x", "ann", 1.0), "no such alarm; there are: m/a"),
        (lambda book: [acknowledge(book, 2.0) for _ in range(2)], "is acknowledged, by ann"),
        (lambda book: book.shelve(NAME, "ann", 1.0, 9e9, "why"), "2500000.00 h: .* 0 to 8 h"),
        (lambda book: book.shelve(NAME, "ann", 1.0, -1.0, "why"), "allowed are 0 to 8 h"),
        (lambda book: book.shelve(NAME, "ann", 1.0, float("nan"), "why"), "allowed are"),
        (lambda book: book.shelve(NAME, "ann", 1.0, 60.0, " "), "say why"),
    ],
)
def test_what_cannot_be_done_is_refused_with_a_reason(ask: object, text: str) -> None:
    """And nothing is changed."""
    with pytest.raises(MarkError, match=text):
        ask(told(said(1)))  # type: ignore[operator]


@given(st.lists(st.sampled_from(["raise", "clear", "look", "start"]), max_size=30))
def test_nothing_vanishes_unseen(steps: list[str]) -> None:
    """Whatever happens: an alarm that was raised since the last look is on the list."""
    book, unseen = AlarmBook(), False
    for time, step in enumerate(steps, 1):
        if step == "look":
            if unseen:
                acknowledge(book, float(time))
            unseen = False
        elif step == "start":
            book.told(CELL, Event(time, float(time), "start"))
        else:
            known = book.known.get(NAME)
            unseen |= step == "raise" and (known is None or bool(known.cleared))
            book.told(CELL, said(float(time), active=step == "raise"))
        seen = [row.status in (AlarmStatus.RAISED, AlarmStatus.CLEARED) for row in book.rows(1e3)]
        assert any(seen) == unseen
