"""Measure rows one after the other; a row that fails says why and the others go on."""

from __future__ import annotations

import dataclasses
import json
import os
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from bench import compare, page
from bench.compare import Row
from bench.peers.install import PeerMissing
from bench.record import Record, failed
from bench.room import Room
from bench.rows import names, row


def measure(wanted: Sequence[str], folder: Path, console: Console, as_json: bool) -> bool:
    """Measure rows, write results and page, show the table; return whether all of them hold.

    Args:
        wanted: Names of rows; empty: all.
        folder: For logs.
        console: For progress and table.
        as_json: Print the results as JSON to standard output.
    """
    load = os.getloadavg()[0]
    chosen = [name for name in names() if not wanted or name in wanted]
    records = []
    with Room(folder, console) as room:
        for number, name in enumerate(chosen, 1):
            console.print(f"[{number}/{len(chosen)}] {name} ...", markup=False, highlight=False)
            record = attempt(name, room)
            console.print(f"    {summary(record)}", markup=False, highlight=False)
            records.append(record)
    rows = [page.measured(record.document(), load) for record in records]
    before = page.so_far()["rows"] if page.RESULTS.is_file() else []
    content = page.document(page.merged(rows, names()))
    page.write(content)
    console.print(table(records))
    for line in since_last(before, rows):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    broken = [record.id for record in records if not record.holds]
    console.print(
        f"{len(records)} rows, {len(broken)} do not "
        f"hold{': ' + ', '.join(broken) if broken else ''}; {page.RESULTS}"
    )
    if as_json:
        print(json.dumps(content, indent=1))
    return not broken


def since_last(before: Sequence[Row], rows: Sequence[Row]) -> list[str]:
    """Say what got worse since the last measurement of each row, one line for each figure."""
    worse, unknown = compare.worse(before, rows), compare.not_compared(before, rows)
    lines = [f"worse than the last time: {text}" for text in worse]
    if not worse:
        compared = len(rows) - len(unknown)
        lines.append(f"none of {compared} rows got worse by more than its rounds lie apart")
    if unknown:
        lines.append(f"not compared, new or measured on another machine: {', '.join(unknown)}")
    return lines


def attempt(name: str, room: Room) -> Record:
    """Measure one row; whatever goes wrong is its remark."""
    begun = time.monotonic()
    try:
        record = row(name)(room)
    except PeerMissing as error:
        record = failed(name, str(error))
    except Exception as error:
        (room.folder / f"{name}.error.txt").write_text(traceback.format_exc())
        record = failed(name, f"{type(error).__name__}: {str(error)[:300]}")
    return dataclasses.replace(record, seconds=time.monotonic() - begun)


def summary(record: Record) -> str:
    """Say in one line what came out."""
    figures = (
        f"{page.number(record.ours)} / {page.number(record.baseline)} {record.unit}, ratio "
        f"{page.number(record.ratio)}"
    )
    verdict = "holds" if record.holds else "DOES NOT HOLD"
    return f"{figures}, goal {record.goal}: {verdict} ({record.seconds:.0f} s) {record.note}"


def table(records: Sequence[Record]) -> Table:
    """Lay the rows out for a person."""
    shown = Table(show_lines=False)
    for heading in ("row", "ours", "baseline", "unit", "ratio", "goal", "holds"):
        shown.add_column(
            heading, justify="right" if heading in ("ours", "baseline", "ratio") else "left"
        )
    for record in records:
        verdict = "[green]yes[/]" if record.holds else "[bold red]NO[/]"
        figures = [page.number(value) for value in (record.ours, record.baseline, record.ratio)]
        shown.add_row(record.id, *figures[:2], record.unit, figures[2], record.goal, verdict)
        for beside in record.beside:
            verdict = {True: "[green]yes[/]", False: "[bold red]NO[/]", None: ""}[beside.holds]
            shown.add_row(
                f"  {beside.what}",
                page.number(beside.value),
                "",
                beside.unit,
                "",
                beside.goal,
                verdict,
            )
    return shown
