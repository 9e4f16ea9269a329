"""Tables of the article's two experiments: live demos, and virtual time on all robots."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from bench.record import or_infinite

EXPERIMENTS = {"real_leads": "the real robot leads", "twin_leads": "the twin leads"}


def demo_table(series: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the table of the demo's experiments, and what each row was measured on."""
    lines = [
        "| percent of reach | fastest joint | path error: median | 95 of 100 | worst "
        "| worst without pauses of the machine | at rest: worst | against its true geometry |",
        "|---|---|---|---|---|---|---|---|",
        "| the article | not said | 5 % at most | | 5 % | | 2 % | |",
    ]
    for demos in series:
        asked = f"{demos['plant'].split(':')[0]}, {demos['asked_percent']:g} % asked for"
        for name, words in EXPERIMENTS.items():
            runs = [run[name] for run in demos["runs"] if name in run]
            if not runs:
                ended = f"none of {demos['failed']} runs ended with a report"
                lines.append(f"| {asked}: {words} | {ended} | | | | | | |")
                continue
            # What could not be compared is worse than anything that was.
            path = [or_infinite(run["path_percent"]) for run in runs]
            speed = max(run["speed_percent"] for run in runs)
            cells = (
                f"{asked}: {words}",
                f"{speed:.0f} % of its largest speed",
                f"{statistics.median(path):.2f} %",
                f"{p95(path):.2f} %",
                f"{max(path):.2f} %",
                _worst(runs, "undisturbed_percent", 2),
                _worst(runs, "positioning_percent", 4),
                _worst(runs, "true_percent", 4),
            )
            lines.append(f"| {' | '.join(cells)} |")
    return [*lines, "", *(_measured_on(demos) for demos in series)]


def p95(values: Sequence[float]) -> float:
    """Return the smallest value that 95 of 100 do not exceed."""
    return sorted(values)[math.ceil(0.95 * len(values)) - 1]


def _worst(runs: Sequence[Mapping[str, Any]], key: str, digits: int) -> str:
    """Return the largest value of those runs that know it."""
    known = [run[key] for run in runs if run.get(key) is not None]
    return f"{max(known):.{digits}f} %" if known else "not known"


def _measured_on(demos: Mapping[str, Any]) -> str:
    """Say what one series was measured on: a label is part of a figure."""
    lost = f", {demos['failed']} more ended without a report" if demos["failed"] else ""
    asked, count = demos["asked_percent"], len(demos["runs"])
    return (
        f"- {asked:g} %: {count} runs of `./cell demo` in a row{lost}; {demos['robot']}, "
        f"{demos['plant']}; {demos['date']}, commit {demos['commit']}, {demos['machine']}."
    )


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
