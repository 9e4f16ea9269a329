"""Measure the monitor of wear: what it finds, beside whom, and the labelled runs.

Each part is measured by itself, kept in results.json and shown in docs/operating/health.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from harness.faults.rows import Row
from rich.console import Console

from bench import page
from bench.second_world.figure import Figure
from bench.wear import baselines, found, runs

PARTS: dict[str, Callable[[int, int, Console], list[Figure]]] = {
    "wear": found.measure_wear,
    "robots": found.measure_robots,
    "varied": found.measure_varied,
    "several": found.measure_several,
    "baselines": baselines.measure,
    "runs": runs.measure,
}
"""In the order of the page."""


def run(robots: int, first: int, wanted: Sequence[str], console: Console) -> list[Row]:
    """Measure parts, keep the figures and write the pages, after each part anew.

    Args:
        robots: How many are drawn; a sixth of them for what varies.
        first: Seed of the first one.
        wanted: Some of PARTS: the others stay as they were measured last; all if empty.
        console: Hears what was missed.
    """
    return page.measure_parts("health", PARTS, wanted, robots, first or 1, console)
