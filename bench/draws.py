"""Robots of the field plant's kind, drawn by seeds, in virtual time: median and worst of all."""

from __future__ import annotations

import os
import statistics
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from itertools import product
from typing import Any

from harness.faults.rows import Row
from harness.plants.trials import Trial, run_trial
from harness.plants.variants import drawn
from rich.console import Console

from bench import page
from bench.draw_table import LEADS, REST_PERCENT, SPEEDS, figures, goals_of
from bench.plants import ROBOTS


def run(count: int, first: int, console: Console) -> list[Row]:
    """Draw robots and run the article's experiments on each.

    Args:
        count: So many of each kind of robot.
        first: The first seed.
        console: For progress.

    Returns:
        Medians and worst figures against their goals; a trial without figures has an infinite one.
    """
    load, trials = os.getloadavg()[0], []
    planned = list(product(ROBOTS, range(first, first + count), LEADS, SPEEDS))
    # Virtual time is the same beside others: each core takes a trial.
    with ProcessPoolExecutor() as pool:
        for (_, seed, (words, _, _), _), trial in zip(planned, pool.map(_tried, planned)):
            trials.append({**asdict(trial), "column": words, "seed": seed})
            console.print(words_of(trial), markup=False, soft_wrap=True)
    measured = page.measured({"trials": trials, "first": first, "count": count}, load)
    page.write({**page.so_far(), "draws": measured})
    return rows_of(measured, ROBOTS)


def _tried(planned: tuple[str, int, tuple[str, str, bool], float]) -> Trial:
    robot, seed, (_, leader, kit), speed = planned
    return run_trial(robot, drawn(seed, kit), leader, speed)


def words_of(trial: Trial) -> str:
    """Return what came of a trial, in a line."""
    said = f"path {trial.path_percent} %, at rest {trial.rest_percent} %, {trial.seconds} s"
    return (
        f"{trial.robot}, {trial.variant}, {trial.leader}, {trial.speed_percent:g} %: "
        f"{trial.ended or said}"
    )


def rows_of(measured: Mapping[str, Any], robots: Sequence[str]) -> list[Row]:
    """Return median and worst of the trials against their goals: of each robot, column and speed.

    Args:
        measured: Trials, each with what it is counted to: its ``robot`` and its ``column``.
        robots: Those that count.
    """
    rows = []
    for robot in robots:
        rests = []
        for words, _, _ in LEADS:
            for speed, (median, worst) in zip(SPEEDS, goals_of(words)):
                found = figures(measured, robot, words, speed, "path_percent")
                rests += figures(measured, robot, words, speed, "rest_percent")
                case = f"{robot}, {words}, {speed:g} %"
                rows.append(Row(case, "path, median", median, statistics.median(found)))
                rows.append(Row(case, "path, worst", worst, max(found)))
        rows.append(Row(robot, "at rest, worst", REST_PERCENT, max(rests)))
    return rows
