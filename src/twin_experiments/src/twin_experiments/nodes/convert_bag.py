"""Command ``convert_bag``: a bag becomes one MCAP file for Foxglove and PlotJuggler.

    rosrun twin_experiments convert_bag BAG OUT.mcap [--profile ros1] [--compression zstd]

Every message is read back. Needs no cell and no ROS master. Exit code: 0 converted, 3 it could not
be.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from cell_recorder.io.reading.bag_reader import BagError
from rich.console import Console

from twin_experiments.io.mcap import Compression, Profile, convert_to_mcap

UNUSABLE = 3

app = typer.Typer(add_completion=False, help="Convert a bag to MCAP.")


@app.command()
def convert_bag(
    bag: Annotated[Path, typer.Argument(help="Recording of a run, unfinished ones too.")],
    target: Annotated[
        Path,
        typer.Argument(metavar="OUT.mcap", help="File to be written; it must not be there yet."),
    ],
    profile: Annotated[
        Profile,
        typer.Option(help="ros2: message types of ROS 2; ros1: each message as it was recorded."),
    ] = Profile.ROS2,
    compression: Annotated[
        Compression, typer.Option(help="Of the file's chunks. lz4 goes with --profile ros1.")
    ] = Compression.NONE,
) -> None:
    """Convert a bag to one MCAP file and read it back."""
    try:
        counts = convert_to_mcap(bag, target, profile, compression)
    except BagError as error:
        Console(stderr=True, highlight=False).print(
            f"convert_bag: {error}", soft_wrap=True, markup=False
        )
        raise typer.Exit(UNUSABLE) from error
    Console(highlight=False).print(
        f"{sum(counts.values())} messages of {len(counts)} topics in {target}", soft_wrap=True
    )


def main() -> None:
    """Run the command."""
    app(prog_name="convert_bag")
