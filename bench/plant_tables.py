"""Tables of the experiments on robots that were made different, from results.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

SPEEDS = {50.0: "article's moves", 100.0: "long moves"}
ARTICLE_PATH, ARTICLE_REST = 5.0, 2.0
WORDS = {"real_leads": "real leads", "twin_leads": "twin leads"}
MADE = (
    "In virtual time: real core, stand-in and simulator in one process that is never late, and "
    "asks the robot as often as its link would; the first move included, lag not removed."
)
LABEL = (
    f"Percent of reach. {MADE} In brackets: what the leader's fastest "
    "joint reached, in percent of its largest speed; a twin that leads is held to 76 %."
)
SHOWN = {"as it is": "ideal", "field plant": "field"}
"""Variants of the short table, and their plants."""


def tables(measured: Mapping[str, Any]) -> list[str]:
    """Return the section of bench/tables.txt: Markdown lines.

    Args:
        measured: ``plants`` of results.json.
    """
    trials = measured["trials"]
    lines = ["## Robots that were made different", "", *first_table(measured), ""]
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
    trial = _found(trials, variant, leader, speed)
    if trial is None or trial["ended"]:
        return _short(trial)
    lag, rest = trial["lag_ms"], trial["rest_percent"]
    told = f"{_short(trial)} ({trial['fastest_percent']:.0f} %), "
    told += "-" if lag is None else f"{abs(lag):.0f} ms"
    return f"{told}; {_rest([rest])}"


def _rest(found: Sequence[float | None]) -> str:
    """Return the largest error at rest; of one that is not known nothing is known of all."""
    known = [each for each in found if each is not None]
    return f"{max(known):.3f} %" if known and len(known) == len(found) else "-"


def _found(
    trials: Sequence[Mapping[str, Any]], variant: str, leader: str, speed: float
) -> Mapping[str, Any] | None:
    """Return one trial, None if it was not made."""
    wanted = (variant, leader, speed)
    made = (t for t in trials if (t["variant"], t["leader"], t["speed_percent"]) == wanted)
    return next(made, None)


def _short(trial: Mapping[str, Any] | None) -> str:
    """Return a trial's path error, bold beyond the article's limit."""
    if trial is None:
        return "-"
    if trial["ended"]:
        return f"**ended** ({trial['ended'].partition(':')[0]})"
    path = f"{trial['path_percent']:.2f} %"
    return f"**{path}**" if trial["path_percent"] > ARTICLE_PATH else path


def first_table(measured: Mapping[str, Any]) -> list[str]:
    """Return the short table: both plants of each robot, one figure in each cell."""
    heads = [f"{words}, {moves}" for moves in SPEEDS.values() for words in WORDS.values()]
    lines = [
        "| robot, stand-in | " + " | ".join([*heads, "at rest"]) + " |",
        "|---|" + "---|" * (len(heads) + 1),
        "| the article | " + " | ".join(["up to 5 %"] * len(heads)) + " | 2 % |",
    ]
    trials = measured["trials"]
    for robot in dict.fromkeys(trial["robot"] for trial in trials):
        of_it = [trial for trial in trials if trial["robot"] == robot]
        for variant, plant in SHOWN.items():
            tried = [_found(of_it, variant, leader, v) for v in SPEEDS for leader in WORDS]
            rests = [one["rest_percent"] for one in tried if one and not one["ended"]]
            cells = [*map(_short, tried), _rest(rests)]
            lines.append(f"| {robot}, {plant} | {' | '.join(cells)} |")
    return [
        *lines,
        "",
        "Largest distance of both tools at the same instant, in percent of the robot's reach; the "
        f"largest of all at rest. {MADE} In long moves a real robot that leads reaches its largest "
        "speed, a twin that leads 76 % of it, where it is held. "
        f"{measured['date']}, commit {measured['commit']}.",
    ]
