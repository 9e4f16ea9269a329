"""What the desk's page shows: cards, the worst, equal alarms as one, events in words; pure.

A page keeps each card where it is, so cards come in the order of their names and only the names of
the worst come in the order of how bad they are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import msgspec
from scara_ros.page.page_words import mode_change, people

from farm.desk.alarms import AlarmRow, AlarmStatus, SeenAlarm
from farm.desk.roster import Alike, Row, alike, status_title, status_tone
from farm.wire import CellState, Event, Level

TONES = {Level.WARN: "warn", Level.BAD: "bad"}
"""Of levels that ask for somebody; the others have the tone of their mode."""
ASKING = ("bad", "warn")
WAITING = (AlarmStatus.RAISED, AlarmStatus.CLEARED)
"""Alarms that wait for somebody."""


class Card(msgspec.Struct, frozen=True):
    """One cell on the wall.

    Attributes:
        name: MACHINE/CELL.
        short: As people say it: without its machine where no other machine has such a cell.
        tone: CSS class: that of the mode on the operator's page, warn or bad where it is worse.
        title: Its mode in the operator page's words, or Lost, Silent, Starting.
        since: Since when [s since 1970, the desk's clock].
        text: What is wrong, or what it does.
        facts: What else a person looks at.
    """

    name: str
    short: str
    tone: str
    title: str
    since: float
    text: str
    facts: list[str]


class AlarmGroup(msgspec.Struct, frozen=True):
    """Equal alarms of one or of several cells: one source, one level, one text.

    Attributes:
        source: Which of a cell's alarms.
        level: warning or error.
        text: In words.
        status: How the most urgent of them is.
        alarms: All of them, as a mark names them.
        waiting: Those that wait for somebody.
        cells: Whose they are, as people say it, in the order of ``alarms``.
        raised: When one of them was raised last [s since 1970].
        times: How often all were raised since they were acknowledged.
        cleared: When the last of them went; 0: one is still there.
        persons: Who has acknowledged or shelved some of them.
        marked: When that was done last; 0: never.
        until: Of shelved ones: when the first comes back; 0: none is shelved.
        why: Reasons of shelving.
    """

    source: str
    level: str
    text: str
    status: AlarmStatus
    alarms: list[SeenAlarm]
    waiting: list[SeenAlarm]
    cells: list[str]
    raised: float
    times: int
    cleared: float
    persons: list[str]
    marked: float
    until: float
    why: list[str]


class ShownEvent(msgspec.Struct, frozen=True):
    """One event as the page shows it.

    Attributes:
        cell: As people say it.
        number, time, kind, stop: See :class:`farm.wire.Event`.
        text: In words.
    """

    cell: str
    number: int
    time: float
    kind: str
    stop: bool
    text: str


class Wall(msgspec.Struct, frozen=True):
    """What a page shows.

    Attributes:
        now: The desk's time [s since 1970].
        trouble: Why events are not kept, or empty.
        lost: How many cells are lost or silent.
        cards: All cells, by name.
        worst: Names of those that ask for somebody, the worst first.
        alarms: The most urgent first.
        waiting: How many alarms wait for somebody.
        events: The newest first.
        configurations: Who has which.
        unreadable: How many messages could not be read: does a cell run another version?
    """

    now: float
    trouble: str
    lost: int
    cards: list[Card]
    worst: list[str]
    alarms: list[AlarmGroup]
    waiting: int
    events: list[ShownEvent]
    configurations: list[Alike]
    unreadable: int


def wall_of(
    now: float,
    rows: Sequence[Row],
    alarms: Sequence[AlarmRow],
    events: Iterable[tuple[str, Event]],
    trouble: str = "",
    unreadable: int = 0,
) -> Wall:
    """Return what a page shows.

    Args:
        now: Time [s since 1970].
        rows: All cells, the worst first.
        alarms: All alarms, the most urgent first.
        events: (MACHINE/CELL, event), the newest first.
        trouble: Why events are not kept.
        unreadable: How many messages could not be read.
    """
    # Names as people say them, with the machine only where that is needed. Alarms may be of cells
    # that are in no row: the history knows them.
    names = {row.name for row in rows} | {alarm.cell for alarm in alarms}
    own = {name: name.partition("/")[2] or name for name in names}
    times = Counter(own.values())
    short = {name: cell if times[cell] == 1 else name for name, cell in own.items()}
    cards = [_card(row, short) for row in rows]
    return Wall(
        now=now,
        trouble=trouble,
        lost=sum(row.is_away for row in rows),
        cards=sorted(cards, key=lambda card: card.name),
        worst=[card.name for card in cards if card.tone in ASKING],
        alarms=equal_alarms(alarms, short),
        waiting=sum(alarm.status in WAITING for alarm in alarms),
        events=[_shown(short.get(cell, cell), event) for cell, event in events],
        configurations=alike(rows),
        unreadable=unreadable,
    )


def equal_alarms(alarms: Iterable[AlarmRow], short: Mapping[str, str]) -> list[AlarmGroup]:
    """Return equal alarms as one each; the order is that of the most urgent of each."""
    found: dict[tuple[str, str, str], list[AlarmRow]] = {}
    for alarm in alarms:
        found.setdefault((alarm.source, alarm.level, alarm.text), []).append(alarm)
    return [_group(equal, short) for equal in found.values()]


def _group(equal: Sequence[AlarmRow], short: Mapping[str, str]) -> AlarmGroup:
    """Return one for all; the first is the most urgent."""
    first, by_name = equal[0], sorted(equal, key=lambda alarm: alarm.id)
    gone = all(alarm.cleared for alarm in equal)
    return AlarmGroup(
        source=first.source,
        level=first.level,
        text=people(first.text),
        status=first.status,
        alarms=[alarm.seen for alarm in by_name],
        waiting=[alarm.seen for alarm in by_name if alarm.status in WAITING],
        cells=[short.get(alarm.cell, alarm.cell) for alarm in by_name],
        raised=max(alarm.raised for alarm in equal),
        times=sum(alarm.times for alarm in equal),
        cleared=max(alarm.cleared for alarm in equal) if gone else 0.0,
        persons=sorted({alarm.person for alarm in equal if alarm.person}),
        marked=max(alarm.marked for alarm in equal),
        until=min((alarm.until for alarm in equal if alarm.until), default=0.0),
        why=sorted({alarm.why for alarm in equal if alarm.why}),
    )


def _card(row: Row, short: Mapping[str, str]) -> Card:
    tone = status_tone(row.status)
    if tone != "bad":
        tone = TONES.get(row.level, tone)
    facts = _facts(row.state) if row.state is not None and not row.is_away else []
    if row.missing:
        facts.append(f"{row.missing} events missing")
    title = status_title(row.status)
    return Card(row.name, short[row.name], tone, title, row.since, people(row.text), facts)


def _facts(state: CellState) -> list[str]:
    apart, speed = state.deviation_mm, state.speed_percent
    return [
        *([f"{apart:.2f} mm apart"] if apart is not None else []),
        *([f"speed {speed:.0f} %"] if speed is not None else []),
        *([f"{state.holder} is in control"] if state.holder else []),
        *(["the farm may move it"] if state.remote else []),
    ]


def _shown(cell: str, event: Event) -> ShownEvent:
    text, body = event.text, event.body
    if event.kind == "decision" and body:
        # As the operator's page tells it, and who has asked for it.
        change = mode_change(str(body.get("mode_before", "")), str(body.get("mode_after", "")))
        who = f", asked for by {body['who']}" if body.get("who") else ""
        text = f"{change}: {people(str(body.get('why', '')))}{who}"
    return ShownEvent(cell, event.number, event.time, event.kind, event.stop, text)
