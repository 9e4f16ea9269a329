"""SCARAs of random sizes, from ``doctor new`` to both experiments in virtual time, unedited."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from itertools import product
from typing import Any

from harness.any_scara import MADE, any_size, made_scara
from harness.faults.rows import Row
from harness.plants.trials import Trial, run_trial
from harness.plants.variants import Variant
from rich.console import Console

from bench import page
from bench.draw_table import LEADS, SPEEDS
from bench.draws import rows_of, words_of

PLANTS = ("ideal", "field")
PLANNED = tuple(product(PLANTS, LEADS, SPEEDS))


def run(count: int, first: int, console: Console) -> list[Row]:
    """Make SCARAs and run the experiments on each, on both plants.

    Args:
        count: So many.
        first: The first seed.
        console: For progress.

    Returns:
        Medians and worst figures against their goals; a trial without figures has an infinite one.
    """
    load, trials = os.getloadavg()[0], []
    seeds = range(first, first + count)
    with ProcessPoolExecutor() as pool:
        for seed, made in zip(seeds, pool.map(_tried, seeds)):
            console.print(f"seed {seed}: {any_size(seed)}", markup=False, soft_wrap=True)
            for (plant, (words, _, _), _), trial in zip(PLANNED, made):
                console.print(f"  {words_of(trial)}", markup=False, soft_wrap=True)
                told: Mapping[str, Any] = {"robot": f"SCARAs, {plant}", "column": words}
                trials.append({**asdict(trial), **told, "seed": seed})
    measured = page.measured({"trials": trials, "first": first, "count": count}, load)
    page.write({**page.so_far(), "scaras": measured})
    return rows_of(measured, [f"SCARAs, {plant}" for plant in PLANTS])


def _tried(seed: int) -> list[Trial]:
    """Make the SCARA of a seed and run all its experiments."""
    with made_scara(seed) as folder:
        return [
            run_trial(
                MADE,
                Variant(f"seed {seed}, {plant}, {words}", plant=plant, kit=kit),
                leader,
                speed,
                folder=folder,
            )
            for plant, (words, leader, kit), speed in PLANNED
        ]
