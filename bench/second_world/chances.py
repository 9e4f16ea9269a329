"""The stated probability of a collision against what MuJoCo finds in other worlds."""

from __future__ import annotations

import os
from pathlib import Path

from harness.second_world.campaign import SCARA, benches
from rich.console import Console
from what_if.uncertainty.many_worlds_io import chances

from bench.second_world.figure import Figure
from bench.second_world.frequency import hits, near

CONFIG = Path(__file__).resolve().parents[2] / "config"
SEED, STATED, OTHER = 5, 1, 2
CASES = {
    "part": (tuple(f"part_{k}" for k in range(1, 10)), 0.2e-3),
    "pallet": (("pallet",), 0.4e-3),
    "person": ((), 0.03),
}
"""What a motion ends near to, its links, and how near [m]."""


def measure(what: str, count: int, folder: Path, console: Console) -> list[Figure]:
    """State a probability from ``count`` worlds for one case, and count in as many others."""
    links, clearance = CASES[what]
    with benches(CONFIG, SEED) as known:
        case = near(known[SCARA], links, clearance, what == "person")
    stated = chances(case.world, case.motion, count, STATED, directory=CONFIG)
    seen = hits(case, count, OTHER, len(os.sched_getaffinity(0))) / count
    note = (
        f"stated {100.0 * stated.collision:.1f} % ({100.0 * stated.collision_low:.1f} to "
        f"{100.0 * stated.collision_high:.1f}), in {count} others {100.0 * seen:.1f} %"
    )
    console.print(f"{what}: {note}")
    apart = 100.0 * abs(stated.collision - seen)
    return [Figure(f"chance of hitting a {what}", "points", 2.0, apart, note=note)]
