"""``./cell farm kpi | drift | class``: figures and a class as text; they need no running desk."""

from __future__ import annotations

import time
from datetime import datetime
from typing import Annotated

import typer
from scara_ros.shell.program_io import WRONG

from farm.config import load_farm
from farm.desk.class_io import class_of
from farm.desk.command_line_io import Folder, app, events_folder, fail, print_table
from farm.desk.figures import FigureDrift, KeyFigures
from farm.desk.figures_io import figures_of, figures_over
from farm.desk.questions import SPAN, UNITS, since

Since = Annotated[
    str, typer.Option("--since", help="today, yesterday, 30m, 12h, 2d, or a date and time.")
]
WIDTH = 12
"""Signs of the picture of a row of figures."""
BARS = "▁▂▃▄▅▆▇█"


@app.command()
def kpi(since_text: Since = "1d", folder: Folder = None) -> None:
    """Show key figures of each cell and of all, as ISO 22400 calls them; empty: not known."""
    begin = since(since_text, datetime.now())
    planned = load_farm().desk.planned_run_time_s
    rows = figures_of(events_folder(folder), begin, time.time(), planned)
    names = (
        "cell",
        "availability",
        "effectiveness",
        "quality ratio",
        "OEE",
        "cycles",
        "done",
        "programs",
        "twin moves",
        "operator moves",
        "cycle s",
        "parts",
        "stops",
        "failures",
        "between failures",
        "restoration",
        "off",
    )
    print_table(names, [_line(row) for row in rows])
    typer.echo(f"{max(0, len(rows) - 1)} cells; how they are counted: docs/farm/figures.md")


@app.command()
def drift(
    since_text: Since = "30d",
    span: Annotated[str, typer.Option(help="Length of a span: 1d, 6h, 10m.")] = "1d",
    every: Annotated[bool, typer.Option("--all", help="List what is steady too.")] = False,
    folder: Folder = None,
) -> None:
    """Name the cells whose following error or lag goes away from their own past."""
    found = SPAN.match(span)
    if not found:
        fail(f"--span {span}: allowed are 10m, 6h, 1d, 1w", WRONG)
    seconds = float(found[1]) * UNITS[found[2]]
    begin = since(since_text, datetime.now())
    drifts = figures_over(events_folder(folder), begin, time.time(), seconds)
    away = [each for each in drifts if each.drifts]
    shown = drifts if every else away
    print_table(("cell", "figure", "before", "now", "times the noise", ""), map_lines(shown))
    typer.echo(f"{len(away)} of {len(drifts)} figures go away from their own past")


@app.command("class")
def class_(since_text: Since = "30d", folder: Folder = None) -> None:
    """Show a class: which exercises each learner has passed, and how often each was marked."""
    begin = since(since_text, datetime.now())
    rows = class_of(events_folder(folder), begin)
    marks: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        told = marks.setdefault((row.learner, row.cell), {})
        told[row.exercise] = f"{'+' * row.passed}{row.tries}"
    exercises = sorted({row.exercise for row in rows})
    lines = [
        (
            *names,
            sum(mark.startswith("+") for mark in told.values()),
            *(told.get(exercise, "") for exercise in exercises),
        )
        for names, told in marks.items()
    ]
    # e07_planted_error: its number is enough for a heading.
    headings = (exercise.split("_")[0].lstrip("e0") for exercise in exercises)
    print_table(("learner", "cell", "passed", *headings), lines)
    results = sum(row.tries for row in rows)
    typer.echo(f"{len(lines)} learners, {results} results; +: passed, and how often marked")


def map_lines(drifts: list[FigureDrift]) -> list[tuple[object, ...]]:
    """Return the lines of a list of drifts."""
    return [
        (d.cell, d.figure, f"{d.before:.3f}", f"{d.now:.3f}", f"{d.score:+.1f}", _picture(d.values))
        for d in drifts
    ]


def _picture(values: tuple[float, ...]) -> str:
    """Return a row of figures as a row of bars.

    Example:
        >>> _picture((1.0, 1.0, 2.0))
        '▁▁█'
    """
    shown = values[-WIDTH:]
    low, high = min(shown), max(shown)
    steps = len(BARS) - 1
    # Equal values have no height, and nothing to divide by.
    return "".join(BARS[round(steps * (v - low) / ((high - low) or 1.0))] for v in shown)


def _line(row: KeyFigures) -> tuple[object, ...]:
    return (
        row.cell or "all",
        _percent(row.availability),
        _percent(row.effectiveness),
        _percent(row.quality_ratio),
        _percent(row.oee),
        row.cycles,
        row.done,
        row.programs,
        row.twin_moves,
        row.operator_moves,
        "" if row.cycle_s is None else f"{row.cycle_s:.1f}",
        row.parts,
        row.stops,
        row.failures,
        _duration(row.mean_between_failures_s),
        _duration(row.mean_restoration_s),
        _duration(row.off_s or None),
    )


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100.0 * share:.1f} %"


def _duration(seconds: float | None) -> str:
    if seconds is None:
        return ""
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"
