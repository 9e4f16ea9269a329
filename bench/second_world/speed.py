"""How long a verdict takes, and how fast the simulated world is."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from rich.console import Console
from what_if.cell_files_io import find_program, resting_cell
from what_if.judging import judge
from what_if.motions import JointTarget, Motion, ProgramRun
from what_if.second_world_io import SecondWorld
from what_if.world import World

from bench.second_world.figure import Figure

CONFIG = Path(__file__).resolve().parents[2] / "config"
MOVES, PROGRAMS, RUNS = 200, 25, 5


def measure(count: int, folder: Path, console: Console) -> list[Figure]:
    """Judge random moves and ARTICLE, and make two programs in the simulated world."""
    with resting_cell(CONFIG) as (world, _):
        return [*_verdicts(world), *_physics(world)]


def _verdicts(world: World) -> list[Figure]:
    rng = np.random.default_rng(7)
    low, high = np.array([(j.lower, j.upper) for j in world.cell.robot.twin_joints]).T
    moves = [JointTarget(tuple(rng.uniform(low, high).tolist())) for _ in range(MOVES)]
    article = ProgramRun(find_program(world.cell, "ARTICLE", CONFIG))
    asked: list[tuple[str, float, list[Motion]]] = [
        ("verdict by geometry, a random move", 50.0, list(moves)),
        ("verdict by geometry, ARTICLE", 500.0, [article] * PROGRAMS),
    ]
    found = []
    for what, goal, motions in asked:
        taken = []
        for motion in motions:
            begin = time.perf_counter()
            judge(world, motion)
            taken.append(1e3 * (time.perf_counter() - begin))
        note = f"median of {len(taken)}; 95 of 100 within {np.percentile(taken, 95):.0f} ms"
        found.append(Figure(what, "ms", goal, float(np.median(taken)), note=note))
    return found


def _physics(world: World) -> list[Figure]:
    found = []
    with SecondWorld(world, CONFIG) as second:
        for name in ("ARTICLE", "PALLETISE"):
            motion = ProgramRun(find_program(world.cell, name, CONFIG))
            times = [second.run(world, motion).times_real for _ in range(RUNS)]
            note = f"times real time, processor time, median of {RUNS}"
            value = float(np.median(times))
            found.append(Figure(f"physics, {name}", "x", 25.0, value, at_least=True, note=note))
    return found
