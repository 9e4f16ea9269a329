"""Tables of the article's two experiments: live demos, and virtual time on all robots."""

from __future__ import annotations

import statistics
from collections.abc import Mapping
from typing import Any

EXPERIMENTS = {"real_leads": "the real robot leads", "twin_leads": "the twin leads"}


def demo_table(demos: Mapping[str, Any]) -> list[str]:
    """Return the table of the demo's experiments, and what it was measured on."""
    lines = [
        "| percent of reach | fastest joint | path error: median | worst | at rest: worst |",
        "|---|---|---|---|---|",
        "| the article | not said | 5 % at most | 5 % | 2 % |",
    ]
    for name, words in EXPERIMENTS.items():
        runs = [run[name] for run in demos["runs"] if name in run]
        path = [run["path_percent"] for run in runs]
        speed = max(run["speed_percent"] for run in runs)
        rest = max(run["positioning_percent"] for run in runs)
        lines.append(
            f"| {words} | {speed:.0f} % of its largest speed | {statistics.median(path):.2f} % "
            f"| {max(path):.2f} % | {rest:.4f} % |"
        )
    lost = f", {demos['failed']} more ended without a report" if demos["failed"] else ""
    return [
        *lines,
        "",
        f"{len(demos['runs'])} runs of `./cell demo` in a row{lost}; {demos['robot']}, "
        f"{demos['plant']}; {demos['date']}, commit {demos['commit']}, {demos['machine']}.",
    ]


def virtual_table(baseline: Mapping[str, Any]) -> list[str]:
    """Return the figures of a machine that is never late: the maths alone."""
    lines = ["| in virtual time | real leads | twin leads | at rest |", "|---|---|---|---|"]
    lines.append("| the article | up to 5 % of what is not said | up to 5 % | 2 % |")
    for robot, figures in baseline["figures"].items():
        path = [figures[name]["path_max_mm"] for name in EXPERIMENTS]
        rest = max(figures[name]["positioning_mm"] for name in EXPERIMENTS)
        lines.append(f"| {robot} | {path[0]:.2f} mm | {path[1]:.2f} mm | {rest:.3f} mm |")
    return [
        *lines,
        "",
        "Largest distance of both tools at the same instant in the article's two experiments, with "
        "the real core, stand-in and simulator in one process that is never late; ideal stand-in, "
        f"programs at 50 % of the joints' largest speed; {baseline['date']}, commit "
        f"{baseline['commit'][:7]}. A live cell on a machine that is late is worse: its error is "
        "the way of that time.",
    ]
