"""Say a program's positions in joints or Cartesian: rosrun what_if convert PROGRAM TO.

The motions stay the same. The new text is printed, or written to a file. A Cartesian one selects
its frames and tells them in remarks. Nothing is written to any wire. Exit code 0 done, 2 not.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from scara_config import ConfigError, load_robot
from scara_config.frames import find_frames
from scara_config.loader import load_text
from scara_config.profile import PROGRAM_ENDING
from scara_config.programs.files import program_path
from scara_config.writer import check_new_file, replace_file
from scara_ros.shell.command_line_io import CommandLine, ConfigDir, RobotName, choose_robot
from scara_ros.shell.program_io import WRONG

from what_if.converting import converted_text
from what_if.errors import WhatIfError

app = CommandLine(
    "convert",
    {ConfigError: WRONG, WhatIfError: WRONG},
    help="Say a program's positions in joints or Cartesian.",
    rich_markup_mode=None,
)


@app.command()
def convert(
    program: Annotated[str, typer.Argument(help="A program's name, or its file NAME.LS.")],
    to: Annotated[str, typer.Argument(help="joints or cartesian.")],
    frame: Annotated[
        int | None,
        typer.Option(help="User frame of Cartesian positions; default: each in its own.", min=0),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="File of the new program; default: it is printed.")
    ] = None,
    robot: RobotName = None,
    config_dir: ConfigDir = None,
) -> None:
    """Say a program's positions in joints or Cartesian."""
    choose_robot(robot)
    if out is not None:
        check_new_file(out, PROGRAM_ENDING)
    text, kept = converted_text(
        load_text(program_path(program, config_dir)),
        load_robot(config_dir),
        find_frames(config_dir),
        to,
        frame,
        out.stem.upper() if out else "",
    )
    for line in kept:
        typer.echo(f"convert: {line}", err=True)
    if out is None:
        typer.echo(text, nl=False)
        return
    replace_file(out, text)
    typer.echo(f"program    {out}")


main = app.run
