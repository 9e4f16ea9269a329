"""SCARAs of random sizes, from ``doctor new`` to both experiments in virtual time, unedited."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor

from harness.any_scara import MADE, any_size, made_scara
from harness.faults.rows import Row
from harness.plants.trials import Trial, run_trial
from harness.plants.variants import Variant
from rich.console import Console

from bench.draw_table import LEADS, REST_PERCENT, SPEEDS, goals_of

PLANTS = ("ideal", "field")
SPEED = SPEEDS[0]
Tried = dict[tuple[str, str], Trial]
"""By plant, and by what a column of draw_table.py is called."""


def run(count: int, first: int, console: Console) -> list[Row]:
    """Make SCARAs and run the experiments on each, on both plants.

    Args:
        count: So many.
        first: The first seed.
        console: For progress.

    Returns:
        Medians and worst figures against their goals; a trial without figures has an infinite one.
    """
    seeds, tried = range(first, first + count), []
    with ProcessPoolExecutor() as pool:
        for seed, trials in zip(seeds, pool.map(trials_of, seeds)):
            tried.append(trials)
            console.print(f"seed {seed}: {any_size(seed)}", markup=False, soft_wrap=True)
            for (plant, words), trial in trials.items():
                said = f"path {trial.path_percent} %, at rest {trial.rest_percent} %"
                console.print(f"  {plant}, {words}: {trial.ended or said}", markup=False)
    return list(rows_of(tried))


def trials_of(seed: int) -> Tried:
    """Make the SCARA of a seed and run all its experiments."""
    with made_scara(seed) as folder:
        return {
            (plant, words): run_trial(
                MADE,
                Variant(f"SCARA {seed}, {plant}", plant=plant, kit=kit),
                leader,
                SPEED,
                folder=folder,
            )
            for plant in PLANTS
            for words, leader, kit in LEADS
        }


def rows_of(tried: Sequence[Tried]) -> Iterator[Row]:
    """Yield median and worst of all trials against their goals."""
    for plant in PLANTS:
        rests = []
        for words, _, _ in LEADS:
            trials = [each[plant, words] for each in tried]
            paths = [_figure(trial.path_percent) for trial in trials]
            rests += [_figure(trial.rest_percent) for trial in trials]
            median, worst = goals_of(words)[SPEEDS.index(SPEED)]
            case = f"{len(tried)} SCARAs, {plant}, {words}, {SPEED:g} %"
            yield Row(case, "path, median", median, statistics.median(paths))
            yield Row(case, "path, worst", worst, max(paths))
        yield Row(f"{len(tried)} SCARAs, {plant}", "at rest, worst", REST_PERCENT, max(rests))


def _figure(percent: float | None) -> float:
    return float("inf") if percent is None else percent
