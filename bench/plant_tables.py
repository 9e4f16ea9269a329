"""Tables of the experiments on robots that were made different, from results.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SPEEDS = {50.0: "article's moves", 100.0: "long moves"}
ARTICLE_PATH, ARTICLE_REST = 5.0, 2.0
WORDS = {"real_leads": "real leads", "twin_leads": "twin leads"}
LABEL = (
    "Percent of reach, in virtual time: real core, stand-in and simulator in one process that is "
    "never late; the first move included, lag not removed. In brackets: what the leader's fastest "
    "joint reached, in percent of its largest speed; a twin that leads is held to 76 %."
)
SHOWN = {"as it is": "ideal", "field plant": "field"}
"""Variants of README.md, and their plants."""


def tables(measured: Mapping[str, Any]) -> list[str]:
    """Return the section of docs/benchmarks.md: Markdown lines.

    Args:
        measured: ``plants`` of results.json.
    """
    trials = measured["trials"]
    lines = ["## Robots that were made different", ""]
    for robot in dict.fromkeys(trial["robot"] for trial in trials):
        lines += [f"{robot}: path error max (at that speed), lag of the follower; at rest.", ""]
        lines += [f"| robot | {_columns()} |", "|---|" + "---|" * (len(SPEEDS) * len(WORDS))]
        of_it = [trial for trial in trials if trial["robot"] == robot]
        for variant in dict.fromkeys(trial["variant"] for trial in of_it):
            cells = [_cell(of_it, variant, leader, v) for v in SPEEDS for leader in WORDS]
            lines.append(f"| {variant} | {' | '.join(cells)} |")
        lines.append("")
    return [
        *lines,
        f"{LABEL} Each variant but the last changes one thing of the ideal plant. "
        f"{measured['date']}, commit {measured['commit']}; `./cell bench --plants`.",
        "",
    ]


def _columns() -> str:
    return " | ".join(f"{WORDS[name]}, {moves}" for moves in SPEEDS.values() for name in WORDS)


def _cell(trials: Sequence[Mapping[str, Any]], variant: str, leader: str, speed: float) -> str:
    for trial in trials:
        if (trial["variant"], trial["leader"], trial["speed_percent"]) == (variant, leader, speed):
            if trial["ended"]:
                return f"**ended** ({trial['ended'].partition(':')[0]})"
            bad = trial["path_percent"] > ARTICLE_PATH
            path = f"{trial['path_percent']:.2f} %"
            return (
                f"{f'**{path}**' if bad else path} ({trial['fastest_percent']:.0f} %), "
                f"{abs(trial['lag_ms']):.0f} ms; {trial['rest_percent']:.3f} %"
            )
    return "-"


def first_table(measured: Mapping[str, Any]) -> list[str]:
    """Return the table of README.md: both plants of each robot, at both speeds."""
    lines = [
        "| robot, plant | " + _columns() + " |",
        "|---|" + "---|" * (len(SPEEDS) * len(WORDS)),
        "| the article | " + " | ".join(["up to 5 %; 2 %"] * (len(SPEEDS) * len(WORDS))) + " |",
    ]
    trials = measured["trials"]
    for robot in dict.fromkeys(trial["robot"] for trial in trials):
        of_it = [trial for trial in trials if trial["robot"] == robot]
        for variant, plant in SHOWN.items():
            cells = [_cell(of_it, variant, leader, v) for v in SPEEDS for leader in WORDS]
            lines.append(f"| {robot}, {plant} | {' | '.join(cells)} |")
    return [
        *lines,
        "",
        "Largest distance of both tools at the same instant (speed), the follower's lag; the "
        f"largest distance at rest. {LABEL} "
        f"{measured['date']}, commit {measured['commit']}.",
    ]
