"""Judge a motion in many drawn worlds, spread over the processors.

Each process reads the cell by itself and gets the state, the motion and rows of numbers, so a lot
of worlds is a job that could be done on another machine as well. What comes of a world depends on
its row alone: neither the number of processes nor their order counts.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
from scara_config.profile import CHOICE

from what_if.errors import WhatIfError
from what_if.geometry.bodies import FloatArray
from what_if.motions import Motion
from what_if.uncertainty.chances import Chances, Tried, chances_of
from what_if.uncertainty.far_worlds_io import spread_far
from what_if.uncertainty.spreads import drawn, spreads_of
from what_if.world import World
from what_if.world_worker_io import Question, State, Worker

LOT = 20
"""So many worlds are one job; our choice: about a second."""
TRIES = 2
"""A process that is killed takes its jobs with it: they are done once more."""
NICENESS = 10
"""As the judge beside a cell."""


def chances(
    world: World,
    motion: Motion,
    worlds: int,
    seed: int,
    workers: int = 0,
    directory: Path | None = None,
    told: Callable[[int], None] = lambda _: None,
    scheduler: str = "",
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
        scheduler: HOST:PORT of a scheduler of dask whose workers do it; empty: processes of ours.

    Raises:
        WhatIfError: The question is wrong, its processes are killed again and again, or there is
            no such scheduler.
    """
    if worlds < 1:
        raise WhatIfError(f"worlds = {worlds}: at least 1 is needed")
    spreads = spreads_of(world)
    state = State(**{name: getattr(world, name) for name in State.__dataclass_fields__})
    question = Question(state, motion, spreads, os.environ.get(CHOICE, ""), directory)
    rows = drawn(spreads, worlds, np.random.default_rng(seed))
    lots = {begin: rows[begin : begin + LOT] for begin in range(0, worlds, LOT)}
    done: dict[int, list[Tried]] = {}
    for _ in range(TRIES):
        left = {begin: lot for begin, lot in lots.items() if begin not in done}
        if left and scheduler:
            spread_far(scheduler, question, left, done, told)
        elif left:
            _spread(question, left, workers or len(os.sched_getaffinity(0)), done, told)
    if len(done) < len(lots):
        raise WhatIfError(f"worlds: the processes were killed {TRIES} times: is memory short?")
    return chances_of([one for begin in lots for one in done[begin]], spreads, seed)


def _spread(
    question: Question,
    lots: dict[int, FloatArray],
    workers: int,
    done: dict[int, list[Tried]],
    told: Callable[[int], None],
) -> None:
    """Do jobs side by side until all are done or a process was killed."""
    # Not forked: threads of a ROS node would be lost half way.
    context = multiprocessing.get_context("spawn")
    count = min(workers, len(lots))
    with ProcessPoolExecutor(count, context, _begin, (question,)) as pool:
        jobs = {pool.submit(_judge_lot, lot): begin for begin, lot in lots.items()}
        try:
            for job in as_completed(jobs):
                done[jobs[job]] = job.result()
                told(sum(map(len, done.values())))
        except BrokenProcessPool:
            return
        finally:
            pool.shutdown(cancel_futures=True)


_worker: Worker | None = None
"""Of this process; a job finds it here."""


def _begin(question: Question) -> None:
    global _worker
    os.nice(NICENESS)
    # One thread of arithmetic each: the processes share the processors among them already.
    os.environ.update({"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})
    _worker = Worker(question)


def _judge_lot(rows: FloatArray) -> list[Tried]:
    assert _worker is not None
    return [_worker.tried(row.tolist()) for row in rows]
