"""The figures of README.md: taken from bench/results.json, so that no page contradicts another."""

from __future__ import annotations

import math
import re
import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from bench.plant_tables import first_table

BLOCK = re.compile(r"(<!-- figures: [^>]* -->\n).*?(<!-- end of figures -->)", re.DOTALL)
EXPERIMENTS = {"real_leads": "the real robot leads", "twin_leads": "the twin leads"}


def with_figures(text: str, content: Mapping[str, Any]) -> str:
    """Return the README with its block of figures written anew.

    Args:
        text: README.md, with one block between the two comments.
        content: As in results.json.

    Raises:
        ValueError: The block is missing, or there are several.
    """
    demos = [*_demos(content["demos"]), ""] if "demos" in content else []
    virtual = [*_virtual(content["virtual"]), ""] if "virtual" in content else []
    plants = [*first_table(content["plants"]), ""] if "plants" in content else []
    block = "\n".join([*demos, *plants, *virtual, *_rows(content["rows"])]) + "\n"
    replaced, count = BLOCK.subn(lambda found: found[1] + block + found[2], text)
    if count != 1:
        raise ValueError(f"README.md has {count} blocks of figures, expected 1")
    return replaced


def _demos(series: Sequence[Mapping[str, Any]]) -> list[str]:
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
            path = [run["path_percent"] for run in runs]
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


def _virtual(baseline: Mapping[str, Any]) -> list[str]:
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


def _rows(rows: list[Mapping[str, Any]]) -> list[str]:
    """Return the rows of the benchmark that a first reader wants to know."""
    row = {entry["id"]: entry for entry in rows}
    if not {"tracking", "simulation", "state_age"} <= set(row):
        return []
    tracking, simulation, age = row["tracking"], row["simulation"], row["state_age"]
    beside = {figure["what"]: figure["value"] for figure in simulation["beside"]}
    medians = {figure["what"]: figure["value"] for figure in age["beside"]}
    return [
        f"- **Twin alone, planned moves at full speed**: {tracking['ours']:.4f} mm off its set "
        f"point with computed torque, {tracking['baseline']:.1f} mm with the article's plain PID "
        f"({tracking['date']}).",
        f"- **Simulation as fast as possible**: {beside['times real time']:.0f} times real time "
        f"({simulation['date']}).",
        f"- **From the robot's position to the simulator's set point**: median "
        f"{medians['median, ours']:.1f} ms, 99 of 100 within {age['ours']:.1f} ms; up to 2 ms of "
        f"it are the robot's own latching ({age['date']}).",
    ]
