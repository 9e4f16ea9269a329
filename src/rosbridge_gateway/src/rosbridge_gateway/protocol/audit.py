"""What a client does, as entries of the audit.

Each act is an entry when it begins, not each of its messages.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import msgspec

from rosbridge_gateway.protocol.rate import RateLimit

_QUIET = 10.0  # our choice: [s] without an act until the next one of its kind is told again
_RATE, _BURST = 5.0, 50.0  # our choice: entries a second, and at once; nobody may flood the audit
_KINDS = 256  # our choice: how many kinds of acts are remembered
_TEXT = 200  # our choice: longest text of an entry


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of the audit: what was done or refused, and what came of it."""

    what: str
    success: bool
    outcome: str


class Trail:
    """Decides which acts of one client are told."""

    def __init__(self, now: float) -> None:
        self._last: dict[tuple[str, bool], float] = {}
        self._limit = RateLimit(_RATE, _BURST, _BURST, now)
        self._untold = 0

    def note(
        self, what: str, details: Any, success: bool, outcome: Any, now: float
    ) -> Entry | None:
        """Return the entry of an act, or None when it goes on with one that has been told.

        Args:
            what: The kind of act: the operation and its name.
            details: What it was done with, for the entry.
            success: False if it was refused or failed.
            outcome: The answer, or the reason.
            now: Monotonic [s].
        """
        kind = (what, success)
        before = self._last.pop(kind, float("-inf"))
        if now - before >= _QUIET and not self._limit.allow(now):
            self._untold += 1
            return None
        self._last[kind] = now
        if len(self._last) > _KINDS:
            del self._last[next(iter(self._last))]
        if now - before < _QUIET:
            return None
        untold, self._untold = self._untold, 0
        more = f" ({untold} others not told)" if untold else ""
        return Entry(
            _short(f"{what} {_text(details)}".rstrip()), success, _short(_text(outcome)) + more
        )


def _text(value: Any) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return msgspec.json.encode(value).decode("utf-8", "replace")


def _short(text: str) -> str:
    return text if len(text) <= _TEXT else text[:_TEXT] + "..."
