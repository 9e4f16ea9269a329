"""The tables of docs/clients.md: client x version x check x result, one for each protocol."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

END = "<!-- end of table -->"
ROSBRIDGE, MODBUS = "rosbridge", "Modbus"

Results = Mapping[tuple[str, str], Mapping[str, str | None]]
"""What went wrong (None: nothing) by check, by client and version."""


def begin(protocol: str) -> str:
    """Return the line behind which the table of a protocol stands."""
    return f"<!-- table: ./cell test --clients ({protocol}) -->"


def table(results: Results) -> str:
    """Return the rows: a column for each client's version.

    Example:
        >>> print(table({("roslibpy", "2.1.0"): {"connect": None}}))
        | check | roslibpy 2.1.0 |
        |---|---|
        | connect | works |
    """
    columns = sorted(results)
    checks = dict.fromkeys(check for column in columns for check in results[column])
    rows = [
        ["check", *(" ".join(column) for column in columns)],
        ["---"] * (len(columns) + 1),
        *([check, *(_cell(results[column], check) for column in columns)] for check in checks),
    ]
    text = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    return text.replace("| --- |", "|---|").replace(" --- |", "---|")


def _cell(found: Mapping[str, str | None], check: str) -> str:
    if check not in found:
        return ""
    wrong = found[check]
    return "works" if wrong is None else f"fails: {wrong}".replace("|", "/").replace("\n", " ")


def write(page: Path, results: Results, protocol: str) -> None:
    """Put the table of a protocol into ``page``, between its marks.

    Raises:
        ValueError: The page has no marks.
    """
    text, mark = page.read_text(encoding="utf-8"), begin(protocol)
    before, found, rest = text.partition(mark)
    _, end, after = rest.partition(END)
    if not found or not end:
        raise ValueError(f"{page}: no place for the table: it needs the lines {mark} and {END}")
    page.write_text(f"{before}{mark}\n{table(results)}\n{END}{after}", encoding="utf-8")
