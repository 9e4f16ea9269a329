"""Command ``report``: rebuilds the report of a bag from the bag alone.

Needs no cell and no ROS master.

    rosrun twin_experiments report BAG --output DIR

Exit code: 0 all passed, 1 a verdict failed, 2 wrong configuration, 3 the bag cannot be used.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from cell_recorder.reading.bag_reader_io import BagError
from rich.console import Console
from scara_config import ConfigError
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import FAILED, UNUSABLE, WRONG

from twin_experiments.report.record import RecordError
from twin_experiments.report.report_io import write_report
from twin_experiments.run.terminal_node import print_report

app = CommandLine(
    "report",
    {ConfigError: WRONG, BagError: UNUSABLE, RecordError: UNUSABLE, OSError: UNUSABLE},
    help="Rebuild the report of a recorded run.",
)


@app.command()
def report(
    bag: Annotated[Path, typer.Argument(help="Recording of a run, unfinished ones too.")],
    output: Annotated[
        Path | None, typer.Option(help="Folder of the report; default: that of the bag.")
    ] = None,
    config_dir: Annotated[
        Path | None, typer.Option(help="Configuration for what the bag does not hold.")
    ] = None,
) -> None:
    """Rebuild the report of a recorded run from its bag alone."""
    written = write_report(bag, (output or bag.parent).resolve(), config_dir)
    print_report(written, Console(highlight=False))
    raise typer.Exit(0 if written.passed else FAILED)


main = app.run
