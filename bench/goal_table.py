"""What the two plants shall reach, and what was measured: live demos, virtual time, rows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bench.plant_tables import SHOWN, WORDS
from bench.record import or_infinite

RUNS = 20
"""So many demos say what the worst is."""
SYNC_RATIOS = {"sync_error": 0.02, "sync_error_slow": 0.12}
"""Goals of these rows: our error is at most such a part of that of a twin which holds the newest
value. The rows take them from here: a figure has one goal."""


@dataclass(frozen=True)
class Found:
    """The largest figure of a group, and where it was found; infinite where one came to none."""

    figure: float
    where: str


@dataclass(frozen=True)
class Wanted:
    """One line of the table.

    Attributes:
        words: What is measured.
        unit: Of goal and figure.
        goals: By plant.
        found: By plant; a plant without a figure has none.
    """

    words: str
    unit: str
    goals: Mapping[str, float]
    found: Mapping[str, Found]


def goal_table(content: Mapping[str, Any]) -> list[str]:
    """Return the table of the plants' goals: Markdown lines; none without figures.

    Args:
        content: As in results.json.
    """
    lines = [_line(wanted) for wanted in _wanted(content) if wanted.found]
    if not lines:
        return []
    return [
        "| largest of all | goal, ideal | measured | goal, field | measured |",
        "|---|---|---|---|---|",
        *lines,
        "",
        "Path: the largest distance of both tools at one instant, first move included, lag not "
        "removed, three robots, 50 and 100 %, in virtual time. Demos are live, on robots drawn "
        "anew. 0 false leaders, stops and pauses in ten minutes at rest and in 200 moves.",
        "",
    ]


def _wanted(content: Mapping[str, Any]) -> list[Wanted]:
    trials = content.get("plants", {}).get("trials", ())
    demos, rows = content.get("demos", ()), content.get("rows", ())
    paths = [
        Wanted(f"path, {words}", "%", goals, _largest(_trials(trials, leader)))
        for (leader, words), goals in zip(
            WORDS.items(), ({"ideal": 0.3, "field": 1.0}, {"ideal": 0.5, "field": 2.5}), strict=True
        )
    ]
    at_rest = {"ideal": 0.02, "field": 0.2}
    return [
        *paths,
        Wanted("at rest, of what the robot was told", "%", at_rest, _largest(_rests(trials))),
        Wanted(
            "demo, at rest against the true geometry",
            "%",
            {"field": at_rest["field"]},
            _largest(_runs(demos, "true_percent")),
        ),
        Wanted(
            f"demo, path, worst of {RUNS}",
            "%",
            {"field": 5.0},
            _largest(_runs(demos, "path_percent")),
        ),
        *(
            Wanted(name, "", {"ideal": limit}, _largest(_ratio(rows, name)))
            for name, limit in SYNC_RATIOS.items()
        ),
    ]


def _line(wanted: Wanted) -> str:
    cells = [wanted.words]
    unit = f" {wanted.unit}".rstrip()
    for plant in ("ideal", "field"):
        goal, found = wanted.goals.get(plant), wanted.found.get(plant)
        cells.append("" if goal is None else f"{goal:g}{unit}")
        if found is None or goal is None:
            cells.append("" if goal is None else "not measured")
        else:
            figure = f"{found.figure:.2g}{unit}" if math.isfinite(found.figure) else "no figure"
            text = f"{figure} ({found.where})"
            cells.append(text if found.figure <= goal else f"**{text}**")
    return f"| {' | '.join(cells)} |"


def _largest(figures: Iterable[tuple[str, Found]]) -> dict[str, Found]:
    """Return the largest of each plant."""
    found: dict[str, Found] = {}
    for plant, one in figures:
        if plant not in found or one.figure > found[plant].figure:
            found[plant] = one
    return found


def _trials(trials: Sequence[Mapping[str, Any]], leader: str) -> list[tuple[str, Found]]:
    return [
        (SHOWN[t["variant"]], _found(t, "path_percent"))
        for t in trials
        if t["variant"] in SHOWN and t["leader"] == leader
    ]


def _rests(trials: Sequence[Mapping[str, Any]]) -> list[tuple[str, Found]]:
    return [
        (SHOWN[t["variant"]], _found(t, "rest_percent")) for t in trials if t["variant"] in SHOWN
    ]


def _found(trial: Mapping[str, Any], key: str) -> Found:
    """Return a figure of a trial; one that ended is worse than any that did not."""
    where = f"{trial['robot']}, {trial['speed_percent']:g} %"
    if trial["ended"]:
        return Found(math.inf, f"{where}: ended")
    return Found(or_infinite(trial[key]), where)


def _runs(demos: Sequence[Mapping[str, Any]], key: str) -> list[tuple[str, Found]]:
    """Return a figure of all demos of a series that has as many as are wanted."""
    found = []
    for series in demos:
        plant = "field" if "drawn" in series["series"] else "ideal"
        runs, failed = series["runs"], series["failed"]
        if len(runs) + failed < RUNS:
            continue
        if failed:
            told = f"{failed} of {len(runs) + failed} ended without a report"
            found.append((plant, Found(math.inf, told)))
        for run in runs:
            for leader, words in WORDS.items():
                figure = run.get(leader, {}).get(key)
                where = f"{words}, {series['asked_percent']:g} %"
                found.append((plant, Found(or_infinite(figure), where)))
    return found


def _ratio(rows: Sequence[Mapping[str, Any]], name: str) -> list[tuple[str, Found]]:
    return [
        ("ideal", Found(row["ratio"], row["date"]))
        for row in rows
        if row["id"] == name and row["ratio"] is not None
    ]
