"""Two cells, or two weeks of one: what differs by more than its own scatter; pure.

Each figure is taken over the whole time, and in each span of it (a day). What the spans differ from
each other is the figure's own scatter. A difference counts only if it is larger than twice the
scatter of both sides, and large enough to matter.
"""

from __future__ import annotations

import re
import statistics
from collections.abc import Callable, Iterator, Sequence
from datetime import date, datetime, time, timedelta
from typing import NamedTuple

import msgspec

from farm.desk.questions import QuestionError

LIMIT = 2.0
"""Our choice: so many times the scatter of both sides together."""
LEAST_SHARE = 0.02
"""Our choice: what differs by less than 2 % is no matter for anybody."""
LEAST_SPANS = 3
"""Our choice: with fewer nobody can tell the scatter, and nothing is marked."""
DAY_S, SPANS = 86400.0, 8
"""Our choice: spans are days, or an eighth of a time that is shorter than half of eight days."""
WEEK = re.compile(r"^(\d{4})-W(\d{2})\Z")
WEEKS_AGO = re.compile(r"^\d{1,3}\Z")


class EndedCycle(NamedTuple):
    """A cycle that came to its end as meant; what is not known is None.

    Attributes:
        time: When it ended [s since 1970].
        program: Its name.
        seconds: How long it took, without pauses.
        error_mm: Worst following error.
        lag_s: Of the robot.
        placed, dropped: Parts.
    """

    time: float
    program: str
    seconds: float
    error_mm: float | None
    lag_s: float | None
    placed: int
    dropped: int


class PairStop(NamedTuple):
    """What stopped a pair, and when [s since 1970]."""

    time: float
    cause: str


class Side(msgspec.Struct, frozen=True):
    """One side of a comparison.

    Attributes:
        name: Of the cell or the week.
        begin, end: The time looked at [s since 1970].
        cycles, stops: What happened then.
    """

    name: str
    begin: float
    end: float
    cycles: tuple[EndedCycle, ...]
    stops: tuple[PairStop, ...]


class Difference(msgspec.Struct, frozen=True):
    """One figure of both sides.

    Attributes:
        figure: Which, with its unit.
        a, b: Its value; None: it is not known there.
        scatter: Of both together, in the figure's unit; None: there are too few spans.
        differs: Whether the difference is larger than the scatter explains.
    """

    figure: str
    a: float | None
    b: float | None
    scatter: float | None
    differs: bool


class _Figure(NamedTuple):
    """A figure of one side: its value, and that of each span."""

    value: float
    spans: tuple[float, ...]


def compare(a: Side, b: Side) -> list[Difference]:
    """Return all figures that one of both sides has, those that differ first."""
    causes = sorted({stop.cause for side in (a, b) for stop in side.stops})
    of_a, of_b = (dict(_figures(side, causes)) for side in (a, b))
    names = [*of_a, *(name for name in of_b if name not in of_a)]
    found = [_difference(name, of_a.get(name), of_b.get(name)) for name in names]
    return sorted(found, key=lambda difference: not difference.differs)


def week(text: str, now: datetime) -> tuple[float, float]:
    """Return begin and end of a week [s since 1970]; of this one, what of it is over.

    Args:
        text: ``2026-W47`` as ISO 8601 counts, or how many weeks ago: 0 is this one.
        now: The time, with its zone.

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


def _difference(name: str, a: _Figure | None, b: _Figure | None) -> Difference:
    if a is None or b is None:
        return Difference(name, a and a.value, b and b.value, None, False)
    if min(len(a.spans), len(b.spans)) < LEAST_SPANS:
        return Difference(name, a.value, b.value, None, False)
    scatter = (statistics.variance(a.spans) + statistics.variance(b.spans)) ** 0.5
    apart = abs(a.value - b.value)
    size = max(abs(a.value), abs(b.value))
    differs = apart > LIMIT * scatter and apart > LEAST_SHARE * size
    return Difference(name, a.value, b.value, scatter, differs)


def _figures(side: Side, causes: Sequence[str]) -> Iterator[tuple[str, _Figure]]:
    """Yield the figures of a side with their names."""
    yield "cycles done [1/h]", _rate(side, [(cycle.time, 1) for cycle in side.cycles])
    values: tuple[tuple[str, Callable[[EndedCycle], float | None]], ...] = (
        ("cycle time [s]", lambda cycle: cycle.seconds),
        ("following error [mm]", lambda cycle: cycle.error_mm),
        ("lag of the robot [s]", lambda cycle: cycle.lag_s),
    )
    for program in sorted({cycle.program for cycle in side.cycles}):
        of_it = [cycle for cycle in side.cycles if cycle.program == program]
        for name, value in values:
            known = [(c.time, v) for c in of_it if (v := value(c)) is not None]
            if known:
                yield f"{name} {program}".strip(), _median(side, known)
    yield "parts placed [1/h]", _rate(side, [(c.time, c.placed) for c in side.cycles])
    yield "parts dropped [1/h]", _rate(side, [(c.time, c.dropped) for c in side.cycles])
    for cause in causes:
        times = [(stop.time, 1) for stop in side.stops if stop.cause == cause]
        yield f"stops: {cause} [1/h]", _rate(side, times)


def _rate(side: Side, counted: Sequence[tuple[float, int]]) -> _Figure:
    """Return how much there is of something in an hour."""
    hours = max(side.end - side.begin, 1e-9) / 3600.0
    spans, length = _spans(side)
    sums = [0] * spans
    for at, count in counted:
        sums[_place(side, at, length, spans)] += count
    each = length / 3600.0
    return _Figure(sum(count for _, count in counted) / hours, tuple(n / each for n in sums))


def _median(side: Side, known: Sequence[tuple[float, float]]) -> _Figure:
    """Return the median of values; spans without one are left out."""
    spans, length = _spans(side)
    of_spans: dict[int, list[float]] = {}
    for at, value in known:
        of_spans.setdefault(_place(side, at, length, spans), []).append(value)
    medians = (statistics.median(values) for _, values in sorted(of_spans.items()))
    return _Figure(statistics.median(value for _, value in known), tuple(medians))


def _spans(side: Side) -> tuple[int, float]:
    """Return how many spans a side has, and how long each is [s]."""
    whole = max(side.end - side.begin, 1e-9)
    count = round(whole / DAY_S) if whole >= SPANS / 2 * DAY_S else SPANS
    return count, whole / count


def _place(side: Side, at: float, length: float, spans: int) -> int:
    return min(spans - 1, max(0, int((at - side.begin) / length)))
