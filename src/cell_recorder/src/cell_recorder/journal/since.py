"""Read what a person means by ``--since``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime, timedelta

ALLOWED = (
    "a time ago (30m, 2h, 3d), today, yesterday, a local time (14:00, 2026-11-22, "
    "2026-11-22T14:00), or the number of an entry (17)"
)
_AGO = re.compile(r"(\d{1,6}(?:\.\d{1,3})?) ?(s|min|m|h|d|w)(?: ago)?")
_UNITS = {"s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0, "d": 86400.0, "w": 7 * 86400.0}
_CLOCK = re.compile(r"\d{1,2}:\d{2}(?::\d{2})?")
_NUMBER = re.compile(r"#?(\d{1,18})")


class SinceError(ValueError):
    """A text that says no time and no number; it names what is allowed."""


@dataclass(frozen=True)
class Since:
    """From where on entries are wanted; the one that is not meant is zero.

    Args:
        time: Unix time [s].
        number: Of the first entry.
    """

    time: float = 0.0
    number: int = 0


def parse_since(text: str, now: datetime) -> Since:
    """Return what ``--since`` means.

    Args:
        text: See ``ALLOWED``.
        now: With the zone in which local times are meant; none: this machine's, with its summers.

    Raises:
        SinceError: The text is none of these, or lies in the future.

    Example:
        >>> from datetime import timezone
        >>> now = datetime(2026, 11, 22, 15, 0, tzinfo=timezone.utc)
        >>> parse_since("2h", now).time == parse_since("13:00", now).time
        True
        >>> parse_since("17", now)
        Since(time=0.0, number=17)
    """
    word = text.strip().lower()
    midnight = now.replace(hour=0, minute=0, second=0, microsecond=0)
    if found := _NUMBER.fullmatch(word):
        return Since(number=int(found[1]))
    if found := _AGO.fullmatch(word):
        return Since(time=max(0.0, now.timestamp() - float(found[1]) * _UNITS[found[2]]))
    if word == "today":
        return Since(time=_local(midnight))
    if word == "yesterday":
        return Since(time=_local(midnight - timedelta(days=1)))
    try:
        if _CLOCK.fullmatch(word):
            hour, *rest = map(int, word.split(":"))
            moment = midnight.replace(hour=hour, minute=rest[0], second=sum(rest[1:]))
        else:
            moment = datetime.fromisoformat(text.strip().replace("Z", "+00:00"))
            moment = moment if moment.tzinfo else moment.replace(tzinfo=now.tzinfo)
    except ValueError:
        raise SinceError(f"--since {text}: is none of these: {ALLOWED}") from None
    if _local(moment) > now.timestamp():
        raise SinceError(
            f"--since {text}: lies in the future, it is {now:%Y-%m-%d %H:%M} now; "
            f"allowed: {ALLOWED}"
        )
    return Since(time=_local(moment))


def _local(moment: datetime) -> float:
    """Return a moment as Unix time [s]."""
    return moment.timestamp()
