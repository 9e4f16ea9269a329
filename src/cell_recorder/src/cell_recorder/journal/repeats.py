"""Keep what flickers from filling the journal: of the same again and again, some and a count."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

from msgspec.structs import replace

from cell_recorder.journal.alarms import words
from cell_recorder.journal.entries import Alarm, Audit, Decision, Entry, Gap

_Key: TypeAlias = tuple[str | bool, ...]


@dataclass
class _Seen:
    """What was seen of one key since the beginning of its span."""

    since: float
    kept: int = 0
    lost: int = 0
    first: float = 0.0
    held: Entry | None = None


class Repeats:
    """Lets entries through, except those that come too often. Times are Unix time [s].

    Of entries that differ in numbers of their reasons only, ``most`` are kept in a span of
    ``span_s``. What comes beyond is held back until the span ends: then the newest one is kept,
    with a gap before it that says how many came. While it goes on, each span keeps those two.
    Decisions stay in the order in which they came: one that is kept ends the spans of those that
    are held back. Not thread-safe.
    """

    def __init__(self, most: int, span_s: float) -> None:
        """Know nothing."""
        self._most, self._span_s = most, span_s
        # In the order in which what is held back came.
        self._seen: dict[_Key, _Seen] = {}

    def take(self, now: float, entry: Entry) -> list[Entry]:
        """Return what to keep of an entry: itself, behind older decisions, or nothing yet."""
        key = _key(entry)
        if not key:
            return [entry]
        seen = self._seen.setdefault(key, _Seen(now))
        if seen.kept < self._most:
            seen.kept += 1
            # Behind a stop, an older decision would say that the pair went on.
            older = self._decisions() if isinstance(entry, Decision) else []
            return [*self._tell(now, older), entry]
        seen.first = seen.first if seen.lost else now
        seen.lost += 1
        seen.held = entry if entry.time else replace(entry, time=now)
        self._seen[key] = self._seen.pop(key)
        return []

    def look(self, now: float) -> list[Entry]:
        """Return what to keep of the spans that have ended; ask once a second."""
        told: list[Entry] = []
        for key in list(self._seen):
            seen = self._seen[key]
            # A clock that was set back ends a span too.
            if 0.0 <= now - seen.since < self._span_s:
                continue
            if seen.held is None:
                del self._seen[key]
            else:
                # One decision that is told takes the others with it, in their order.
                alike = self._decisions() if isinstance(seen.held, Decision) else [key]
                told += self._tell(now, alike)
        return told

    def close(self) -> list[Entry]:
        """Return what is still held back."""
        return [entry for seen in self._seen.values() for entry in self._counted(seen)]

    def _decisions(self) -> list[_Key]:
        """Return the keys of the decisions that are held back, the oldest first."""
        return [key for key, seen in self._seen.items() if isinstance(seen.held, Decision)]

    def _tell(self, now: float, keys: Iterable[_Key]) -> list[Entry]:
        """Return what is held back of some keys, and begin their next span."""
        told: list[Entry] = []
        for key in keys:
            told += self._counted(self._seen[key])
            # It goes on: of the next span nothing is let through at once.
            self._seen[key] = _Seen(now, kept=self._most)
        return told

    def _counted(self, seen: _Seen) -> list[Entry]:
        """Return the newest entry of those that were held back, with a gap for the others."""
        held, lost = seen.held, seen.lost - 1
        if held is None:
            return []
        if not lost:
            return [held]
        why = f"the same {held.kind} again and again: more than {self._most} in {self._span_s:g} s"
        gap = Gap(time=held.time, lost=lost, since=seen.first, until=held.time, why=why)
        return [gap, held]


def _key(entry: Entry) -> _Key:
    """Return what makes an entry the same as another; empty: each is kept."""
    if isinstance(entry, Decision):
        modes = (entry.mode_before, entry.event, entry.mode_after)
        return (entry.kind, *modes, words(entry.why), entry.who)
    if isinstance(entry, Audit):
        # Numbers of a command count: to another place is another command.
        return (entry.kind, entry.who, entry.what, entry.success, words(entry.outcome))
    if isinstance(entry, Alarm):
        # Its end and its other words count too: an alarm that comes and goes is what flickers.
        return (entry.kind, entry.source)
    return ()
