"""Command ``shadow``.

It prints the pair at any time of a recording as one JSON document, as ``twin_controller/shadow``
gives it live.

    rosrun twin_analysis shadow BAG --time 12.5

Needs no cell and no ROS master. Exit code: 0 found, 2 wrong configuration in the bag, 3 the bag
cannot be used.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
import typer
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from scara_config import ConfigError
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import UNUSABLE, WRONG
from twin_controller.reporting.snapshots import SnapshotError
from twin_experiments.report.record import RecordError

from twin_analysis.replay.decision_reader_io import read_inputs, read_setups
from twin_analysis.replay.history import shadow_at

app = CommandLine(
    "shadow",
    {ConfigError: WRONG, BagError: UNUSABLE, RecordError: UNUSABLE, SnapshotError: UNUSABLE},
    help="Show the pair at a time of a recording.",
)


@app.command()
def shadow(
    bag: Annotated[Path, typer.Argument(help="Recording of a run, unfinished ones too.")],
    time: Annotated[
        float,
        typer.Option(help="Seconds from the start; negative: before the end; large: ROS time."),
    ] = 0.0,
) -> None:
    """Print the shadow of the pair at a time of a recording."""
    with open_bag(bag) as opened:
        found = shadow_at(read_setups(opened), list(read_inputs(opened)), time)
    typer.echo(msgspec.json.format(msgspec.json.encode(found), indent=2).decode())


main = app.run
