"""Command ``step_response``.

It measures the step responses of one joint of the twin in both directions, as the article's Figures
8 to 10.

    rosrun twin_analysis step_response joint_1 --output DIR

Makes them on a simulator of its own, in process: needs no cell and no ROS master. Parameter:
``_config_dir:=FOLDER``. Exit code: 0 within the limits, 1 not, 2 wrong configuration or arguments,
3 the files could not be written.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table
from scara_config import ConfigError, load_robot
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import FAILED, WRONG, private_parameters

from twin_analysis.step.offline_io import OfflineBench
from twin_analysis.step.response import Kind, StepResponseError
from twin_analysis.step.trial import plan_trial, summary

NOT_WRITTEN = 3

app = CommandLine(
    "step_response",
    {ConfigError: WRONG, StepResponseError: WRONG, OSError: NOT_WRITTEN},
    help="Step responses of one joint of the twin, in both directions.",
)
console = Console(highlight=False)


@app.command()
def step_response(
    joint: Annotated[str, typer.Argument(help="Joint of the twin.")],
    output: Annotated[Path, typer.Option(help="Folder of the PNG and JSON files.")],
    plain: Annotated[
        bool, typer.Option("--plain", help="Without feed-forward: the article's plain PID.")
    ] = False,
    velocity: Annotated[
        bool, typer.Option("--velocity", help="The velocity loop instead of the position loop.")
    ] = False,
    size: Annotated[
        float | None,
        typer.Option(help="Step in deg or mm, or per second; default: 5 deg, 20 mm, 10 %."),
    ] = None,
    seconds: Annotated[float | None, typer.Option(help="Length of each record.")] = None,
) -> None:
    """Make steps with one joint of the twin and write figures and a judgement of them."""
    kind: Kind = "velocity" if velocity else "position"
    folder = private_parameters(sys.argv).get("config_dir")
    robot = load_robot(folder)
    chosen = robot.joint(joint)
    if not chosen.twin:
        raise ConfigError(
            f"{joint} is not moved by the twin; it moves "
            f"{', '.join(each.name for each in robot.twin_joints)}"
        )
    bench = OfflineBench(robot, Path(folder) if folder else None, plain=plain)
    trial = plan_trial(chosen, kind, bench.position(joint), size, seconds)
    steps = bench.run(trial)
    label = "_".join([joint, *(["velocity"] if velocity else []), *(["plain"] if plain else [])])
    how = "with feed-forward" if bench.feed_forward else "plain PID"
    where = {
        "title": f"{joint}, {kind} loop, {how}",
        "simulator": "offline",
        "feed_forward": bench.feed_forward,
    }
    document = summary(trial, steps, where)
    from twin_analysis.step.figures_io import write_trial  # slow to load: after the steps

    written = write_trial(trial, steps, document, output.resolve(), label)
    _print(document, written)
    raise typer.Exit(0 if document["verdict"] == "pass" else FAILED)


def _print(document: dict[str, Any], written: list[Path]) -> None:
    """Print a row for each direction, what is wrong, and the files."""
    unit, effort = document["unit"], document["effort_unit"]
    table = Table(title=str(document["title"]), box=SIMPLE, padding=(0, 1, 0, 0))
    for heading in (
        "step",
        "rise",
        "overshoot",
        "settled",
        "error at rest",
        "peak effort",
        "verdict",
    ):
        table.add_column(heading, no_wrap=True)
    for row in document["steps"]:
        table.add_row(
            f"{row['target'] - row['start']:+.2f} {unit}",
            _milliseconds(row["rise_time_s"]),
            f"{row['overshoot_percent']:.2f} %",
            _milliseconds(row["settling_time_s"]),
            f"{row['steady_state_error']:+.4f} {unit}",
            f"{row['peak_effort']:.0f} {effort}, {row['peak_effort_percent']:.0f} %",
            "FAIL" if row["reasons"] else "pass",
        )
    console.print(table)
    for row in document["steps"]:
        for reason in row["reasons"]:
            console.print(f"{row['direction']}: {reason}", soft_wrap=True)
    for file in written:
        console.print(str(file), soft_wrap=True)


def _milliseconds(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds * 1e3:.0f} ms"


main = app.run
