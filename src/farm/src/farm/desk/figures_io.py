"""Key figures and drift from the history's files."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime, timezone
from pathlib import Path

import msgspec

from farm.desk.drift import Bin, FigureDrift, find_drifts
from farm.desk.kpi import CountedEvent, KeyFigures, key_figures
from farm.desk.past.fits_io import read_fits
from farm.desk.questions import Wanted, causes
from farm.desk.reading_io import ask
from farm.fits import points

DONE = "done"
"""Outcome of a cycle that ended as meant, as the cell's journal writes it."""
BEFORE_S = 7 * 86400.0
"""Our choice: what began so long before the time looked at still counts for how a cell was then."""
FIGURES = {
    "following error [mm]": "worst_error_mm",
    "lag of the robot [s]": "follower_lag_s",
}
"""What drifts, and its key in a cycle's entry; each program for itself."""
HAPPENED = """
SELECT machine || '/' || cell, epoch(time), kind, stop,
       coalesce(body->>'mode_before' <> body->>'mode_after', false),
       coalesce(body->>'who', ''),
       coalesce(CAST(body->>'start' AS DOUBLE), 0), coalesce(CAST(body->>'end' AS DOUBLE), 0),
       coalesce(CAST(body->>'paused_s' AS DOUBLE), 0),
       coalesce(body->>'program', ''), coalesce(body->>'outcome', ''),
       coalesce(body->>'leader', ''),
       coalesce(CAST(body->>'parts_placed' AS INTEGER), 0),
       coalesce(CAST(body->>'parts_dropped' AS INTEGER), 0)
FROM events
WHERE kind IN ('decision', 'cycle', 'start')
  AND time >= make_timestamp(CAST(? AS BIGINT)) AND time < make_timestamp(CAST(? AS BIGINT))
ORDER BY machine, cell, era, number
"""
BINS = """
SELECT name, program, place, median(value) FROM (
  SELECT machine || '/' || cell AS name, body->>'program' AS program,
         CAST(floor(epoch(time) / ?) AS BIGINT) AS place,
         CAST(body->>'{key}' AS DOUBLE) AS value
  FROM events
  WHERE kind = 'cycle' AND body->>'outcome' = ?
    AND time >= make_timestamp(CAST(? AS BIGINT)) AND time < make_timestamp(CAST(? AS BIGINT)))
WHERE value IS NOT NULL GROUP BY name, program, place
"""


def figures_of(
    folder: Path, begin: float, end: float, planned_s: Mapping[str, float]
) -> list[KeyFigures]:
    """Return the key figures of each cell, and of all last; empty where there is no history.

    Args:
        folder: Of the history.
        begin: From when [s since 1970].
        end: Until when.
        planned_s: Planned run time of programs [s].

    Raises:
        AskingError: The history cannot be read.
    """
    found = ask(folder, HAPPENED, [int((begin - BEFORE_S) * 1e6), int(end * 1e6)])
    events = (CountedEvent(*row) for row in found.rows)  # type: ignore[arg-type]
    return key_figures(events, begin, end, planned_s, DONE)


class StopCause(msgspec.Struct, frozen=True):
    """What stopped pairs, how often, in how many cells, and the last of them; times since 1970."""

    cause: str
    times: int
    cells: int
    first: float
    last: float
    last_in: str
    last_text: str


def stops_by_cause(folder: Path, begin: float) -> list[StopCause]:
    """Return what stopped pairs since ``begin`` [s since 1970], the most frequent first.

    Raises:
        AskingError: The history cannot be read.
    """
    rows = ask(folder, *causes(Wanted(begin, stops=True))).rows
    return [
        StopCause(
            str(cause), int(str(times)), int(str(cells)), _unix(first), _unix(last), *map(str, of)
        )
        for cause, times, cells, first, last, *of in rows
    ]


def _unix(moment: object) -> float:
    """Return a time of the history, which is UTC without a zone [s since 1970]."""
    assert isinstance(moment, datetime)
    return moment.replace(tzinfo=timezone.utc).timestamp()


def figures_over(folder: Path, begin: float, end: float, span_s: float) -> list[FigureDrift]:
    """Return how the figures of all cells have changed, those that changed most first.

    What was fitted to a cell's recordings of a day is among them. The span that is not over yet is
    left out if it has begun less than half a span ago.

    Args:
        folder: Of the history.
        begin: From when [s since 1970].
        end: Until when.
        span_s: Length of a span, of which the median counts [s].

    Raises:
        AskingError: The history or a fit cannot be read.
    """
    bins: list[Bin] = []
    until = end if end % span_s > span_s / 2.0 else end - end % span_s
    for figure, key in FIGURES.items():
        values = [span_s, DONE, int(begin * 1e6), int(until * 1e6)]
        for cell, program, place, value in ask(folder, BINS.format(key=key), values).rows:
            named = f"{figure} {program}".strip()
            bins.append(Bin(str(cell), named, int(str(place)), float(str(value))))
    for cell, named, noon, value in points(read_fits(folder.parent, begin, until)):
        bins.append(Bin(cell, named, int(noon // span_s), value))
    return find_drifts(bins)
