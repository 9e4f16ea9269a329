"""SCARAs of random sizes, from ``doctor new`` to both experiments in virtual time, unedited."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from itertools import product

from harness.any_scara import MADE, any_size, made_scara
from harness.faults.rows import Row
from harness.plants.trials import Trial, run_trial
from harness.plants.variants import Variant
from rich.console import Console

from bench.draw_table import LEADS, SPEEDS
from bench.draws import rows_of, words_of

PLANTS = ("ideal", "field")
PLANNED = tuple(product(PLANTS, LEADS))
SPEED = SPEEDS[0]


def run(count: int, first: int, console: Console) -> list[Row]:
    """Make SCARAs and run the experiments on each, on both plants.

    Args:
        count: So many.
        first: The first seed.
        console: For progress.

    Returns:
        Medians and worst figures against their goals; a trial without figures has an infinite one.
    """
    seeds, found = range(first, first + count), []
    robots = {plant: f"{count} SCARAs, {plant}" for plant in PLANTS}
    with ProcessPoolExecutor() as pool:
        for seed, trials in zip(seeds, pool.map(_tried, seeds)):
            console.print(f"seed {seed}: {any_size(seed)}", markup=False, soft_wrap=True)
            for (plant, (words, _, _)), trial in zip(PLANNED, trials):
                console.print(f"  {words_of(trial)}", markup=False, soft_wrap=True)
                found.append({**asdict(trial), "robot": robots[plant], "column": words})
    return rows_of({"trials": found}, list(robots.values()), (SPEED,))


def _tried(seed: int) -> list[Trial]:
    """Make the SCARA of a seed and run all its experiments."""
    with made_scara(seed) as folder:
        return [
            run_trial(
                MADE,
                Variant(f"seed {seed}, {plant}, {words}", plant=plant, kit=kit),
                leader,
                SPEED,
                folder=folder,
            )
            for plant, (words, leader, kit) in PLANNED
        ]
