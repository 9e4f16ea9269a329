"""Make a program quicker: rosrun what_if improve PROGRAM.

Order, speeds, corners, heights, table and elbow, searched in the second world on all processors
and proven on both plants. The answer is a program beside the old one that a person can read, a
table of what changed and why it is quicker, and the proof. Exit code 0 with proof, 1 nothing better
was found or proven, 2 a wrong word, or a program that cannot be judged. Nothing is written to any
wire.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from scara_config import ConfigError
from scara_config.profile import PROGRAM_ENDING
from scara_config.programs.files import program_path
from scara_config.programs.tp.printer import print_program
from scara_config.writer import check_new_file, replace_file
from scara_ros.shell.command_line_io import CommandLine, ConfigDir, RobotName, choose_robot
from scara_ros.shell.program_io import FAILED, WRONG

from what_if.cell_files_io import resting_cell
from what_if.errors import WhatIfError
from what_if.improving.descent import WORTH_S, Found
from what_if.improving.improve_io import Improver, result_of
from what_if.improving.telling import Proof, change_lines, proof_lines

NICENESS = 10
"""As the judge beside a cell."""
SHOWN = Path("-")
"""In place of a file: the program is printed."""
app = CommandLine(
    "improve",
    {ConfigError: WRONG, WhatIfError: WRONG},
    help="Make a program quicker.",
    rich_markup_mode=None,
)


@app.command()
def improve(
    program: Annotated[str, typer.Argument(help="A program's name, or its file NAME.LS.")],
    out: Annotated[
        Path | None,
        typer.Option(help="File of the new program; default: NAME_2.LS beside; -: print it."),
    ] = None,
    tries: Annotated[int, typer.Option(help="Beginnings of the search.", min=1)] = 4,
    seed: Annotated[int, typer.Option(help="Of these, and of the worlds.")] = 0,
    worlds: Annotated[
        int, typer.Option(help="Worlds that differ, in which it is proven.", min=0)
    ] = 100,
    workers: Annotated[
        int, typer.Option(help="Processes; default: one for each processor.", min=0)
    ] = 0,
    robot: RobotName = None,
    config_dir: ConfigDir = None,
) -> None:
    """Make a program quicker."""
    choose_robot(robot)
    path = program_path(program, config_dir)
    file = out or path.with_name(f"{path.stem}_2{PROGRAM_ENDING}")
    if file != SHOWN:
        check_new_file(file, PROGRAM_ENDING)
    name = f"{path.stem}_2" if file == SHOWN else file.stem
    os.nice(NICENESS)
    console = Console(stderr=True)
    with resting_cell(config_dir) as (world, _), Progress(console=console, transient=True) as bars:
        improver = Improver(world, path, config_dir)
        bar = bars.add_task("search", total=tries)
        found = improver.search(tries, seed, workers, lambda: bars.advance(bar))
        better = [
            each for each in found if each.seconds < improver.bench.verdict.duration_s - WORTH_S
        ]
        best: tuple[Found, Proof] | None = None
        # The quickest one first: the plants or other worlds may speak against it, and not the next.
        for each in better:
            bar = bars.add_task("proof", total=worlds or None)
            proof = improver.proof(
                result_of(improver, each, name.upper()),
                worlds,
                seed,
                workers,
                lambda done, bar=bar: bars.update(bar, completed=done),  # type: ignore[misc]
            )
            if not proof.fault:
                best = each, proof
                break
            typer.echo(f"improve: {each.seconds:.2f} s, not proven: {proof.fault}", err=True)
    if best is None:
        typer.echo(f"nothing better was found: {path.stem} stays as it is")
        raise typer.Exit(FAILED)
    text = print_program(result_of(improver, best[0], name.upper()))
    typer.echo("\n".join([*change_lines(improver.changes(best[0])), *proof_lines(best[1])]))
    if file == SHOWN:
        typer.echo(text, nl=False)
        return
    try:
        check_new_file(file, PROGRAM_ENDING)
        replace_file(file, text)
    except ConfigError:
        # The file is there or the disk full by now: what was searched for minutes is not lost.
        typer.echo(text, nl=False)
        raise
    typer.echo(f"program    {file}")


main = app.run
