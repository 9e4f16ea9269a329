"""Measure the farm: many cells, what is lost and when, what people wait for.

Each part is measured by itself, kept in results.json and shown in bench/tables.txt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from harness.faults.rows import Row
from rich.console import Console

from bench import page
from bench.many_cells import (
    commands,
    frozen,
    jobs,
    load,
    machines,
    month,
    pages,
    presence,
    restarts,
)
from bench.second_world.figure import Figure

PARTS: dict[str, Callable[[float, Path, Console], list[Figure]]] = {
    "many": load.measure_many,
    "crowd": load.measure_crowd,
    "seen": presence.measure_seen,
    "calm": presence.measure_calm,
    "frozen": frozen.measure,
    "restarts": restarts.measure,
    "stop": commands.measure_page,
    "wrong": commands.measure_wrong,
    "month": month.measure,
    "pages": pages.measure,
    "jobs": jobs.measure,
    "machines": machines.measure,
}
"""In the order of the page; all but ``wrong`` need a machine that does nothing else."""


def run(share: float, wanted: Sequence[str], folder: Path, console: Console) -> list[Row]:
    """Measure parts; keep the figures and write the pages, after each part anew.

    Args:
        share: Of the whole length; what is shorter than the whole is shown and not kept.
        wanted: Some of PARTS: the others stay as they were measured last; all if empty.
        folder: For the parts' files.
        console: For progress.
    """
    return page.measure_parts("farm", PARTS, wanted, share, folder, console)
