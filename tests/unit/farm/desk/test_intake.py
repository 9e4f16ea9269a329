"""Events come once and in order, however they come."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from farm.desk.intake import (
    MOST_WAITING,
    Progress,
    common_number,
    is_other,
    question,
    take_answer,
    take_health,
    take_live,
)
from farm.wire import Event, Events
from hypothesis import given
from hypothesis import strategies as st


def event(number: int) -> Event:
    """Return an event."""
    return Event(number, float(number), "audit")


def answer(numbers: range, first: int, last: int) -> Events:
    """Return an answer."""
    return Events(first, last, tuple(map(event, numbers)))


@dataclass
class Kept:
    """A desk's side of one cell: progress, and what was kept."""

    progress: Progress = field(default_factory=Progress)
    events: list[tuple[int, int]] = field(default_factory=list)
    ask: bool = False

    def take(self, taken: tuple) -> None:
        """Take over what came of an input."""
        self.progress, events, self.ask = taken
        self.events += [(self.progress.era, e.number) for e in events]


def test_events_in_order_are_taken_at_once() -> None:
    """Nothing is asked."""
    kept = Kept()
    for number in (1, 2, 3):
        kept.take(take_live(kept.progress, event(number)))
    assert [n for _, n in kept.events] == [1, 2, 3] and not kept.ask


def test_a_doubled_event_is_left_out() -> None:
    """A router that was lost may send twice."""
    kept = Kept(Progress(last=5))
    kept.take(take_live(kept.progress, event(5)))
    assert kept.events == []


def test_a_gap_is_asked_for_and_what_waited_follows() -> None:
    """In the order of the numbers."""
    kept = Kept(Progress(last=1))
    kept.take(take_live(kept.progress, event(4)))
    assert kept.events == [] and kept.ask
    kept.take(take_answer(kept.progress, 1, answer(range(2, 4), 1, 4)))
    assert [n for _, n in kept.events] == [2, 3, 4] and not kept.ask


def test_beyond_a_gap_the_events_nearest_to_it_are_kept() -> None:
    """They follow first; the journal has the others. No gap makes the desk grow."""
    kept = Kept(Progress(last=1))
    for number in range(MOST_WAITING + 30, 2, -1):
        kept.take(take_live(kept.progress, event(number)))
    assert sorted(kept.progress.waiting) == list(range(3, MOST_WAITING + 3)) and kept.ask
    kept.take(take_answer(kept.progress, 1, answer(range(2, 3), 1, MOST_WAITING + 30)))
    assert [n for _, n in kept.events] == list(range(2, MOST_WAITING + 3)) and kept.ask


def test_what_the_journal_no_longer_has_is_counted() -> None:
    """The desk goes on behind it."""
    kept = Kept(Progress(last=1))
    kept.take(take_answer(kept.progress, 1, answer(range(5, 7), 5, 6)))
    assert [n for _, n in kept.events] == [5, 6] and kept.progress.missing == 3
    kept.take(take_answer(kept.progress, 6, Events(5, 9)))
    assert kept.progress.missing == 6 and kept.progress.last == 9 and not kept.ask


def test_a_long_journal_is_read_in_pieces() -> None:
    """Until its end."""
    kept = Kept()
    kept.take(take_answer(kept.progress, 0, answer(range(1, 501), 1, 700)))
    assert kept.ask
    kept.take(take_answer(kept.progress, 500, answer(range(501, 701), 1, 700)))
    assert not kept.ask and kept.progress.last == 700


@pytest.mark.parametrize("count", [0, 1, 3])
def test_a_journal_that_begins_anew_is_another_era(count: int) -> None:
    """Its events are kept beside the old ones, none is taken for an old one."""
    kept = Kept(Progress(last=120))
    kept.take(take_answer(kept.progress, 120, Events(1, count)))
    assert kept.ask is (count > 0) and kept.progress.era == 1
    kept.take(take_answer(kept.progress, 0, answer(range(1, count + 1), 1, count)))
    assert kept.events == [(1, number) for number in range(1, count + 1)]


def again(number: int) -> Event:
    """Return an event of a number that is given once more."""
    return Event(number, number + 0.5, "audit")


def test_a_journal_that_lost_its_end_goes_on_behind_what_it_still_has() -> None:
    """After a power cut; its numbers are given again, with other times, and nothing comes twice."""
    kept = Kept(Progress(last=100, time=100.0, checked=False))
    kept.take(take_live(kept.progress, again(101)))
    assert kept.events == [] and kept.ask and question(kept.progress) == 99
    said = Events(1, 104, tuple(map(again, range(100, 105))))
    assert is_other(kept.progress, 100, said)
    known = {number: number + 1e-7 for number in range(97, 101)}
    compared = Events(1, 104, (event(97), event(98), again(99), again(100)))
    common = common_number(known, compared)
    kept.take(take_answer(kept.progress, 100, said, common))
    assert kept.ask and question(kept.progress) == common == 98
    kept.take(take_answer(kept.progress, 98, Events(1, 104, tuple(map(again, range(99, 105))))))
    assert kept.events == [(1, number) for number in range(99, 105)] and not kept.ask


def test_a_journal_that_is_shorter_goes_on_behind_what_it_still_has() -> None:
    """Nothing was written since the power cut: nothing is read again, and the next event counts."""
    kept, said = Kept(Progress(last=100, time=100.0, checked=False)), Events(1, 98)
    assert is_other(kept.progress, 100, said)
    kept.take(take_answer(kept.progress, 100, said, 98))
    assert kept.events == [] and not kept.ask
    kept.take(take_live(kept.progress, again(99)))
    assert kept.events == [(1, 99)]


def test_what_is_published_waits_until_the_journal_is_known_to_go_on() -> None:
    """By the newest event that was taken: its number, and its time as the history has it."""
    kept = Kept(Progress(last=5, time=5.0 + 1e-7, checked=False))
    assert take_health(kept.progress, 5)
    kept.take(take_live(kept.progress, event(6)))
    assert kept.events == [] and kept.ask
    kept.take(take_answer(kept.progress, 5, answer(range(5, 6), 1, 6)))
    assert kept.events == [(0, 6)] and not kept.ask
    assert kept.progress == Progress(last=6, time=6.0)


def test_an_answer_from_before_a_set_back_counts_for_nothing() -> None:
    """The disk was full meanwhile: nothing between is skipped."""
    taken = take_answer(Progress(last=2), 10, answer(range(11, 13), 1, 12))
    assert taken.progress == Progress(last=2) and taken.events == () and taken.ask


@pytest.mark.parametrize(("last", "ask"), [(5, False), (6, True), (4, True)])
def test_health_tells_what_was_missed(last: int, ask: bool) -> None:
    """The last event may have been dropped, and no other follows it."""
    assert take_health(Progress(last=5), last) is ask


@given(st.data())
def test_each_event_once_and_in_order_whatever_is_lost(data: st.DataObject) -> None:
    """Live events are lost, doubled and late; answers come in pieces; in the end all are there."""
    kept, published = Kept(), 0
    for _ in range(data.draw(st.integers(1, 25))):
        published += data.draw(st.integers(0, 4))
        for number in data.draw(st.lists(st.integers(1, max(1, published)), max_size=5)):
            if number <= published:
                kept.take(take_live(kept.progress, event(number)))
        if data.draw(st.booleans()):
            since, limit = kept.progress.last, data.draw(st.integers(1, 5))
            numbers = range(since + 1, min(published, since + limit) + 1)
            kept.take(take_answer(kept.progress, since, answer(numbers, 1, published)))
    while kept.progress.last < published:
        since = kept.progress.last
        numbers = range(since + 1, min(published, since + 3) + 1)
        kept.take(take_answer(kept.progress, since, answer(numbers, 1, published)))
    assert kept.events == [(0, n) for n in range(1, published + 1)]
    assert kept.progress.missing == 0
