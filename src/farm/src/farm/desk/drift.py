"""Which cell goes away from its own past: each figure against its beginning, all cells; pure.

A figure is taken as the median of each span of time (a day). The newest spans are compared with the
first half of those before them, so that a slow drift does not become its own past. The noise is
what differs from span to span; a slow drift adds little to it. What moves all cells alike (summer)
is taken off where there are enough cells to tell.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import msgspec

LEAST_PAST = 4
"""Our choice: spans before the newest ones, else nothing is said."""
LEAST_CELLS = 5
"""Our choice: with fewer cells nobody can tell what moves all of them."""
LIMIT = 6.0
"""Our choice: so many times the noise; among 1,000 figures at rest none comes near it."""
LEAST_SHARE = 0.05
"""Our choice: a figure that has changed by less than 5 % is no matter for anybody."""
FLOOR = 0.005
"""Our choice: noise is not taken as less than this share of the figure."""
MAD_TO_SIGMA = 1.4826
"""Median distance to standard deviation, of a normal distribution."""


class Bin(NamedTuple):
    """The median of a figure in a span of time.

    Attributes:
        cell: MACHINE/CELL.
        figure: Which figure, with its unit.
        place: Number of the span.
        value: The median.
    """

    cell: str
    figure: str
    place: int
    value: float


class FigureDrift(msgspec.Struct, frozen=True):
    """A figure of a cell against its own past.

    Attributes:
        cell: MACHINE/CELL.
        figure: Which figure, with its unit.
        before: Its median at the beginning.
        now: Its median in the newest spans.
        score: Change, without what all cells have changed, in multiples of the noise.
        drifts: Whether the cell goes away from its own past.
        values: Of all spans, in their order.
    """

    cell: str
    figure: str
    before: float
    now: float
    score: float
    drifts: bool
    values: tuple[float, ...]


class _Change(NamedTuple):
    cell: str
    before: float
    now: float
    noise: float
    values: tuple[float, ...]

    @property
    def share(self) -> float:
        return (self.now - self.before) / self.before


def find_drifts(bins: Iterable[Bin], recent: int = 2) -> list[FigureDrift]:
    """Return all figures that can be compared, those that changed most first.

    Args:
        bins: In any order.
        recent: So many newest spans are compared with those before.
    """
    rows: dict[str, dict[str, list[tuple[int, float]]]] = {}
    for each in bins:
        rows.setdefault(each.figure, {}).setdefault(each.cell, []).append((each.place, each.value))
    found: list[FigureDrift] = []
    for figure, cells in rows.items():
        changes = [
            change
            for cell, row in cells.items()
            if (change := _change(cell, [value for _, value in sorted(row)], recent))
        ]
        found += _judged(figure, changes)
    return sorted(found, key=lambda drift: (not drift.drifts, -abs(drift.score), drift.cell))


def _change(cell: str, values: Sequence[float], recent: int) -> _Change | None:
    """Return how a row of medians has changed; None: it is too short, or has no size."""
    past = values[:-recent]
    if len(past) < LEAST_PAST:
        return None
    before = statistics.median(past[: (len(past) + 1) // 2])
    if not before > 0.0:
        return None
    steps = [abs(b - a) for a, b in pairwise(values)]
    noise = MAD_TO_SIGMA * statistics.median(steps) / 2.0**0.5
    now = statistics.median(values[-recent:])
    return _Change(cell, before, now, max(noise, FLOOR * before), tuple(values))


def _judged(figure: str, changes: Sequence[_Change]) -> list[FigureDrift]:
    """Judge one figure of all cells."""
    common = 0.0
    if len(changes) >= LEAST_CELLS:
        common = statistics.median(change.share for change in changes)
    drifts = []
    for change in changes:
        own = change.share - common
        score = own * change.before / change.noise
        away = abs(score) > LIMIT and abs(own) > LEAST_SHARE
        drifts.append(
            FigureDrift(change.cell, figure, change.before, change.now, score, away, change.values)
        )
    return drifts
