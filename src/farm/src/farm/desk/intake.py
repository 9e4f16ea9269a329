"""Events of one cell, each once and in the order of their numbers, however they come; pure.

What comes live may have gaps. Then the cell's journal is asked by number, and what that no longer
has is gone. Numbers that are given again are of a new journal: its era is one higher. One that
has lost its end in a power cut is a new one from there on; that shows when its link comes again.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import msgspec

from farm.wire import Event, Events

MOST_WAITING = 1000
"""Our choice: events beyond a gap that are kept; the journal has the others."""
SAME_S = 1e-5
"""Our choice: times of one event differ by less; the history keeps microseconds."""


class Progress(msgspec.Struct, frozen=True):
    """How far the events of one cell have come.

    Attributes:
        era: Counts the journals that this cell has begun, from 0.
        last: Number of the newest event that was taken; 0: none.
        time: Its time [s since 1970]; None: not known.
        checked: The journal still has that event. Until this is known, what is published waits.
        waiting: Events beyond a gap, by number.
        missing: Numbers that the journal no longer had.
    """

    era: int = 0
    last: int = 0
    time: float | None = None
    checked: bool = True
    waiting: Mapping[int, Event] = {}
    missing: int = 0


class Taken(NamedTuple):
    """What came of an input: the new progress, events to keep, and whether to ask for more."""

    progress: Progress
    events: tuple[Event, ...]
    ask: bool


def take_live(progress: Progress, event: Event) -> Taken:
    """Take an event that was published.

    An event that was taken before is left out. One beyond the next number waits, and the journal is
    asked for those between.
    """
    # The bus may bring it twice, or the journal brought it first.
    if event.number <= progress.last:
        return Taken(progress, (), False)
    waiting = {**progress.waiting, event.number: event}
    if len(waiting) > MOST_WAITING:
        # The newest goes: what is nearest to the gap is of use first.
        del waiting[max(waiting)]
    moved = msgspec.structs.replace(progress, waiting=waiting)
    return _ready(moved) if progress.checked else Taken(moved, (), True)


def take_health(progress: Progress, last_event: int) -> bool:
    """Return whether to ask the journal, whose newest number is this."""
    return not progress.checked or last_event != progress.last


def question(progress: Progress) -> int:
    """Return the number behind which the journal is asked, to check it from the newest event on."""
    return progress.last if progress.checked else max(0, progress.last - 1)


def is_other(progress: Progress, asked: int, answer: Events) -> bool:
    """Return whether an answer shows another journal, or one that gives numbers again.

    Args:
        progress: How far the events have come now.
        asked: See :func:`take_answer`.
        answer: Of the journal.
    """
    if progress.last < asked:
        return False
    # Numbers never fall within a journal.
    if answer.last < asked:
        return True
    if progress.checked or progress.time is None:
        return False
    same = (event for event in answer.events if event.number == progress.last)
    return any(abs(event.time - progress.time) > SAME_S for event in same)


def common_number(known: Mapping[int, float], answer: Events) -> int:
    """Return the newest number of an event that both have; 0: there is none.

    Args:
        known: Times of events that were taken, by number [s since 1970].
        answer: Of the journal.
    """
    both = (event for event in answer.events if event.number in known)
    return max((e.number for e in both if abs(e.time - known[e.number]) <= SAME_S), default=0)


def take_answer(progress: Progress, asked: int, answer: Events, common: int = 0) -> Taken:
    """Take an answer of the journal.

    Args:
        progress: How far the events have come now.
        asked: ``progress.last`` when the question was sent.
        answer: The events after :func:`question`, as many as fit. It counts for nothing if the
            progress was set back meanwhile.
        common: Of another journal: the newest number that it shares with what was taken.
    """
    if progress.last < asked:
        return Taken(progress, (), True)
    # As after its folder was removed, or a power cut.
    if is_other(progress, asked, answer):
        anew = Progress(progress.era + 1, common, missing=progress.missing)
        return Taken(anew, (), ask=answer.last > common)
    events: list[Event] = []
    last, time, missing = progress.last, progress.time, progress.missing
    for event in answer.events:
        if event.number <= last:
            continue
        missing += event.number - last - 1
        events.append(event)
        last, time = event.number, event.time
    if not answer.events and answer.last > last:
        # Numbers of which the journal has no line any more.
        missing += answer.last - last
        last, time = answer.last, None
    waiting = {number: event for number, event in progress.waiting.items() if number > last}
    moved = Progress(progress.era, last, time, waiting=waiting, missing=missing)
    taken = _ready(moved)
    more = taken.ask or answer.last > taken.progress.last
    return Taken(taken.progress, (*events, *taken.events), more)


def _ready(progress: Progress) -> Taken:
    """Take what waits and follows directly."""
    waiting, last, time = dict(progress.waiting), progress.last, progress.time
    events: list[Event] = []
    while (event := waiting.pop(last + 1, None)) is not None:
        events.append(event)
        last, time = event.number, event.time
    moved = msgspec.structs.replace(progress, last=last, time=time, waiting=waiting)
    return Taken(moved, tuple(events), bool(waiting))
