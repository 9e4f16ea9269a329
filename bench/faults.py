"""The long fault campaign: every scenario with many seeds, sensor noise for minutes, then random faults."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

from harness.faults import operator_faults, value_faults
from harness.faults.campaign import scenarios, storm
from harness.faults.fault_cell import NODES, FaultCell
from harness.faults.roscore_faults import MasterCell, master_killed, master_stopped
from harness.faults.rows import Row, repeated, worst
from harness.ros import Master, Ros
from harness.workspace import workspace_environment
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

LIES = 10_000
SECONDS = 10.0
STORM_S = 15.0
NOISE_MINUTES = 10.0


def run(seeds: int, minutes: float, folder: Path, console: Console) -> list[Row]:
    """Run the campaign and return, for each fault and metric, the worst that was measured.

    Args:
        seeds: How often each scenario is run.
        minutes: Of random faults.
        folder: For logs and bags.
        console: Where progress is shown.
    """
    rows: list[Row] = []
    columns = (TextColumn("{task.description:<40}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as progress:
        rows += _values(seeds, progress)
        rows += _without_master(seeds, folder, progress)
        with _cell(folder) as cell:
            rows += _scenarios(cell, seeds, progress)
            rows += _noise(cell, min(minutes, NOISE_MINUTES), progress)
            rows += _storms(cell, minutes, progress)
    return _summed(rows)


def _values(seeds: int, progress: Progress) -> list[Row]:
    """Let robot and twin lie."""
    task = progress.add_task("lies", total=2 * seeds * LIES)
    rows = []
    for seed in range(seeds):
        for lies in (value_faults.robot_lies, value_faults.twin_lies):
            rows += _attempt(lies.__name__, lambda k=seed, told=lies: told(k, LIES))  # type: ignore[misc]
            progress.advance(task, LIES)
    return rows


def _without_master(seeds: int, folder: Path, progress: Progress) -> list[Row]:
    """Kill and stop the ROS master."""
    rows: list[Row] = []
    if not seeds:
        return rows
    task = progress.add_task("roscore", total=seeds)
    with MasterCell(folder / "roscore") as cell:
        for seed in range(seeds):
            rows += _attempt("roscore killed", lambda: master_killed(cell))
            rows += _attempt("roscore silent", lambda k=seed: master_stopped(cell, 4.0 + k % 3))  # type: ignore[misc]
            cell.home()
            progress.advance(task)
    return rows


def _scenarios(cell: FaultCell, seeds: int, progress: Progress) -> list[Row]:
    """Run each scenario once for each seed, each time in another order."""
    rows: list[Row] = []
    found = scenarios(SECONDS)
    task = progress.add_task("", total=seeds * len(found))
    for seed in range(seeds):
        rng = Random(seed)
        for name in rng.sample(sorted(found), len(found)):
            progress.update(task, description=f"seed {seed}: {name}")
            rows += _in_cell(cell, name, lambda n=name, r=rng: found[n](cell, r), progress)  # type: ignore[misc]
            progress.advance(task)
    return rows


def _noise(cell: FaultCell, minutes: float, progress: Progress) -> list[Row]:
    if not minutes:
        return []
    task = progress.add_task(f"noise for {minutes:g} min", total=1)
    rows = _in_cell(cell, "noise", lambda: operator_faults.noisy(cell, Random(0), 60.0 * minutes), progress)
    progress.advance(task)
    return rows


def _storms(cell: FaultCell, minutes: float, progress: Progress) -> list[Row]:
    """Break things at random until the time is over."""
    rows: list[Row] = []
    task = progress.add_task("random faults [s]", total=round(60.0 * minutes))
    begun, seed = time.monotonic(), 0
    while (past := time.monotonic() - begun) < 60.0 * minutes:
        progress.update(task, completed=round(past))
        rows += _in_cell(cell, "storm", lambda k=seed: storm(cell, Random(1000 + k), STORM_S), progress)  # type: ignore[misc]
        seed += 1
    progress.update(task, completed=round(60.0 * minutes))
    return [*rows, Row("storm", "storms weathered", 1.0, float(seed), at_least=True)] if seed else rows


def _in_cell(cell: FaultCell, name: str, action: Callable[[], list[Row]], progress: Progress) -> list[Row]:
    """Run a scenario on an idle cell; whatever it breaks for good is mended before the next."""
    rows = _attempt(name, lambda: _idle(cell) + action())
    for row in rows:
        if not row.holds:
            progress.console.print(row.text, markup=False)
    return rows


def _attempt(name: str, action: Callable[[], list[Row]]) -> list[Row]:
    """Return the rows of a scenario, and how often it was repeated; one that fails is a row that does not hold."""
    try:
        rows, again = repeated(action)
    except Exception as error:
        return [Row(f"{name}: {str(error).splitlines()[0][:100]}", "did not end as described", 0.0, 1.0, always=True)]
    return [*rows, Row(ALL, REPEATED, 0.05, float(again > 0))]


ALL, REPEATED = "all faults", "scenarios repeated because a time was missed once [part of all]"


def _summed(rows: list[Row]) -> list[Row]:
    """Replace the notes on repetitions by their share."""
    notes = [row.measured for row in rows if row.metric == REPEATED]
    kept = worst([row for row in rows if row.metric != REPEATED])
    return [*kept, Row(ALL, REPEATED, 0.05, sum(notes) / len(notes))] if notes else kept


def _idle(cell: FaultCell) -> list[Row]:
    """Start again what has died, let go on what was stopped, wait until the cell is idle."""
    cell.modbus.refuse(False)
    cell.web.refuse(False)
    for node in NODES:
        if cell.processes[node].poll() is not None:
            cell.start(node)
        else:
            cell.go_on(node)
    cell.recover()
    return []


@contextmanager
def _cell(folder: Path) -> Iterator[FaultCell]:
    """Give a cell on a master of its own, with this process as a node beside it."""
    import rospy

    master = Master(folder / "master", workspace_environment())
    os.environ.update({name: master.env[name] for name in ("ROS_MASTER_URI", "ROS_HOME", "ROS_LOG_DIR")})
    rospy.init_node("bench", disable_signals=True)
    ros = Ros(master, folder / "cell", "faults")
    try:
        with FaultCell(ros) as cell:
            yield cell
    finally:
        ros.close()
        rospy.signal_shutdown("the campaign has ended")
        master.close()
