"""How long a verdict takes, and how fast the simulated world is.

Of a program of lines the plan of its motions is timed apart: it is the stand-in's own, and finds
the joints at each point of each line.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from rich.console import Console
from scara_config.programs.files import axis_names
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Coordinate, GroupPosition, Position, Program
from scara_config.programs.tp.printer import print_program
from what_if.cell_files_io import find_program, resting_cell
from what_if.judging import judge, judge_planned
from what_if.motions import JointTarget, Motion
from what_if.second_world_io import SecondWorld
from what_if.timing.planning import plan
from what_if.world import World

from bench.second_world.figure import Figure

CONFIG = Path(__file__).resolve().parents[2] / "config"
MOVES, PROGRAMS, RUNS = 200, 25, 5
STOPS = [(0, 60, -40), (40, 70, -50), (60, 100, -30), (20, 80, -40), (-20, 60, -30)]
"""Where the lines lead, there and back [deg, deg, mm]: one elbow, above table and parts."""


def measure(count: int, folder: Path, console: Console) -> list[Figure]:
    """Judge random moves and ARTICLE, and make two programs in the simulated world."""
    with resting_cell(CONFIG) as (world, _):
        return [*_verdicts(world), *_lines(world, folder), *_physics(world)]


def _verdicts(world: World) -> list[Figure]:
    rng = np.random.default_rng(7)
    low, high = np.array([(j.lower, j.upper) for j in world.cell.robot.twin_joints]).T
    moves = [JointTarget(tuple(rng.uniform(low, high).tolist())) for _ in range(MOVES)]
    article = find_program(world.cell, "ARTICLE", CONFIG)
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


def _lines(world: World, folder: Path) -> list[Figure]:
    robot, positions, texts = world.cell.robot, [], []
    for number, stop in enumerate((*STOPS, *STOPS[-2::-1]), start=1):
        given = dict(zip(("J1", "J2", "J3"), stop))
        coordinates = tuple(
            Coordinate(name, float(given.get(name, 0)), joint.unit)
            for name, joint in axis_names(robot).items()
        )
        positions.append(Position(number, "", (GroupPosition(1, "0", "1", "", coordinates),)))
        kind, speed = ("J", "50%") if number == 1 else ("L", "250mm/sec")
        texts.append(f"{kind} P[{number}] {speed} CNT50")
    program = Program("LINES", tuple(map(read_line, texts)), tuple(positions))
    file = folder / "LINES.LS"
    file.write_text(print_program(program), encoding="utf-8")
    run = find_program(world.cell, str(file), CONFIG)
    taken: list[tuple[float, float]] = []
    for _ in range(PROGRAMS):
        begin = time.perf_counter()
        planned = plan(world, run)
        middle = time.perf_counter()
        judge_planned(world, planned)
        taken.append((middle - begin, time.perf_counter() - middle))
    planning, judging = np.median(np.array(taken), axis=0) * 1e3
    note = f"{len(texts)} motions, median of {PROGRAMS}; their plan takes {planning:.0f} ms more"
    return [Figure("verdict by geometry, lines", "ms", 50.0, float(judging), note=note)]


def _physics(world: World) -> list[Figure]:
    found = []
    with SecondWorld(world, CONFIG) as second:
        for name in ("ARTICLE", "PALLETISE"):
            motion = find_program(world.cell, name, CONFIG)
            times = [second.run(world, motion).times_real for _ in range(RUNS)]
            note = f"times real time, processor time, median of {RUNS}"
            value = float(np.median(times))
            found.append(Figure(f"physics, {name}", "x", 25.0, value, at_least=True, note=note))
    return found
