"""Alarms from /diagnostics: raised once, cleared once, whatever is repeated meanwhile."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from scara_ros.diagnosis import Level

from cell_recorder.journal.entries import ERROR, WARNING, Alarm

SILENCE = ""
"""Source of the alarm that a node says nothing: a status may bear its node's own name."""
_NUMBER = re.compile(r"\d+(?:[.,]\d+)*")


@dataclass
class _Raised:
    """An alarm that is active."""

    level: int
    text: str
    raised: float
    away_since: float | None = None


class ActiveAlarms:
    """Knows what is active. Times are Unix time [s]; not thread-safe.

    An alarm is a status of one name, from one node. It is told when it is raised, when it becomes
    worse or says something else (numbers in it do not count), and when it has stayed away.
    """

    def __init__(self, hold_s: float, silent_s: float) -> None:
        """Know nothing.

        Args:
            hold_s: An alarm that stays away for so long is cleared.
            silent_s: A node that says nothing for so long is an alarm itself.
        """
        self._hold_s, self._silent_s = hold_s, silent_s
        self._raised: dict[tuple[str, str], _Raised] = {}
        self._heard: dict[str, float] = {}
        # When it was asked last: over a longer break nobody was listened to.
        self._looked = math.inf

    @property
    def active(self) -> int:
        """How many alarms are active."""
        return len(self._raised)

    def say(self, now: float, node: str, source: str, level: int, text: str) -> list[Alarm]:
        """Take one status.

        Args:
            now: When it came.
            node: Who has sent it.
            source: Its name.
            level: Of REP-107; anything above a warning is an error.
            text: Its message.
        """
        known = self._raised.get((node, source))
        if level <= Level.OK:
            if known is not None and known.away_since is None:
                known.away_since = now
            return []
        if known is None:
            self._raised[node, source] = known = _Raised(level, text, now)
            return [_entry(now, source, known)]
        known.away_since = None
        if level > known.level or words(text) != words(known.text):
            known.level, known.text = level, text
            return [_entry(now, source, known, changed=True)]
        return []

    def heard(self, now: float, node: str) -> None:
        """Take that a node has spoken."""
        self._heard[node] = now
        silent = self._raised.get((node, SILENCE))
        if silent is not None and silent.away_since is None:
            silent.away_since = now

    def look(self, now: float) -> list[Alarm]:
        """Return what has been cleared, and which node has fallen silent; ask once a second."""
        told = []
        # The clock was set forward, or this machine slept.
        if now - self._looked >= self._silent_s:
            self._heard = dict.fromkeys(self._heard, now)
        self._looked = now
        for node, last in list(self._heard.items()):
            # A clock that was set back must not keep a node from ever being silent.
            self._heard[node] = last = min(last, now)
            if now - last >= self._silent_s and (node, SILENCE) not in self._raised:
                known = _Raised(
                    Level.ERROR,
                    "says nothing any longer: has it ended, or does it hang? See ./cell status",
                    last,
                )
                self._raised[node, SILENCE] = known
                told.append(_entry(now, node, known))
        for (node, source), known in list(self._raised.items()):
            away = known.away_since
            if away is not None and not 0.0 <= now - away < self._hold_s:
                del self._raised[node, source]
                told.append(_entry(now, source or node, known))
        return told


def _entry(now: float, source: str, known: _Raised, changed: bool = False) -> Alarm:
    """Return the entry of an alarm as it is now."""
    away = known.away_since
    cleared = away is not None
    return Alarm(
        time=now,
        source=source,
        level=WARNING if known.level == Level.WARN else ERROR,
        active=not cleared,
        text=known.text,
        seconds=round(max(0.0, away - known.raised), 3) if away is not None else 0.0,
        raised=known.raised if cleared or changed else 0.0,
    )


def words(text: str) -> str:
    """Return a text without its numbers: a count that grows is no other alarm.

    Example:
        >>> words("12 log lines lost") == words("13 log lines lost")
        True
    """
    return _NUMBER.sub("#", text)
