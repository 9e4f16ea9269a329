"""The stated probability of a collision against what MuJoCo finds in other worlds."""

from __future__ import annotations

import os
from pathlib import Path

from harness.second_world.campaign import SCARA, benches
from harness.second_world.frequency import hits, near
from rich.console import Console
from what_if.io.many_worlds import chances

from bench.second_world.figure import Figure

CONFIG = Path(__file__).resolve().parents[2] / "config"
SEED, STATED, OTHER = 5, 1, 2
PARTS = tuple(f"part_{k}" for k in range(1, 10))
CASES = (
    ("a part", PARTS, 0.2e-3, False),
    ("a part, further away", PARTS, 0.8e-3, False),
    ("the pallet", ("pallet",), 0.4e-3, False),
    ("a person", (), 0.03, True),
)
"""What a motion ends near to, and how near [m]."""


def measure(count: int, folder: Path, console: Console) -> list[Figure]:
    """State a probability from ``count`` worlds for each case, and count in as many others."""
    found = []
    with benches(CONFIG, SEED) as known:
        for name, links, clearance, person in CASES:
            case = near(known[SCARA], links, clearance, person)
            stated = chances(case.world, case.motion, count, STATED, directory=CONFIG)
            seen = hits(case, count, OTHER, len(os.sched_getaffinity(0))) / count
            note = (
                f"stated {100.0 * stated.collision:.1f} % ({100.0 * stated.collision_low:.1f} to "
                f"{100.0 * stated.collision_high:.1f}), in {count} others {100.0 * seen:.1f} %"
            )
            apart = 100.0 * abs(stated.collision - seen)
            found.append(Figure(f"chance of hitting {name}", "points", 2.0, apart, note=note))
            console.print(f"{name}: {note}")
    return found
