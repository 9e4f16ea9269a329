"""Two cells, or two weeks of one, out of the history's files."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path

import msgspec

from farm.desk.compare import Difference, EndedCycle, PairStop, Side, compare, week
from farm.desk.figures_io import DONE
from farm.desk.questions import CAUSE
from farm.desk.reading_io import AskingError, ask
from farm.keys import CellName, ChoiceError, choose

CELLS = "SELECT DISTINCT site, machine, cell FROM events"
CYCLES = """
SELECT epoch(time), coalesce(body->>'program', ''),
       CAST(body->>'end' AS DOUBLE) - CAST(body->>'start' AS DOUBLE)
         - coalesce(CAST(body->>'paused_s' AS DOUBLE), 0),
       CAST(body->>'worst_error_mm' AS DOUBLE), CAST(body->>'follower_lag_s' AS DOUBLE),
       coalesce(CAST(body->>'parts_placed' AS INTEGER), 0),
       coalesce(CAST(body->>'parts_dropped' AS INTEGER), 0)
FROM events
WHERE kind = 'cycle' AND body->>'outcome' = ? AND machine = ? AND cell = ?
  AND time >= make_timestamp(CAST(? AS BIGINT)) AND time < make_timestamp(CAST(? AS BIGINT))
"""
STOPS = f"""
SELECT epoch(time), coalesce({CAUSE}, kind)
FROM events
WHERE stop AND machine = ? AND cell = ?
  AND time >= make_timestamp(CAST(? AS BIGINT)) AND time < make_timestamp(CAST(? AS BIGINT))
"""


class Comparison(msgspec.Struct, frozen=True):
    """What two sides differ in; their names, and the figures, those that differ first."""

    a: str
    b: str
    figures: list[Difference]


def compare_cells(folder: Path, words: tuple[str, str], begin: float, end: float) -> Comparison:
    """Compare two cells over the same time.

    Args:
        folder: Of the history.
        words: CELL or MACHINE/CELL of both.
        begin: From when [s since 1970].
        end: Until when.

    Raises:
        AskingError: The history cannot be read, or a word means no cell of it, or several.
    """
    a, b = (_side(folder, _cell(folder, word), begin, end, "") for word in words)
    return Comparison(a.name, b.name, compare(a, b))


def compare_weeks(folder: Path, word: str, weeks: tuple[str, str], now: datetime) -> Comparison:
    """Compare two weeks of a cell.

    Args:
        folder: Of the history.
        word: CELL or MACHINE/CELL.
        weeks: See :func:`farm.desk.compare.week`.
        now: The time, with its zone.

    Raises:
        AskingError: The history cannot be read, or the word means no cell of it, or several.
        QuestionError: One is no week.
    """
    spans = [(text, *week(text, now)) for text in weeks]
    cell = _cell(folder, word)
    a, b = (_side(folder, cell, begin, end, text) for text, begin, end in spans)
    return Comparison(a.name, b.name, compare(a, b))


def _side(folder: Path, cell: CellName, begin: float, end: float, week_text: str) -> Side:
    values = [cell.machine, cell.cell, int(begin * 1e6), int(end * 1e6)]
    cycles = ask(folder, CYCLES, [DONE, *values]).rows
    stops = ask(folder, STOPS, values).rows
    name = str(cell)
    if week_text:
        monday = datetime.fromtimestamp(begin).strftime("%Y-%m-%d")
        name = f"{name}, week of {monday}"
    return Side(
        name,
        begin,
        end,
        tuple(EndedCycle(*row) for row in cycles),  # type: ignore[arg-type]
        tuple(PairStop(*row) for row in stops),  # type: ignore[arg-type]
    )


def _cell(folder: Path, word: str) -> CellName:
    """Return the cell of the history that a word means."""
    there = [CellName(*map(str, row)) for row in ask(folder, CELLS).rows]
    try:
        found = choose(word, there)
    except ChoiceError as error:
        raise AskingError(f"{error}: events are kept of cells that joined the desk") from error
    if word == "all":
        raise AskingError("all: name one cell")
    return found[0]
