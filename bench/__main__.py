"""Command line of ``./cell bench``: chooses what is measured, prints the table, writes it as JSON.

A section is a function that takes :class:`Options` and returns rows; put it into ``SECTIONS`` to make it an option.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import typer  # noqa: E402
from harness.faults.rows import Row  # noqa: E402
from harness.workspace import enter_workspace  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402


@dataclass(frozen=True)
class Options:
    """What the user asked for."""

    seeds: int
    minutes: float
    folder: Path
    console: Console


def _faults(options: Options) -> list[Row]:
    from bench.faults import run

    return run(options.seeds, options.minutes, options.folder, options.console)


def _variations(options: Options) -> list[Row]:
    from bench.variations import run

    return run(options.folder, options.console)


SECTIONS: dict[str, Callable[[Options], list[Row]]] = {"faults": _faults, "variations": _variations}
BY_DEFAULT: tuple[str, ...] = ()
"""Sections that run when none is named; the faults take more than an hour."""


def main(
    faults: Annotated[bool, typer.Option("--faults", help="The long fault campaign.")] = False,
    variations: Annotated[bool, typer.Option("--variations", help="The experiments under other speeds, models, delays.")] = False,
    seeds: Annotated[int, typer.Option(help="How often each fault is done, each time otherwise.", min=0)] = 20,
    minutes: Annotated[float, typer.Option(help="Minutes of random faults, and at most 10 of sensor noise.", min=0.0)] = 60.0,
    output: Annotated[Path | None, typer.Option("--json", help="Where the table goes as JSON; default: runs/bench/.")] = None,
) -> None:
    """Measure, and compare with the limits. Exit code 0: all hold; 1: one does not; 2: nothing to measure."""
    chosen = [name for name, wanted in (("faults", faults), ("variations", variations)) if wanted] or list(BY_DEFAULT)
    console = Console()
    if not chosen:
        console.print(f"cell bench: nothing chosen; there is: {', '.join('--' + name for name in SECTIONS)}")
        raise typer.Exit(2)
    enter_workspace()
    folder = ROOT / "runs" / "bench" / time.strftime("%Y-%m-%d_%H-%M-%S")
    folder.mkdir(parents=True)
    rows = [row for name in chosen for row in SECTIONS[name](Options(seeds, minutes, folder, console))]
    console.print(table(rows))
    file = output or folder / "bench.json"
    file.write_text(json.dumps([row.record() for row in rows], indent=1) + "\n", encoding="utf-8")
    broken = sum(not row.holds for row in rows)
    console.print(f"{len(rows)} rows, {broken} beyond their limit; {file}")
    raise typer.Exit(1 if broken else 0)


def table(rows: list[Row]) -> Table:
    """Lay rows out for a person."""
    shown = Table(show_lines=False)
    for heading in ("case", "metric", "limit", "measured", "holds"):
        shown.add_column(heading, justify="right" if heading in ("limit", "measured") else "left")
    for row in rows:
        sign = "≥" if row.at_least else "≤"
        verdict = "[green]yes[/]" if row.holds else "[bold red]NO[/]"
        shown.add_row(row.fault, row.metric.replace("[", r"\["), f"{sign} {row.limit:.4g}", f"{row.measured:.4g}", verdict)
    return shown


if __name__ == "__main__":
    typer.run(main)
