"""Does the monitor of wear find it, on robots that were made different? In virtual time."""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from fanuc_emulator.plant.config import load_plant
from harness.faults.rows import Row
from harness.workspace import ROOT
from rich.console import Console
from scara_config import load_robot
from twin_analysis.health.signs import signs_of
from twin_analysis.health.trials import WITHIN, Trial, run_trial
from twin_analysis.health.virtual_cycles import Condition, run_cycle

FOLDER = ROOT / "config" / "robots" / "fanuc_sr6ia"
FOUND_PERCENT, FALSE_A_WEEK, CORE_PERCENT = 95.0, 1.0, 1.0
"""The goals of issue X."""
WORKERS = 2


def run(robots: int, first: int, console: Console) -> list[Row]:
    """Hold the monitor to robots that were drawn within 30 % of the field plant.

    Args:
        robots: How many.
        first: Seed of the first one.
        console: Hears what was missed, and of how many cases.

    Returns:
        Found in time, found rightly, false alarms in a week, and cost.
    """
    with ProcessPoolExecutor(WORKERS) as pool:
        trials = list(pool.map(_trial, range(first or 1, (first or 1) + robots)))
    for trial in trials:
        missed = [each for each in trial.found if each[:2] != each[2:4]]
        for wrong in (*missed, *trial.false_alarms):
            console.print(f"robot {trial.seed}: {wrong}", markup=False)
    cases = [each for trial in trials for each in trial.found]
    found = [each for each in cases if each[4]]
    right = [each for each in found if each[:2] == each[2:4]]
    slowest = max((each[4] for each in found), default=0)
    console.print(f"{len(cases)} cases of {robots} robots; the slowest took {slowest} cycles")
    false = max(len(trial.false_alarms) for trial in trials)
    name = f"wear within 30 % of field, {robots} robots"
    shares = 100.0 * len(found) / len(cases), 100.0 * len(right) / max(1, len(found))
    return [
        Row(name, f"found within {WITHIN} cycles [%]", FOUND_PERCENT, shares[0], at_least=True),
        Row(name, "joint and kind right [%]", FOUND_PERCENT, shares[1], at_least=True),
        Row(name, "most false alarms of a robot in 7 virtual days", FALSE_A_WEEK, float(false)),
        Row(name, "monitor [% of a core]", CORE_PERCENT, _core_percent()),
    ]


def _trial(seed: int) -> Trial:
    robot = load_robot(FOLDER)
    plant = load_plant(robot, FOLDER, f"field:{seed}")
    return run_trial(robot, plant, seed, np.random.default_rng(seed))


def _core_percent() -> float:
    """Return what looking at a cycle costs, over the cycle's own time."""
    robot = load_robot(FOLDER)
    plant, random = load_plant(robot, FOLDER, "field"), np.random.default_rng(1)
    cycle = run_cycle(robot, plant, Condition(), random)
    fastest = np.array([joint.velocity for joint in robot.joints])
    begin = time.process_time()
    for _ in range(20):
        signs_of(cycle, fastest)
    return 100.0 * (time.process_time() - begin) / 20 / float(cycle.times[-1])
