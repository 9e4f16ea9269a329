"""Judge a motion in many drawn worlds, spread over the processors.

What comes of a world depends on its row of numbers alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from what_if.cell_files_io import Models
from what_if.errors import WhatIfError
from what_if.geometry.bodies import FloatArray
from what_if.judging import judge
from what_if.motions import Motion
from what_if.side_by_side_io import side_by_side
from what_if.uncertainty.chances import Chances, Tried, chances_of, tried
from what_if.uncertainty.spreads import Spread, drawn, spreads_of
from what_if.uncertainty.varied import payload_of, varied
from what_if.world import World

LOT = 20
"""So many worlds are one job; our choice: about a second."""


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
    rows = drawn(spreads, worlds, np.random.default_rng(seed))
    lots = {begin: rows[begin : begin + LOT] for begin in range(0, worlds, LOT)}
    count = 0

    def note(lot: list[Tried]) -> None:
        nonlocal count
        count += len(lot)
        told(count)

    work = partial(_judge_lot, motion, spreads)
    done = side_by_side(world, work, lots, workers, directory, note)
    return chances_of([one for begin in lots for one in done[begin]], spreads, seed)


def _judge_lot(
    motion: Motion, spreads: tuple[Spread, ...], resting: World, models: Models, rows: FloatArray
) -> list[Tried]:
    """Try the motion in the world of each row."""
    lot = []
    for row in map(np.ndarray.tolist, rows):
        world, payload = resting, payload_of(resting, spreads, row)
        if payload is not None:
            world = replace(world, payload=payload, models=models.told(payload))
        lot.append(tried(judge(varied(world, spreads, row), motion)))
    return lot
