"""The tables of docs/clients.md: client x version x check x result, one for each protocol."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

END = "<!-- end of table -->"
ROSBRIDGE, MODBUS, UPSTREAM = "rosbridge", "Modbus", "rosbridge_server"

TRIED, SAME = "tried", "same"
"""The row that says when, where and at which commit a column was run; as the one on its left."""

Results = Mapping[tuple[str, str], Mapping[str, str | None]]
"""What went wrong (None: nothing) by check, by client and version."""


def begin(protocol: str) -> str:
    """Return the line behind which the table of a protocol stands."""
    return f"<!-- table: ./cell test --clients ({protocol}) -->"


def table(results: Results, failures_only: bool = False) -> str:
    """Return the rows: a column for each client's version; failures only: no row that works.

    Example:
        >>> print(table({("roslibpy", "2.1.0"): {"connect": None, "listen": None}}))
        | check | roslibpy 2.1.0 |
        |---|---|
        | connect; listen | works |
    """
    columns = sorted(results)
    longest_first = sorted(columns, key=lambda column: -len(results[column]))
    checks = dict.fromkeys(check for column in longest_first for check in results[column])
    rows = [["check", *(" ".join(column) for column in columns)], ["---"] * (len(columns) + 1)]
    same: dict[tuple[str, ...], list[str]] = {}  # checks that went alike share a row
    for check in checks:
        cells = [_cell(results[column], check) for column in columns]
        if check == TRIED:
            cells = [SAME if k and cell == cells[k - 1] else cell for k, cell in enumerate(cells)]
        if not failures_only or set(cells) - {"", "works"}:
            same.setdefault(tuple(cells), []).append(check)
    rows += [["; ".join(alike), *cells] for cells, alike in same.items()]
    text = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    return text.replace("| --- |", "|---|").replace(" --- |", "---|")


def _cell(found: Mapping[str, str | None], check: str) -> str:
    if check not in found:
        return ""
    wrong = found[check]
    if check == TRIED:
        return wrong or ""
    return "works" if wrong is None else f"fails: {wrong}".replace("|", "/").replace("\n", " ")


def read(rows: str) -> dict[tuple[str, str], dict[str, str | None]]:
    """Return what a table says.

    Example:
        >>> read(table({("roslibpy", "2.1.0"): {"connect": None, "listen": "Error"}}))
        {('roslibpy', '2.1.0'): {'connect': None, 'listen': 'Error'}}
    """
    split = (line.strip().strip("|").split("|") for line in rows.strip().splitlines())
    lines = [[cell.strip() for cell in line] for line in split]
    if not lines:
        return {}
    heads = [head.rpartition(" ")[::2] for head in lines[0][1:]]
    found: dict[tuple[str, str], dict[str, str | None]] = {head: {} for head in heads}
    for checks, *cells in lines[2:]:
        last = ""
        for head, cell in zip(heads, cells):
            if cell:
                last = last if checks == TRIED and cell == SAME else cell
                said = None if last == "works" else last.removeprefix("fails: ")
                found[head].update(dict.fromkeys(checks.split("; "), said))
    return found


def write(page: Path, results: Results, protocol: str) -> None:
    """Put the table of a protocol into ``page``, between its marks.

    Columns of clients that were not run this time stay as they are: one whose program is in no
    package, and all others where somebody has run a part of the tests.

    Raises:
        ValueError: The page has no marks.
    """
    text, mark = page.read_text(encoding="utf-8"), begin(protocol)
    before, found, rest = text.partition(mark)
    old, end, after = rest.partition(END)
    if not found or not end:
        raise ValueError(f"{page}: no place for the table: it needs the lines {mark} and {END}")
    run = {client for client, _ in results}
    kept = {column: cells for column, cells in read(old).items() if column[0] not in run}
    rows = table({**kept, **results}, failures_only=protocol == UPSTREAM)
    page.write_text(f"{before}{mark}\n{rows}\n{END}{after}", encoding="utf-8")
