"""Bring the inertia of a URDF file up to date with its masses and collision shapes; no ROS needed.

Usage: rosrun scara_description write_inertia FILE
"""

from __future__ import annotations

import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Annotated

import typer
from scara_ros.shell.command_line_io import CommandLine

from scara_description.inertia import ShapeError, with_inertia

app = CommandLine("write_inertia", {}, help="Bring the inertia of a URDF file up to date.")


@app.command()
def write_inertia(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="The URDF.")],
) -> None:
    """Rewrite a file; say what was wrong and leave it as it is otherwise."""
    try:
        before = path.read_text(encoding="utf-8")
        after = with_inertia(before)
    except (OSError, ET.ParseError, ShapeError) as error:
        sys.exit(f"{path}: {error}")
    if after == before:
        print(f"{path}: up to date")
        return
    path.write_text(after, encoding="utf-8")
    print(f"{path}: inertia written")


main = app.run
