"""The table of robots that were drawn by seeds, from results.json: median and worst of all."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from bench.plant_tables import MADE
from bench.record import or_infinite

LEADS = (
    ("real leads", "real_leads", True),
    ("twin leads, PR[1] alone", "twin_leads", True),
    ("twin leads, ring", "twin_leads", False),
)
"""What a column is called, who leads, and whether the robot has the kit's map."""
SPEEDS = (50.0, 100.0)
MEDIANS = {"real leads": (0.8, 1.5), "twin leads, PR[1] alone": (1.0, 1.5)}
WORST = {"real leads": (1.5, 2.5), "twin leads, PR[1] alone": (2.0, 2.5)}
RING_MEDIANS, RING_WORST = (0.5, 1.0), (1.0, 2.0)
REST_PERCENT = 0.06


def goals_of(words: str) -> list[tuple[float, float]]:
    """Return median and worst that a column shall reach at each of ``SPEEDS`` [percent]."""
    return list(zip(MEDIANS.get(words, RING_MEDIANS), WORST.get(words, RING_WORST)))


def figures(
    measured: Mapping[str, Any], robot: str, words: str, speed: float, key: str
) -> list[float]:
    """Return a figure of all draws; infinite for a trial that came to none."""
    return [
        or_infinite(None if trial["ended"] else trial[key])
        for trial in measured["trials"]
        if (trial["robot"], trial["column"], trial["speed_percent"]) == (robot, words, speed)
    ]


def spread(found: Sequence[float], unit: str = "") -> str:
    """Tell the median of all draws, the worst of those that came to an end, and how many did not.

    Args:
        found: A figure of each; infinite for one that came to none.
        unit: Stands behind them.
    """
    ended = [value for value in found if math.isfinite(value)]
    left = len(found) - len(ended)
    told = f"{statistics.median(found):.2f} / {max(ended, default=math.nan):.2f}{unit}"
    return f"{told} and {left} that did not end" if left else told


def draw_table(measured: Mapping[str, Any], made: Mapping[str, Any] | None = None) -> list[str]:
    """Return the table: Markdown lines.

    Args:
        measured: ``draws`` of results.json.
        made: ``scaras`` of it, if they were measured.
    """
    heads = [f"{words}, {speed:g} %" for words, _, _ in LEADS for speed in SPEEDS]
    goals = [f"{a:g} / {b:g}" for words, _, _ in LEADS for a, b in goals_of(words)]
    lines = [
        "| robot | " + " | ".join(heads) + " |",
        "|---|" + "---|" * len(heads),
        "| goal | " + " | ".join(goals) + " |",
    ]
    for each in filter(None, (measured, made)):
        for robot in dict.fromkeys(trial["robot"] for trial in each["trials"]):
            cells = [
                spread(figures(each, robot, words, speed, "path_percent"))
                for words, _, _ in LEADS
                for speed in SPEEDS
            ]
            lines.append(f"| {robot} | {' | '.join(cells)} |")
    count, first = measured["count"], measured["first"]
    others = []
    if made is not None:
        others = [
            "",
            f"SCARAs: {made['count']} of random sizes, three or four axes, as `doctor new` makes "
            f"them from seed {made['first']} on. {made['date']}, "
            f"commit {made['commit']}; `./cell bench --plants --scaras {made['count']}`.",
        ]
    return [
        *lines,
        "",
        f"Path error in percent of reach, median / worst of {count} robots drawn by the seeds "
        f"{first} to {first + count - 1}: each number of the field plant within 30 %, readings "
        f"each 4 to 16 ms, interpolation each 4 to 12 ms. {MADE} At 50 % the article's moves, at "
        "100 % long ones. Real leads and PR[1] alone: the map that the kit's sheets make. "
        f"{measured['date']}, commit {measured['commit']}; `./cell bench --plants --draws {count} "
        f"--first {first}`.",
        *others,
    ]
