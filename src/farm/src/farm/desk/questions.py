"""What people ask of the history, as SQL, and its answers as text; pure."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta

COLUMNS = (
    "site",
    "machine",
    "cell",
    "era",
    "number",
    "time",
    "kind",
    "stop",
    "text",
    "body",
)
"""Of the table ``events``; time is UTC, body is the whole line of the journal as JSON."""
SPAN = re.compile(r"^(\d+(?:\.\d+)?)(s|m|h|d|w)\Z")
WEEK = re.compile(r"^(\d{4})-W(\d{2})\Z")
WEEKS_AGO = re.compile(r"^\d{1,3}\Z")
UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0, "w": 604800.0}


class QuestionError(ValueError):
    """A question that cannot be understood; the text says what is allowed."""


@dataclass(frozen=True)
class Wanted:
    """Which events.

    Attributes:
        since: Not before this [s since 1970]; None: from the first on.
        cell: A cell's name, or MACHINE/CELL; empty: of all.
        kind: decision, audit, alarm, cycle, start, gap, torn, exercise; empty: all.
        stops: Only those that stopped the pair.
        limit: The newest so many.
    """

    since: float | None = None
    cell: str = ""
    kind: str = ""
    stops: bool = False
    limit: int = 100


def since(text: str, now: datetime) -> float:
    """Return the beginning that a person means [s since 1970].

    Args:
        text: ``today``, ``yesterday``, a time ago (``90m``, ``12h``, ``2d``), or a date with or
            without a time, ``2026-05-01 22:00``, in this machine's zone.
        now: The time; without a zone in this machine's, whose summers count then.

    Raises:
        QuestionError: It is none of these.

    Example:
        >>> from datetime import timezone
        >>> noon = datetime(2026, 5, 2, 12, tzinfo=timezone.utc)
        >>> [noon.timestamp() - since(text, noon) for text in ("today", "90m", "yesterday")]
        [43200.0, 5400.0, 129600.0]
    """
    midnight = now.replace(hour=0, minute=0, second=0, microsecond=0)
    if text in ("today", "yesterday"):
        return (midnight - timedelta(days=text == "yesterday")).timestamp()
    if found := SPAN.match(text):
        return now.timestamp() - float(found[1]) * UNITS[found[2]]
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise QuestionError(
            f"--since {text}: allowed are today, yesterday, 30m, 12h, 2d, 2026-05-01 or "
            "2026-05-01T22:00"
        ) from None
    return (moment if moment.tzinfo else moment.replace(tzinfo=now.tzinfo)).timestamp()


def week(text: str, now: datetime) -> tuple[float, float]:
    """Return begin and end of a week [s since 1970]; of this one, what of it is over.

    Args:
        text: ``2026-W47`` as ISO 8601 counts, or how many weeks ago: 0 is this one.
        now: The time; without a zone in this machine's, whose summers count then.

    Raises:
        QuestionError: It is none, or has not begun.

    Example:
        >>> from datetime import timezone
        >>> noon = datetime(2026, 11, 18, 12, tzinfo=timezone.utc)
        >>> [(noon.timestamp() - t) / 3600.0 for t in week("0", noon)]
        [60.0, 0.0]
        >>> week("1", noon) == week("2026-W46", noon)
        True
    """
    monday = now.date() - timedelta(days=now.weekday())
    try:
        if found := WEEK.match(text):
            monday = date.fromisocalendar(int(found[1]), int(found[2]), 1)
        elif WEEKS_AGO.match(text):
            monday -= timedelta(weeks=int(text))
        else:
            raise ValueError
    except ValueError:
        raise QuestionError(
            f"--weeks {text}: allowed are 2026-W47, or how many weeks ago: 0 is this one"
        ) from None
    begin, end = (
        datetime.combine(day, time(), now.tzinfo).timestamp()
        for day in (monday, monday + timedelta(weeks=1))
    )
    if begin >= now.timestamp():
        raise QuestionError(f"--weeks {text}: has not begun yet")
    return begin, min(end, now.timestamp())


NEWEST = (
    "SELECT site, machine, cell, max(era) AS era, max_by(number, (era, number)) AS number, "
    "max_by(epoch(time), (era, number)) AS time FROM events GROUP BY site, machine, cell"
)
"""The newest event of each cell."""
COMPARED = 100
"""Our choice: a power cut takes what a journal had for less than a second."""
TIMES = (
    "SELECT number, max_by(epoch(time), era) FROM events WHERE site = ? AND machine = ? AND "
    f"cell = ? AND number <= ? GROUP BY number ORDER BY number DESC LIMIT {COMPARED}"
)
"""The times of a cell's newest events up to a number."""
OF_KINDS = (
    "SELECT site, machine, cell, era, number, epoch(time), kind, stop, text, body FROM events "
    "WHERE list_contains(?, kind) ORDER BY era, number"
)
"""The events of some kinds, those of each cell in the order of their numbers."""


def query(wanted: Wanted) -> tuple[str, list[object]]:
    """Return the SQL of a question, and its values; the answer is in the order of time."""
    where, values = _conditions(wanted)
    order = "time, machine, cell, era, number"
    newest = ", ".join(f"{column} DESC" for column in order.split(", "))
    return (
        "SELECT time, machine || '/' || cell AS cell, number, kind, text FROM "
        f"(SELECT * FROM events{where} ORDER BY {newest} LIMIT ?) ORDER BY {order}",
        [*values, wanted.limit],
    )


def causes(wanted: Wanted) -> tuple[str, list[object]]:
    """Return the SQL that counts events by their cause, and its values; the most frequent first.

    The cause is a decision's event, an alarm's text, a cycle's outcome, and of all others the kind.
    Of each cause: how often, in how many cells, the first and the last time, in which cell that
    was, and its words.
    """
    where, values = _conditions(wanted)
    return (
        "SELECT cause, count(*) AS times, count(DISTINCT name) AS cells, "
        "min(time) AS first, max(time) AS last, arg_max(name, time) AS last_in, "
        f"arg_max(text, time) AS last_text FROM caused{where} "
        "GROUP BY cause ORDER BY times DESC, last DESC LIMIT ?",
        [*values, wanted.limit],
    )


def _conditions(wanted: Wanted) -> tuple[str, list[object]]:
    """Return which events are meant as the end of a SELECT, and its values."""
    conditions: list[str] = []
    values: list[object] = []
    if wanted.since is not None:
        conditions.append("time >= make_timestamp(CAST(? AS BIGINT))")
        values.append(int(wanted.since * 1e6))
    if wanted.cell:
        conditions.append("(cell = ? OR machine || '/' || cell = ?)")
        values += [wanted.cell, wanted.cell]
    if wanted.kind:
        conditions.append("kind = ?")
        values.append(wanted.kind)
    if wanted.stops:
        conditions.append("stop")
    return (f" WHERE {' AND '.join(conditions)}" if conditions else ""), values


def as_text(value: object) -> str:
    """Return a value of an answer as people read it."""
    if isinstance(value, datetime):
        return value.isoformat(sep=" ", timespec="milliseconds")
    return "" if value is None else str(value)


def table(names: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """Lay an answer out as lines.

    Example:
        >>> table(["cell", "n"], [["milk", 2], ["a", 10]])
        ['cell  n', 'milk  2', 'a     10']
    """
    texts = [list(names), *([as_text(value) for value in row] for row in rows)]
    widths = [max(len(row[k]) for row in texts) for k in range(len(names))]
    return ["  ".join(t.ljust(w) for t, w in zip(row, widths)).rstrip() for row in texts]
