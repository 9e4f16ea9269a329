"""Command ``step_response``.

It measures the step responses of one joint of the twin in both directions, as the article's Figures
8 to 10.

    rosrun twin_analysis step_response joint_1 --output DIR

On a running simulator if one answers (through ``twin/<joint>_position_controller/command`` and
``.../state_each_step``), else, or with ``--offline``, on a simulator of its own in process.
Parameter: ``_config_dir:=FOLDER``. Exit code: 0 within the limits, 1 not, 2 wrong configuration or
arguments, 3 the steps could not be made.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import rosgraph
import rospy
import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table
from scara_config import ConfigError, Joint, load_robot
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import FAILED, WRONG, private_parameters
from scara_ros.starting.hardening_io import harden_process

from twin_analysis.step.offline_io import OfflineBench
from twin_analysis.step.response import Kind, Step, StepError
from twin_analysis.step.step_bench_node import LiveBench, LiveError, simulator_answers
from twin_analysis.step.trial import Trial, plan_trial, summary

NOT_MADE = 3

app = CommandLine(
    "step_response",
    {
        ConfigError: WRONG,
        StepError: WRONG,
        LiveError: NOT_MADE,
        OSError: NOT_MADE,
        rospy.ROSException: NOT_MADE,
    },
    help="Step responses of one joint of the twin, in both directions.",
)
console = Console(highlight=False)


@app.command()
def step_response(
    joint: Annotated[str, typer.Argument(help="Joint of the twin.")],
    output: Annotated[Path, typer.Option(help="Folder of the PNG and JSON files.")],
    offline: Annotated[
        bool, typer.Option("--offline", help="On a simulator in process, also if one is running.")
    ] = False,
    plain: Annotated[
        bool,
        typer.Option("--plain", help="In process without feed-forward: the article's plain PID."),
    ] = False,
    velocity: Annotated[
        bool, typer.Option("--velocity", help="The velocity loop instead of the position loop.")
    ] = False,
    size: Annotated[
        float | None,
        typer.Option(help="Step in deg or mm, or per second; default: 5 deg, 20 mm, 10 %."),
    ] = None,
    seconds: Annotated[float | None, typer.Option(help="Length of each record.")] = None,
    with_robot: Annotated[
        bool, typer.Option("--with-robot", help="Also in a whole cell, where the robot follows.")
    ] = False,
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
    live = not (offline or plain) and rosgraph.is_master_online() and simulator_answers(joint)
    if live:
        trial, steps, where = _run_live(chosen, kind, size, seconds, with_robot=with_robot)
    else:
        why = "" if offline or plain else f"no simulator at {rosgraph.get_master_uri()}: "
        console.print(f"{why}in process, offline", soft_wrap=True)
        bench = OfflineBench(robot, Path(folder) if folder else None, plain=plain)
        trial = plan_trial(chosen, kind, bench.position(joint), size, seconds)
        steps, where = (
            bench.run(trial),
            {"simulator": "offline", "feed_forward": bench.feed_forward},
        )
    label = "_".join([joint, *(["velocity"] if velocity else []), *(["plain"] if plain else [])])
    document = summary(trial, steps, {"title": _title(trial, where), **where})
    from twin_analysis.step.figures_io import write_trial  # slow to load: after the steps

    written = write_trial(trial, steps, document, output.resolve(), label)
    _print(document, written)
    raise typer.Exit(0 if document["verdict"] == "pass" else FAILED)


def _run_live(
    joint: Joint, kind: Kind, size: float | None, seconds: float | None, *, with_robot: bool
) -> tuple[Trial, list[Step], dict[str, Any]]:
    """Make the steps on the running simulator."""
    console.print(f"on the simulator at {rosgraph.get_master_uri()}", soft_wrap=True)
    harden_process()
    rospy.init_node("step_response", anonymous=True, disable_signals=True)
    with LiveBench(joint.name, kind, with_robot=with_robot) as bench:
        trial = plan_trial(joint, kind, bench.position(), size, seconds)
        return trial, bench.run(trial), {"simulator": "live", "feed_forward": None}


def _title(trial: Trial, where: dict[str, Any]) -> str:
    """Return what the figures are called."""
    how = {True: "with feed-forward", False: "plain PID", None: "running simulator"}[
        where["feed_forward"]
    ]
    return f"{trial.joint.name}, {trial.kind} loop, {how}"


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
        if row["states_lost"]:
            console.print(
                f"{row['direction']}: {row['states_lost']} states were lost on the way",
                soft_wrap=True,
            )
    for file in written:
        console.print(str(file), soft_wrap=True)


def _milliseconds(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds * 1e3:.0f} ms"


main = app.run
