"""Judge a motion in many drawn worlds, spread over the processors.

Each process reads the cell by itself and gets the state, the motion and rows of numbers. What comes
of a world depends on its row alone: neither the number of processes nor their order counts.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scara_config.profile import CHOICE

from what_if.cell_files_io import Models, resting_cell
from what_if.errors import WhatIfError
from what_if.geometry.bodies import FloatArray
from what_if.judging import judge
from what_if.motions import Motion
from what_if.uncertainty.chances import Chances, Tried, chances_of, tried
from what_if.uncertainty.spreads import Spread, drawn, spreads_of
from what_if.uncertainty.varied import payload_of, varied
from what_if.world import World

LOT = 20
"""So many worlds are one job; our choice: about a second."""
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
    "zones",
    "override_percent",
    "cap_percent",
)
"""What of a world another process cannot read by itself; its models it can, and they do not pickle.
"""


def chances(
    world: World,
    motion: Motion,
    worlds: int,
    seed: int,
    workers: int = 0,
    directory: Path | None = None,
    told: Callable[[int], None] = lambda _: None,
) -> Chances:
    """Draw worlds, try the motion in each, and count.

    Args:
        world: The cell as it is believed to be.
        motion: What is asked for.
        worlds: So many; at least 1.
        seed: The same chances from the same seed, whatever the number of workers.
        workers: Processes; 0: one for each processor.
        directory: Of the YAML files.
        told: Is called with the number of worlds that are done, as it grows.

    Raises:
        WhatIfError: The question is wrong, or its processes are killed again and again.
    """
    if worlds < 1:
        raise WhatIfError(f"worlds = {worlds}: at least 1 is needed")
    spreads = spreads_of(world)
    state = {name: getattr(world, name) for name in IN_NO_FILE}
    question = (state, motion, spreads, os.environ.get(CHOICE, ""), directory)
    rows = drawn(spreads, worlds, np.random.default_rng(seed))
    lots = {begin: rows[begin : begin + LOT] for begin in range(0, worlds, LOT)}
    done: dict[int, list[Tried]] = {}
    for _ in range(TRIES):
        left = {begin: lot for begin, lot in lots.items() if begin not in done}
        if left:
            _spread(question, left, workers or len(os.sched_getaffinity(0)), done, told)
    if len(done) < len(lots):
        raise WhatIfError(f"worlds: the processes were killed {TRIES} times: is memory short?")
    return chances_of([one for begin in lots for one in done[begin]], spreads, seed)


def _spread(
    question: tuple[Any, ...],
    lots: dict[int, FloatArray],
    workers: int,
    done: dict[int, list[Tried]],
    told: Callable[[int], None],
) -> None:
    """Do jobs side by side until all are done or a process was killed."""
    # Not forked: threads of a ROS node would be lost half way.
    context = multiprocessing.get_context("spawn")
    count = min(workers, len(lots))
    with ProcessPoolExecutor(count, context, _begin, question) as pool:
        jobs = {pool.submit(_judge_lot, lot): begin for begin, lot in lots.items()}
        try:
            for job in as_completed(jobs):
                done[jobs[job]] = job.result()
                told(sum(map(len, done.values())))
        except BrokenProcessPool:
            return
        finally:
            pool.shutdown(cancel_futures=True)


_open = ExitStack()
"""Keeps the engine of this process's cell until the process ends."""
_asked: list[tuple[World, Models, Motion, tuple[Spread, ...]]] = []
"""What this process is asked; its jobs find it here."""


def _begin(
    state: dict[str, Any],
    motion: Motion,
    spreads: tuple[Spread, ...],
    robot: str,
    directory: Path | None,
) -> None:
    """Read the cell in a process that has just begun."""
    os.nice(NICENESS)
    if robot:
        os.environ[CHOICE] = robot
    resting, models = _open.enter_context(resting_cell(directory))
    _asked.append((replace(resting, **state), models, motion, spreads))


def _judge_lot(rows: FloatArray) -> list[Tried]:
    """Try the motion in the world of each row."""
    ((resting, models, motion, spreads),) = _asked
    lot = []
    for row in map(np.ndarray.tolist, rows):
        world, payload = resting, payload_of(resting, spreads, row)
        if payload is not None:
            world = replace(world, payload=payload, models=models.told(payload))
        lot.append(tried(judge(varied(world, spreads, row), motion)))
    return lot
