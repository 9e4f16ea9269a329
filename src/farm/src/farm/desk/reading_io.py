"""Ask the history with SQL; nothing can be changed by it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, TypeVar

import duckdb
import msgspec

from farm.desk.figures import VIEWS
from farm.desk.files import counting
from farm.desk.history_io import SCHEMA, HistoryError, Kept
from farm.desk.questions import COLUMNS, NEWEST, OF_KINDS, TIMES
from farm.keys import CellName
from farm.wire import Event

TRIES = 3
"""Our choice: the writer may join small files between two looks; a third time it will not."""
TYPES = {"int32": "INTEGER", "int64": "BIGINT", "string": "VARCHAR", "bool": "BOOLEAN"}


T = TypeVar("T")
Values: TypeAlias = Sequence[object] | Mapping[str, object]
"""For the question marks of a statement, or by the names behind its ``$``."""


class AskingError(HistoryError):
    """The question cannot be answered; the text says why."""


class FoundRows(NamedTuple):
    """The names of the columns, and the rows."""

    names: list[str]
    rows: list[tuple[Any, ...]]


def ask(folder: Path, sql: str, values: Values = ()) -> FoundRows:
    """Answer a question; ``events`` is the table, empty where there is no history yet.

    Beside it stand the views ``caused``, ``cycles`` and ``cycle_figures``.

    Args:
        folder: Of the history.
        sql: One statement that only reads.
        values: What it asks about.

    Raises:
        AskingError: It is not one SELECT, or DuckDB refuses it.
    """
    for attempt in range(TRIES):
        names = [path.name for path in folder.iterdir()] if folder.is_dir() else []
        files = [str(folder / span.name) for span in counting(names)[0]]
        try:
            return _asked(folder, files, sql, values)
        except duckdb.IOException as error:
            if attempt == TRIES - 1:
                raise AskingError(_first_line(error)) from error
        except duckdb.Error as error:
            raise AskingError(_first_line(error)) from error
    raise AssertionError("unreachable")


def ask_for(folder: Path, kind: type[T], sql: str, values: Values) -> list[T]:
    """Return the rows of an answer as structs, whose fields are its columns; see :func:`ask`."""
    found = ask(folder, sql, values)
    return [msgspec.convert(dict(zip(found.names, row)), kind) for row in found.rows]


def newest_of(folder: Path) -> dict[CellName, tuple[int, int, float]]:
    """Return era, number and time [s since 1970] of each cell's newest event; see :func:`ask`."""
    rows = ask(folder, NEWEST).rows
    return {CellName(*name): (era, number, time) for *name, era, number, time in rows}


def times_of(folder: Path, cell: CellName, last: int) -> dict[int, float]:
    """Return the times of a cell's newest events up to a number [s since 1970]; see :func:`ask`."""
    return dict(ask(folder, TIMES, [*cell, last]).rows)


def of_kinds(folder: Path, kinds: Sequence[str]) -> Iterator[Kept]:
    """Yield the events of some kinds, those of each cell in their order; see :func:`ask`."""
    for *name, era, number, time, kind, stop, text, body in ask(folder, OF_KINDS, [kinds]).rows:
        event = Event(number, time, kind, stop, text, json.loads(body))
        yield Kept(CellName(*name), era, event)


def _asked(folder: Path, files: list[str], sql: str, values: Values) -> FoundRows:
    with duckdb.connect(":memory:", config={"threads": 1}) as database:
        # Only the history's folder can be read, and nothing of this can be undone.
        database.execute("SET allowed_directories = [?]", [str(folder)])
        database.execute("SET enable_external_access = false")
        database.execute(f"CREATE VIEW events AS {_source(files)}")
        for view in VIEWS:
            database.execute(view)
        database.execute("SET lock_configuration = true")
        statements = database.extract_statements(sql)
        reading = (duckdb.StatementType.SELECT, duckdb.StatementType.EXPLAIN)
        if len(statements) != 1 or statements[0].type not in reading:
            raise AskingError("allowed is one SELECT: the history is only read here")
        database.execute(statements[0], values)
        names = [column[0] for column in database.description or ()]
        return FoundRows(names, database.fetchall())


def _source(files: list[str]) -> str:
    """Return the SQL of the table."""
    if files:
        listed = ", ".join("'" + file.replace("'", "''") + "'" for file in files)
        return f"SELECT {', '.join(COLUMNS)} FROM read_parquet([{listed}])"
    columns = (
        f"CAST(NULL AS {TYPES.get(str(field.type), 'TIMESTAMP')}) AS {field.name}"
        for field in SCHEMA
    )
    return f"SELECT {', '.join(columns)} WHERE false"


def _first_line(error: duckdb.Error) -> str:
    return str(error).strip().splitlines()[0]
