"""Learn how the robot runs its programs: rosrun what_if learn BAG...

From the lines that the robot showed while it ran programs of its own it finds how long it rests at
each FINE, and how far single rests lie apart. A YAML difference is proposed; only ``--write``
changes the file. Exit code 0 learned, 3 nothing could be learned.
"""

from __future__ import annotations

import difflib
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from scara_config import ConfigError
from scara_config.profile import locate
from scara_config.writer import changed_text, replace_file
from scara_ros.shell.command_line_io import CommandLine, ConfigDir, RobotName, choose_robot

from what_if.cell_files_io import find_program, resting_cell
from what_if.errors import WhatIfError
from what_if.learning.recorded_programs_io import read_runs
from what_if.timing.learning import learned, rests_of
from what_if.world import World

FAILED = 3
FILE = "what_if.yaml"
app = CommandLine(
    "learn",
    {ConfigError: FAILED, WhatIfError: FAILED},
    help="Learn how the robot runs its programs.",
    rich_markup_mode=None,
)


@app.command()
def learn(
    bags: Annotated[list[Path], typer.Argument(help="In which the robot ran its programs.")],
    write: Annotated[bool, typer.Option("--write", help="Write it into what_if.yaml.")] = False,
    robot: RobotName = None,
    config_dir: ConfigDir = None,
) -> None:
    """Learn how the robot runs its programs."""
    choose_robot(robot)
    with resting_cell(config_dir) as (world, _):
        rests, programs = _rests(world, bags, config_dir)
        law = learned(world.cell.config.program, rests)
        before = world.cell.config.program
    told = ", ".join(f"{count} of {name}" for name, count in programs.items())
    typer.echo(
        f"{len(rests)} moves with FINE ({told}): the robot rests {law.fine_ms:.1f} ms ± "
        f"{law.fine_spread_ms:.1f} ms; what_if.yaml said {before.fine_ms:g} ± "
        f"{before.fine_spread_ms:g}"
    )
    _propose(locate(FILE, config_dir), law.fine_ms, law.fine_spread_ms, write)


def _rests(
    world: World, bags: list[Path], config_dir: Path | None
) -> tuple[list[float], Counter[str]]:
    """Return all rests of the bags, and how many of which program.

    Raises:
        ConfigError: A program that was run is in no file.
        WhatIfError: A bag cannot be read.
    """
    rests: list[float] = []
    programs: Counter[str] = Counter()
    for bag in bags:
        for run in read_runs(world.cell, bag):
            motion = find_program(world.cell, run.program, config_dir)
            begun = replace(world, q=run.q, override_percent=run.override_percent)
            found = rests_of(begun, motion, run.seen)
            rests += found
            programs[run.program] += len(found)
    return rests, programs


def _propose(path: Path, fine_ms: float, spread_ms: float, write: bool) -> None:
    """Show the YAML difference, and write it if asked to.

    Raises:
        ConfigError: The file cannot be read or written.
    """
    values = {"fine_ms": round(fine_ms, 1), "fine_spread_ms": round(spread_ms, 1), "fitted": True}
    text = changed_text(path, {("program", key): value for key, value in values.items()})
    before = path.read_text(encoding="utf-8").splitlines()
    lines = difflib.unified_diff(before, text.splitlines(), FILE, f"{FILE} (proposed)", "", "", 0)
    typer.echo("\n".join(line.rstrip("\n") for line in lines))
    if write:
        replace_file(path, text)
    typer.echo("written" if write else "nothing was written; --write does")


main = app.run
