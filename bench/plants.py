"""The article's experiments on robots that were made different, in virtual time: a table."""

from __future__ import annotations

import os
from dataclasses import asdict
from pathlib import Path

from harness.faults.rows import Row
from harness.plants.trials import LEADERS, Trial, run_trial
from harness.plants.variants import FIELD, IDEAL, VARIANTS, Variant
from rich.console import Console

from bench import page
from bench.plant_tables import ARTICLE_PATH, ARTICLE_REST, SPEEDS, WORDS
from bench.record import or_infinite

ROBOTS = ("fanuc_sr6ia", "fanuc_sr3ia", "articulated_six")


def run(folder: Path, console: Console) -> list[Row]:
    """Run every variant on the article's robot, and both plants on the others.

    The figures go into results.json, bench/tables.txt and docs/benchmarks.md.

    Args:
        folder: Of the campaign; nothing is left in it.
        console: For progress.

    Returns:
        Each path and positioning error against the article's; a trial that came to no figures has
        an infinite one.
    """
    load, trials = os.getloadavg()[0], []
    for robot, variant, leader, speed in _planned():
        trials.append(run_trial(robot, variant, leader, speed))
        console.print(_words(trials[-1]), markup=False, soft_wrap=True)
    content = page.so_far()
    page.write(
        {**content, "plants": page.measured({"trials": [asdict(trial) for trial in trials]}, load)}
    )
    return [row for trial in trials for row in _rows(trial)]


def _planned() -> list[tuple[str, Variant, str, float]]:
    chosen = [(ROBOTS[0], variant) for variant in VARIANTS]
    chosen += [(robot, variant) for robot in ROBOTS[1:] for variant in (IDEAL, FIELD)]
    return [
        (robot, variant, leader, speed)
        for speed in SPEEDS
        for robot, variant in chosen
        for leader in LEADERS
    ]


def _words(trial: Trial) -> str:
    figures = (
        f"path {trial.path_percent} % at {trial.fastest_percent} % speed, lag {trial.lag_ms} ms, "
        f"at rest {trial.rest_percent} %"
    )
    return (
        f"{trial.robot}, {trial.variant}, {WORDS[trial.leader]}, {trial.speed_percent:g} %: "
        f"{trial.ended or figures}"
    )


def _rows(trial: Trial) -> list[Row]:
    case = f"{trial.robot}, {trial.variant}, {trial.speed_percent:g} %: {WORDS[trial.leader]}"
    return [
        Row(case, what, limit, or_infinite(None if trial.ended else figure))
        for what, limit, figure in (
            ("path error max [% of reach]", ARTICLE_PATH, trial.path_percent),
            ("positioning error max [% of reach]", ARTICLE_REST, trial.rest_percent),
        )
    ]
