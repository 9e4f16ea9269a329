"""Events of one cell, each once and in the order of their numbers, however they come; pure.

What comes live may have gaps. Then the cell's journal is asked by number, and what that no longer
has is gone. Numbers that begin again are a new journal: its era is one higher.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import msgspec

from farm.wire import Event, Events

MOST_WAITING = 1000
"""Our choice: events beyond a gap that are kept; the journal has the others."""


class Progress(msgspec.Struct, frozen=True):
    """How far the events of one cell have come.

    Attributes:
        era: Counts the journals that this cell has begun, from 0.
        last: Number of the newest event that was taken; 0: none.
        waiting: Events beyond a gap, by number.
        missing: Numbers that the journal no longer had.
    """

    era: int = 0
    last: int = 0
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
    return _ready(msgspec.structs.replace(progress, waiting=waiting))


def take_health(progress: Progress, last_event: int) -> bool:
    """Return whether to ask the journal, whose newest number is this."""
    return last_event != progress.last


def take_answer(progress: Progress, asked: int, answer: Events) -> Taken:
    """Take an answer of the journal.

    Args:
        progress: How far the events have come now.
        asked: ``progress.last`` when the question was sent.
        answer: The events after ``asked``, as many as fit. It counts for nothing if the progress
            was set back meanwhile.
    """
    if progress.last < asked:
        return Taken(progress, (), True)
    # Numbers never fall within a journal, so this is another one, as after its folder was removed.
    if answer.last < asked:
        anew = Progress(era=progress.era + 1, missing=progress.missing)
        return Taken(anew, (), ask=answer.last > 0)
    events: list[Event] = []
    last, missing = progress.last, progress.missing
    for event in answer.events:
        if event.number <= last:
            continue
        missing += event.number - last - 1
        events.append(event)
        last = event.number
    if not answer.events and answer.last > last:
        # Numbers of which the journal has no line any more.
        missing += answer.last - last
        last = answer.last
    waiting = {number: event for number, event in progress.waiting.items() if number > last}
    moved = msgspec.structs.replace(progress, last=last, missing=missing, waiting=waiting)
    taken = _ready(moved)
    more = taken.ask or answer.last > taken.progress.last
    return Taken(taken.progress, (*events, *taken.events), more)


def _ready(progress: Progress) -> Taken:
    """Take what waits and follows directly."""
    waiting, last = dict(progress.waiting), progress.last
    events: list[Event] = []
    while (event := waiting.pop(last + 1, None)) is not None:
        events.append(event)
        last += 1
    moved = msgspec.structs.replace(progress, last=last, waiting=waiting)
    return Taken(moved, tuple(events), bool(waiting))
