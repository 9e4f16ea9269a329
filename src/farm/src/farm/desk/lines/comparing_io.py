"""``./cell farm compare``: two cells, or two weeks of one, as text; it needs no running desk."""

from __future__ import annotations

import time
from datetime import datetime
from typing import Annotated

import typer
from scara_ros.shell.program_io import WRONG

from farm.desk.command_line_io import Folder, app, events_folder, fail, print_table
from farm.desk.figures_io import Comparison, compare_cells, compare_weeks
from farm.desk.questions import since

Cell = Annotated[str, typer.Argument(help="CELL, or MACHINE/CELL.")]


@app.command()
def compare(
    cell: Cell,
    other: Annotated[str, typer.Argument(help="The same of the other cell.")] = "",
    since_text: Annotated[
        str, typer.Option("--since", help="today, yesterday, 30m, 12h, 7d, or a date and time.")
    ] = "7d",
    weeks: Annotated[
        tuple[str, str] | None,
        typer.Option(help="Two weeks of the one cell: 2026-W47, or how many weeks ago."),
    ] = None,
    folder: Folder = None,
) -> None:
    """Compare two cells, or two weeks of one; what differs by more than its scatter is marked."""
    if bool(other) == (weeks is not None):
        fail("compare: name a second cell, or --weeks A B of the one", WRONG)
    history, now = events_folder(folder), datetime.now()
    if weeks is not None:
        show(compare_weeks(history, cell, weeks, now))
    else:
        show(compare_cells(history, (cell, other), since(since_text, now), time.time()))


def show(found: Comparison) -> None:
    """Print a comparison."""
    names = ("figure", found.a, found.b, "scatter", "")
    lines = [
        (
            each.figure,
            *("" if v is None else f"{v:.4g}" for v in (each.a, each.b, each.scatter)),
            "differs" if each.differs else "",
        )
        for each in found.figures
    ]
    print_table(names, lines)
    differ = sum(each.differs for each in found.figures)
    typer.echo(
        f"{differ} of {len(found.figures)} figures differ by more than their scatter; how they are "
        "compared: docs/farm/figures.md"
    )
