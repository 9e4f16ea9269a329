"""Measure the second world: what is missed, how exact it is, how long it takes.

Each part is measured by itself, kept in results.json and shown in bench/tables.txt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from harness.faults.rows import Row
from rich.console import Console

from bench import page
from bench.second_world import (
    beside,
    chances,
    clearance,
    cycles,
    doors,
    programs,
    speed,
    wire,
)
from bench.second_world.figure import Figure

PARTS: dict[str, Callable[[int, Path, Console], list[Figure]]] = {
    "programs": programs.measure,
    "clearance": clearance.measure,
    "wire": wire.measure,
    "doors": doors.measure,
    "cycles": cycles.measure,
    **{f"chance_{what}": partial(chances.measure, what) for what in chances.CASES},
    "speed": speed.measure,
    "beside": beside.measure,
}
"""In the order of the page; the last two need a machine that does nothing else."""


def run(count: int, wanted: Sequence[str], folder: Path, console: Console) -> list[Row]:
    """Measure parts, keep the figures and write the pages, after each part anew.

    Args:
        count: Of programs, poses, refused commands or worlds.
        wanted: Some of PARTS: the others stay as they were measured last; all if empty.
        folder: Gets what was judged wrongly, as text.
        console: For progress.
    """
    return page.measure_parts("what_if", PARTS, wanted, count, folder, console)
