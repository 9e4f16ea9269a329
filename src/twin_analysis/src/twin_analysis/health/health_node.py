"""Command ``health``: recordings of the same cycle, day by day; says which joint wears, and why.

    rosrun twin_analysis health BAG BAG ... [--week 12]

The first ``--week`` recordings are the healthy robot. Needs no cell and no ROS master. Exit code:
0 nothing has changed, 1 something has, 2 a wrong profile, 3 a recording cannot be used, or there
are too few to tell.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from cell_recorder.reading.bag_reader_io import BagError
from scara_config import ConfigError, load_robot
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import UNUSABLE, WRONG
from twin_experiments.config import load_experiments

from twin_analysis.health.cycle_reader_io import read_cycle
from twin_analysis.health.signs import Signs, TorqueError, signs_of
from twin_analysis.health.trend import LEAST, RECENT, Baseline, Monitor, facts_of

CHANGED = 1

app = CommandLine(
    "health",
    {ConfigError: WRONG, BagError: UNUSABLE, TorqueError: UNUSABLE, OSError: UNUSABLE},
    help="Say which joint wears, by recordings of the same cycle.",
)


@app.command()
def health(
    bags: Annotated[list[Path], typer.Argument(help="Recordings of one cycle each, oldest first.")],
    week: Annotated[int, typer.Option(help="So many are the first week.", min=LEAST)] = LEAST,
    config_dir: Annotated[Path | None, typer.Option(help="Configuration; default: ours.")] = None,
) -> None:
    """Hold each recording behind the first week against it."""
    if len(bags) < week:
        raise typer.BadParameter(f"{len(bags)} recordings: the first week alone needs {week}")
    robot = load_robot(config_dir)
    longest_gap = load_experiments(robot, config_dir).metrics.longest_gap_s
    joints = facts_of(robot)
    names: tuple[str, ...] = ()
    signs: list[Signs] = []
    for path in bags:
        found, cycle, alone = read_cycle(path, longest_gap)
        if alone > longest_gap:
            print(f"{path.name}: {alone:.1f} s are left out, in which the twin told nothing")
        names = names or found
        if found != names:
            raise BagError(f"{path}: has joints {', '.join(found)}, others {', '.join(names)}")
        if unknown := [name for name in names if name not in joints.names]:
            raise ConfigError(
                f"{path}: has {', '.join(unknown)}, which robot.yaml of {robot.name} has not: "
                f"there are {', '.join(joints.names)}"
            )
        try:
            signs.append(signs_of(cycle, joints.of(names).fastest))
        except TorqueError as error:
            raise TorqueError(f"{path}: {error} ({', '.join(names)})") from error
    base = Baseline(joints.of(names), signs[:week])
    if base.left_out:
        print(f"health: {base.left_out}")
    monitor = Monitor(base)
    said: list[str] = []
    for path, sign in zip(bags[week:], signs[week:]):
        finding = monitor.take(sign)
        # Until it is repaired each cycle finds it again.
        if finding is not None and finding.text not in said:
            said.append(finding.text)
            print(f"{path.name}: {finding.text}")
    behind = len(bags) - week
    if behind < RECENT:
        print(
            f"health: {behind} recordings behind the first week's {week} cannot tell: "
            f"a change shows from {RECENT} on"
        )
        raise typer.Exit(UNUSABLE)
    if not said:
        print(f"health: {behind} recordings are as the first week's {week}")
    raise typer.Exit(CHANGED if said else 0)


main = app.run
