"""Alarms of all cells: raised, acknowledged, shelved, cleared; pure: ``now`` is an argument.

In the spirit of ISA 18.2. An alarm that has gone stays on the list until somebody has acknowledged
it. One that is shelved is out of the way until a time that its shelving named, and is still listed
as shelved. What the cells say and what people mark are kept apart, so that both can be read again
from their files in any order.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

import msgspec

from farm.wire import Event

LINK = "link"
"""Source of the alarm that a cell is lost; the desk raises it itself."""
ERROR = "error"
LONGEST_SHELF_S = 8 * 3600.0
"""Our choice: a shift. Who comes next shelves again, or looks."""


class AlarmStatus(str, Enum):
    """How an alarm is."""

    RAISED = "raised"
    CLEARED = "cleared, not acknowledged"
    ACKNOWLEDGED = "acknowledged"
    SHELVED = "shelved"


class Mark(msgspec.Struct, frozen=True):
    """What a person did to an alarm.

    Attributes:
        id: Of the alarm: MACHINE/CELL and source, see :func:`alarm_id`.
        person: Who, as PERSON@DESK.
        time: When [s since 1970].
        raised: The newest raising that the person has seen; what is raised later is not covered.
        times: How often it had been raised then.
        until: Shelved until then; 0: this acknowledges, or takes off the shelf.
        why: Reason of the shelving.
        acknowledges: Whether it acknowledges.
        level: Of the alarm then: the shelf of a warning hides no error. Older marks hide all.
    """

    id: str
    person: str
    time: float
    raised: float
    times: int
    until: float
    why: str
    acknowledges: bool
    level: str = ERROR


class SeenAlarm(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """An alarm as a person saw it when they marked it.

    Attributes:
        id, raised, level: See :class:`AlarmRow`.
    """

    id: str
    raised: float
    level: str


class AlarmRow(msgspec.Struct, frozen=True):
    """One alarm as people see it.

    Attributes:
        id: For :meth:`AlarmBook.acknowledge` and :meth:`AlarmBook.shelve`.
        cell: MACHINE/CELL.
        source: Which of the cell's alarms.
        level: warning or error.
        status: How it is.
        text: In words.
        raised: When it was raised last [s since 1970].
        times: How often, since it was acknowledged.
        cleared: When it went; 0: it is still there.
        person: Who has acknowledged or shelved it, or empty.
        marked: When.
        until: Of a shelved one: until when.
        why: Of a shelved one.
    """

    id: str
    cell: str
    source: str
    level: str
    status: AlarmStatus
    text: str
    raised: float
    times: int
    cleared: float
    person: str = ""
    marked: float = 0.0
    until: float = 0.0
    why: str = ""

    @property
    def seen(self) -> SeenAlarm:
        """What a mark of somebody who sees this row names."""
        return SeenAlarm(self.id, self.raised, self.level)


class MarkError(ValueError):
    """What cannot be done to an alarm; the text says why and what is allowed."""


@dataclass
class _KnownAlarm:
    """What a cell said of one alarm."""

    cell: str
    source: str
    level: str
    text: str
    raised: float
    times: int = 1
    cleared: float = 0.0


@dataclass
class AlarmBook:
    """Knows all alarms; one thread at a time uses it."""

    known: dict[str, _KnownAlarm] = field(default_factory=dict)
    acknowledged: dict[str, Mark] = field(default_factory=dict)
    shelved: dict[str, Mark] = field(default_factory=dict)

    def told(self, cell: str, event: Event) -> None:
        """Take in an event of a cell's journal; those that are no alarms are passed over.

        Args:
            cell: MACHINE/CELL.
            event: Each one once, in the order of their numbers.
        """
        if event.kind == "start":
            # What is still active is raised anew by the journal after its start.
            for known in self.known.values():
                if known.cell == cell and known.source != LINK:
                    # What had gone before keeps its own time.
                    known.cleared = known.cleared or event.time
        elif event.kind == "alarm":
            body, source = event.body, str(event.body.get("source", ""))
            if body.get("active", True):
                level, text = str(body.get("level", "")), str(body.get("text", ""))
                self._raise(cell, source, level, text, event.time)
            else:
                self._clear(cell, source, event.time)

    def lost(self, cell: str, since: float) -> None:
        """Take in that a cell's link has gone."""
        self._raise(cell, LINK, ERROR, "the cell is lost: nothing is known of it", since)

    def found(self, cell: str, now: float) -> None:
        """Take in that it is there again."""
        self._clear(cell, LINK, now)

    def read(self, mark: Mark) -> None:
        """Take a mark, as it was made now or is read again."""
        if mark.acknowledges:
            self.acknowledged[mark.id] = mark
        else:
            self.shelved[mark.id] = mark

    def check_seen(self, seen: SeenAlarm, shelves: bool) -> None:
        """Refuse a mark for what a person has not seen.

        Args:
            seen: The alarm as the person saw it.
            shelves: Whether it is put on the shelf or taken off. What is raised again stays there,
                as nobody could shelve what comes and goes all the time.

        Raises:
            MarkError: There is no such alarm, or it was raised again, or has become worse.
        """
        known = self._known(seen.id)
        worse = known.level == ERROR != seen.level
        if worse or (known.raised != seen.raised and not shelves):
            raise MarkError(f"{seen.id}: has changed since: look again")

    def acknowledge(self, name: str, person: str, now: float) -> Mark:
        """Return the mark of somebody who has looked at an alarm.

        Raises:
            MarkError: There is no such alarm, or nothing to acknowledge.
        """
        known = self._known(name)
        if self._is_acknowledged(name, known):
            raise MarkError(f"{name}: is acknowledged, by {self.acknowledged[name].person}")
        return Mark(name, person, now, known.raised, known.times, 0.0, "", True)

    def shelve(self, name: str, person: str, now: float, seconds: float, why: str) -> Mark:
        """Return the mark of somebody who puts an alarm out of the way for a time.

        Args:
            name: Of the alarm.
            person: Who.
            now: Time [s since 1970].
            seconds: For how long; 0: it is taken off the shelf.
            why: In words; must be given, except when it is taken off.

        Raises:
            MarkError: There is no such alarm, the time is too long, or the reason is missing.
        """
        known = self._known(name)
        if not 0.0 <= seconds <= LONGEST_SHELF_S:
            most = LONGEST_SHELF_S / 3600.0
            raise MarkError(f"{name}: {seconds / 3600.0:.2f} h: allowed are 0 to {most:g} h")
        if seconds and not why.strip():
            raise MarkError(f"{name}: say why it is shelved: others will ask")
        until = now + seconds if seconds else 0.0
        why = why.strip()[:300]
        return Mark(name, person, now, known.raised, known.times, until, why, False, known.level)

    def rows(self, now: float) -> list[AlarmRow]:
        """Return what asks for somebody: raised ones first, then cleared, acknowledged, shelved."""
        rows = [self._row(name, known, now) for name, known in self.known.items()]
        # The enumeration lists them in the order of their urgency.
        ranks = {status: rank for rank, status in enumerate(AlarmStatus)}
        return sorted(
            (row for row in rows if row is not None),
            key=lambda row: (ranks[row.status], row.level != ERROR, -row.raised, row.id),
        )

    def _raise(self, cell: str, source: str, level: str, text: str, time: float) -> None:
        name = alarm_id(cell, source)
        known = self.known.get(name)
        if known is None:
            self.known[name] = _KnownAlarm(cell, source, level, text, time)
            return
        worse = level == ERROR != known.level
        # Other words of an alarm that is there are no new one, something worse is.
        if known.cleared or worse:
            known.raised, known.cleared = time, 0.0
            known.times += 1
        known.level, known.text = level, text

    def _clear(self, cell: str, source: str, time: float) -> None:
        known = self.known.get(alarm_id(cell, source))
        if known is not None and not known.cleared:
            known.cleared = time

    def _known(self, name: str) -> _KnownAlarm:
        if name not in self.known:
            listed = ", ".join(sorted(self.known)[:20]) or "none"
            raise MarkError(f"{name}: no such alarm; there are: {listed}")
        return self.known[name]

    def _is_acknowledged(self, name: str, known: _KnownAlarm) -> bool:
        mark = self.acknowledged.get(name)
        if mark is None:
            return False
        # By the count, too: a cell whose clock was set back raises anew at an earlier time.
        return mark.raised >= known.raised and mark.times >= known.times

    def _row(self, name: str, known: _KnownAlarm, now: float) -> AlarmRow | None:
        """Return an alarm as it is; None: it has gone and somebody has seen it."""
        acknowledged, shelf = self._is_acknowledged(name, known), self.shelved.get(name)
        if known.cleared and acknowledged:
            return None
        seen = self.acknowledged.get(name)
        # The count begins again with the first raising after an acknowledgement.
        times = known.times - (seen.times if seen is not None and not acknowledged else 0)
        row = AlarmRow(
            name,
            known.cell,
            known.source,
            known.level,
            AlarmStatus.CLEARED if known.cleared else AlarmStatus.RAISED,
            known.text,
            known.raised,
            max(1, times),
            known.cleared,
        )
        replace = msgspec.structs.replace
        if acknowledged and seen is not None:
            row = replace(
                row, status=AlarmStatus.ACKNOWLEDGED, person=seen.person, marked=seen.time
            )
        worse = shelf is not None and known.level == ERROR != shelf.level
        if shelf is not None and now < shelf.until and not worse:
            row = replace(
                row,
                status=AlarmStatus.SHELVED,
                person=shelf.person,
                marked=shelf.time,
                until=shelf.until,
                why=shelf.why,
            )
        return row


def alarm_id(cell: str, source: str) -> str:
    """Return the name of an alarm.

    Example:
        >>> alarm_id("pc_2/milk", "link")
        'pc_2/milk: link'
    """
    return f"{cell}: {source}"
