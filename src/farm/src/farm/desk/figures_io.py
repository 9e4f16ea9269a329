"""Key figures, drift and comparisons out of the history's files."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path

import msgspec

from farm.desk.figures import (
    COMPARISON,
    DRIFTS,
    KEY_FIGURES,
    Difference,
    FigureDrift,
    KeyFigures,
    StopCause,
)
from farm.desk.questions import Wanted, causes, week
from farm.desk.reading_io import AskingError, ask, ask_for
from farm.keys import CellName, ChoiceError, choose


class Comparison(msgspec.Struct, frozen=True):
    """What two sides differ in; their names, and the figures, those that differ first."""

    a: str
    b: str
    figures: list[Difference]


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
    planned = {"planned": list(planned_s), "planned_s": list(planned_s.values())}
    return ask_for(folder, KeyFigures, KEY_FIGURES, {"begin": begin, "until": end, **planned})


def stops_by_cause(folder: Path, begin: float) -> list[StopCause]:
    """Return what stopped pairs since ``begin`` [s since 1970], the most frequent first.

    Raises:
        AskingError: The history cannot be read.
    """
    question, values = causes(Wanted(begin, stops=True))
    unix = "SELECT * REPLACE (epoch(first) AS first, epoch(last) AS last)"
    return ask_for(folder, StopCause, f"{unix} FROM ({question})", values)


def figures_over(folder: Path, begin: float, end: float, span_s: float) -> list[FigureDrift]:
    """Return how the figures of all cells have changed, those that changed most first.

    The span that is not over yet is left out if it has begun less than half a span ago.

    Args:
        folder: Of the history.
        begin: From when [s since 1970].
        end: Until when.
        span_s: Length of a span, of which the median counts [s].

    Raises:
        AskingError: The history cannot be read.
    """
    until = end if end % span_s > span_s / 2.0 else end - end % span_s
    values = {"begin": begin, "until": until, "span_s": span_s}
    return ask_for(folder, FigureDrift, DRIFTS, values)


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
    a, b = (_cell(folder, word) for word in words)
    return Comparison(a, b, _compared(folder, (a, b), (begin, begin), (end, end)))


def compare_weeks(folder: Path, word: str, weeks: tuple[str, str], now: datetime) -> Comparison:
    """Compare two weeks of a cell.

    Args:
        folder: Of the history.
        word: CELL or MACHINE/CELL.
        weeks: See :func:`farm.desk.questions.week`.
        now: The time, in this machine's zone.

    Raises:
        AskingError: The history cannot be read, or the word means no cell of it, or several.
        QuestionError: One is no week.
    """
    begins, ends = zip(*(week(text, now) for text in weeks))
    cell = _cell(folder, word)
    a, b = (f"{cell}, week of {datetime.fromtimestamp(begin):%Y-%m-%d}" for begin in begins)
    return Comparison(a, b, _compared(folder, (cell, cell), begins, ends))


def _compared(
    folder: Path, names: tuple[str, str], begins: tuple[float, ...], ends: tuple[float, ...]
) -> list[Difference]:
    values = {"names": list(names), "begins": list(begins), "ends": list(ends)}
    return ask_for(folder, Difference, COMPARISON, values)


def _cell(folder: Path, word: str) -> str:
    """Return MACHINE/CELL of the cell of the history that a word means."""
    rows = ask(folder, "SELECT DISTINCT site, machine, cell FROM events").rows
    try:
        found = choose(word, [CellName(*row) for row in rows])
    except ChoiceError as error:
        raise AskingError(f"{error}: events are kept of cells that joined the desk") from error
    if word == "all":
        raise AskingError("all: name one cell")
    return str(found[0])
