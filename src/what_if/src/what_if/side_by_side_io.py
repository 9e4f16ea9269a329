"""Work in the cell of a world, spread over the processors.

Each process reads the cell by itself and gets the state and its jobs. What comes of a job depends
on the job alone: neither the number of processes nor their order counts.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from scara_config.profile import CHOICE

from what_if.cell_files_io import Models, resting_cell
from what_if.errors import WhatIfError
from what_if.world import World

TRIES = 2
"""A process that is killed takes its jobs with it: they are done once more."""
NICENESS = 10
"""As the judge beside a cell."""
IN_NO_FILE = (
    "q",
    "lag",
    "parts",
    "payload",
    "people",
    "obstacles",
    "zones",
    "override_percent",
    "cap_percent",
)
"""What of a world another process cannot read by itself; its models it can, and they do not pickle.
"""
Job = TypeVar("Job")
Done = TypeVar("Done")


def side_by_side(
    world: World,
    work: Callable[[World, Models, Job], Done],
    jobs: Mapping[int, Job],
    workers: int = 0,
    directory: Path | None = None,
    told: Callable[[Done], None] = lambda _: None,
) -> dict[int, Done]:
    """Do jobs in processes of their own.

    Args:
        world: The cell as it is.
        work: What is done with that world, its dynamics and a job; it has to pickle.
        jobs: By number.
        workers: Processes; 0: one for each processor.
        directory: Of the YAML files.
        told: Is called with what comes of each job, as it comes.

    Returns:
        What came of each job.

    Raises:
        WhatIfError: The processes are killed again and again.
    """
    state = {name: getattr(world, name) for name in IN_NO_FILE}
    begin = (state, work, os.environ.get(CHOICE, ""), directory)
    done: dict[int, Done] = {}
    for _ in range(TRIES):
        left = {number: job for number, job in jobs.items() if number not in done}
        if left:
            _spread(begin, left, workers or len(os.sched_getaffinity(0)), done, told)
    if len(done) < len(jobs):
        raise WhatIfError(f"worlds: the processes were killed {TRIES} times: is memory short?")
    return done


def _spread(
    begin: tuple[Any, ...],
    jobs: Mapping[int, Any],
    workers: int,
    done: dict[int, Any],
    told: Callable[[Any], None],
) -> None:
    """Do jobs side by side until all are done or a process was killed."""
    # Not forked: threads of a ROS node would be lost half way.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(jobs)), context, _begin, begin) as pool:
        futures = {pool.submit(_do, job): number for number, job in jobs.items()}
        try:
            for future in as_completed(futures):
                done[futures[future]] = future.result()
                told(done[futures[future]])
        except BrokenProcessPool:
            return
        finally:
            pool.shutdown(cancel_futures=True)


_open = ExitStack()
"""Keeps the engine of this process's cell until the process ends."""
_asked: list[tuple[World, Models, Callable[[World, Models, Any], Any]]] = []
"""What this process works with; its jobs find it here."""


def _begin(
    state: dict[str, Any],
    work: Callable[[World, Models, Any], Any],
    robot: str,
    directory: Path | None,
) -> None:
    """Read the cell in a process that has just begun."""
    os.nice(NICENESS)
    if robot:
        os.environ[CHOICE] = robot
    resting, models = _open.enter_context(resting_cell(directory))
    _asked.append((replace(resting, **state), models, work))


def _do(job: Any) -> Any:
    """Do one job."""
    ((world, models, work),) = _asked
    return work(world, models, job)
