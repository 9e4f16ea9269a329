"""Command ``compare``: recordings held against each other, real against twin and run against run.

    rosrun twin_analysis compare BAG BAG... --output DIR [--real-topic NAME --twin-topic NAME]

Works on bags of other robots too, as long as two topics hold joint states. Needs no cell and no ROS
master. Exit code: 0 compared, 1 some experiment could not be compared, 2 wrong configuration, 3 a
bag cannot be used.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from cell_recorder.reading.bag_reader_io import BagError
from rich.console import Console
from rich.table import Table
from scara_config import ConfigError
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import UNUSABLE, WRONG
from twin_experiments.report.record import RecordError
from twin_experiments.report.run_reader_io import TWIN

from twin_analysis.compare.document import PAIR_HEADINGS, RUN_HEADINGS, pair_rows, run_rows
from twin_analysis.compare.track_reader_io import Topics
from twin_analysis.compare.writer_io import WrittenComparison, write_comparison

INCOMPLETE = 1

app = CommandLine(
    "compare",
    {ConfigError: WRONG, BagError: UNUSABLE, RecordError: UNUSABLE, OSError: UNUSABLE},
    help="Compare recordings with each other.",
)


@app.command()
def compare(
    bags: Annotated[
        list[Path], typer.Argument(help="Recordings; the others are held against the first one.")
    ],
    output: Annotated[
        Path | None,
        typer.Option(help="Folder of table and figures; default: comparison beside the first."),
    ] = None,
    real_topic: Annotated[str | None, typer.Option(help="Joint states of the real robot.")] = None,
    twin_topic: Annotated[str, typer.Option(help="Joint states of the twin.")] = TWIN,
    config_dir: Annotated[
        Path | None, typer.Option(help="Configuration for what a bag does not hold.")
    ] = None,
) -> None:
    """Compare real with twin in each recording, and each recording with the first one."""
    folder = (output or bags[0].parent / "comparison").resolve()
    written = write_comparison(bags, folder, Topics(real_topic, twin_topic), config_dir)
    print_comparison(written, Console(highlight=False))
    raise typer.Exit(
        INCOMPLETE if any(experiment.reasons for experiment in written.experiments) else 0
    )


def print_comparison(written: WrittenComparison, console: Console) -> None:
    """Print the tables, one column for each recording, and all remarks."""
    unit = written.mechanism.place_unit
    for experiment in written.experiments:
        _print_table(
            f"{experiment.name}: real against twin",
            [PAIR_HEADINGS, *pair_rows(experiment)],
            console,
        )
        if experiment.runs:
            title = f"{experiment.name}: against {experiment.first}"
            _print_table(title, [RUN_HEADINGS, *run_rows(experiment, unit)], console)
        for reason in experiment.reasons:
            console.print(reason, markup=False, soft_wrap=True)
    for remark in written.remarks:
        console.print(remark, markup=False, soft_wrap=True)
    console.print(f"comparison: {written.folder / 'comparison.html'}", soft_wrap=True)


def _print_table(title: str, columns: list[tuple[str, ...]], console: Console) -> None:
    """Print a table turned by a quarter, so that many figures fit a narrow terminal."""
    table = Table(title=title)
    for column in columns:
        table.add_column(column[0])
    for cells in list(zip(*columns))[1:]:
        table.add_row(*cells)
    console.print(table)


main = app.run
