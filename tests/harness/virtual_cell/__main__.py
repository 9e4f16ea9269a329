"""Command line of ``./cell bench --virtual``: print the figures, or store them as baseline.

python -m harness.virtual_cell [ROBOT ... | --renew] [--json]
"""

from __future__ import annotations

import subprocess
import sys
import time
from datetime import datetime, timezone
from pathlib import Path
from typing import Annotated

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import msgspec
import typer
from rich.console import Console
from rich.table import Table

from harness.workspace import ROOT, enter_workspace

ROBOTS = ("fanuc_sr6ia", "fanuc_sr3ia", "scara_4axis", "articulated_six")


def main(
    robots: Annotated[
        list[str] | None, typer.Argument(help="Profiles; default: all shipped ones.")
    ] = None,
    renew: Annotated[bool, typer.Option("--renew", help="Store the figures as baseline.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Run the demo's experiments in virtual time and compare their figures with the baseline."""
    if renew and robots:
        raise typer.BadParameter("--renew stores one date and one commit for all: name no robot")
    enter_workspace()
    from harness.virtual_cell import baseline as stored
    from harness.virtual_cell.experiments import Figures, measure

    console, found = Console(stderr=as_json, highlight=False), {}
    for robot in robots or ROBOTS:
        begun = time.process_time()
        found[robot] = measure(robot)
        console.print(f"{robot}: {time.process_time() - begun:.1f} s of processor time")
    if renew:
        today = datetime.now(timezone.utc).strftime("%Y-%m-%d")
        stored.write_baseline(stored.Baseline(today, commit(), found))
        console.print(f"baseline written: {stored.FILE.relative_to(ROOT)}", soft_wrap=True)
    if as_json:
        print(msgspec.json.encode(found).decode())
        return
    known = stored.read_baseline()
    table = Table("robot", "experiment", "figure", "now", "baseline")
    lines = []
    for robot, experiments in found.items():
        for experiment, new in experiments.items():
            old = known.figures.get(robot, {}).get(experiment)
            for name in Figures.__struct_fields__:
                was = f"{getattr(old, name):.6g}" if old else "-"
                table.add_row(robot, experiment, name, f"{getattr(new, name):.6g}", was)
            # A robot that somebody has made has no baseline.
            if robot in ROBOTS:
                lines += stored.worse(robot, experiment, new, known)
    console.print(table)
    for line in lines:
        console.print(line, soft_wrap=True)
    raise typer.Exit(1 if lines else 0)


def commit() -> str:
    """Return the commit that is checked out, marked when files differ from it."""
    words = ["git", "-C", str(ROOT), "describe", "--always", "--dirty", "--abbrev=9"]
    done = subprocess.run(words, capture_output=True, text=True)
    return done.stdout.strip() or "unknown"


if __name__ == "__main__":
    typer.run(main)
