"""Command ``dataset``: labelled runs of robots that wear, as Parquet with a datasheet.

    ./cell dataset health --runs 1000 --seed 1 [--out FOLDER] [--workers N]

Needs no cell and no ROS master. Exit code: 0 written, 2 a wrong profile.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer
from scara_config import ConfigError
from scara_config.loader import config_directory
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import WRONG

ROBOT = "fanuc_sr6ia"
app = CommandLine("dataset", {ConfigError: WRONG}, help="Write labelled runs as Parquet.")


@app.command()
def dataset(
    kind: Annotated[str, typer.Argument(help="health: runs of robots that wear.")],
    runs: Annotated[int, typer.Option(help="How many runs.", min=1, max=100_000)] = 1000,
    seed: Annotated[int, typer.Option(help="The same gives the same bytes.", min=0)] = 1,
    out: Annotated[Path | None, typer.Option(help="Folder; default: dataset_health here.")] = None,
    workers: Annotated[int, typer.Option(help="Processes; 0: one a processor.", min=0)] = 0,
) -> None:
    """Write the runs, and say where they are and what their digest is."""
    if kind != "health":
        raise typer.BadParameter(f"{kind}: there is health")
    from twin_analysis.health.dataset_io import write_dataset

    folder = (out or Path("dataset_health")).resolve()
    profile = config_directory() / "robots" / ROBOT
    digest = write_dataset(folder, runs, seed, workers or os.cpu_count() or 1, profile)
    print(f"dataset: {runs} runs in {folder}; sha256 of both tables {digest}")


main = app.run
