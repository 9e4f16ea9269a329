"""Write the labelled runs: how long it takes, how large they are, and their digest."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from rich.console import Console
from twin_analysis.health.dataset_io import RUNS, SIGNALS, write_dataset

from bench.second_world.figure import Figure
from bench.wear.found import OURS, ROBOTS, WORKERS

COUNT, SEED = 1000, 1
GOAL_S, GOAL_MB = 1200.0, 150.0
"""Our choice."""


def measure(robots: int, first: int, console: Console) -> list[Figure]:
    """Return time and size; the note has the digest.

    Args:
        robots: Not asked: it is always the data set that its page names.
        first: Nor this.
        console: Hears the digest.
    """
    begin = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        digest = write_dataset(folder, COUNT, SEED, WORKERS, ROBOTS / OURS)
        seconds = time.monotonic() - begin
        size = sum((folder / file).stat().st_size for file in (RUNS, SIGNALS)) / 1e6
    console.print(f"runs: {digest}")
    what = f"{COUNT} labelled runs of seed {SEED}"
    return [
        Figure(what, "s", GOAL_S, seconds, note=f"{WORKERS} workers"),
        Figure(what, "MB", GOAL_MB, size, note=f"SHA-256 of both tables `{digest}`"),
    ]
