"""Does the monitor of wear find it, on robots that were made different? In virtual time."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache, partial
from itertools import combinations
from pathlib import Path

import numpy as np
from fanuc_emulator.plant.config import load_plant
from harness.workspace import ROOT
from rich.console import Console
from scara_config import load_robot
from twin_analysis.health.signs import signs_of
from twin_analysis.health.trend import LEAST
from twin_analysis.health.trials import (
    WITHIN,
    RobotRecord,
    Trial,
    WearScene,
    judged,
    run_robot,
)
from twin_analysis.health.virtual_cycles import FAST, KINDS, SLOW, Condition, run_cycle

from bench.second_world.figure import Figure

ROBOTS = ROOT / "config" / "robots"
OURS = "fanuc_sr6ia"
OTHERS = ("fanuc_sr3ia", "epson_gx4", "scara_4axis", "articulated_six")
FOUND_PERCENT, FALSE_A_WEEK, CORE_PERCENT = 95.0, 1.0, 1.0
"""The goals of issue X."""
WORKERS = 2
FOUND, RIGHT, FALSE = (
    f"found within {WITHIN} cycles",
    "joint and kind right",
    "most false alarms of a robot in 7 days",
)
BOTH, UNTRUE = "each named", "nothing untrue named"
VARIED = {
    "wear at once, not over 8 cycles": WearScene(grows=1),
    "a cycle of fast moves alone": WearScene(((0.35, FAST), (-0.35, FAST), (0.0, FAST)) * 2),
    "fast moves at full speed": WearScene(
        ((0.2, 100.0), (-0.2, 100.0), (0.0, 100.0), (0.6, SLOW), (0.0, SLOW), (0.6, SLOW))
    ),
}
SEVERAL = {
    "two kinds at once": WearScene(cases=tuple(combinations(KINDS, 2)), week=LEAST),
    "friction in two joints": WearScene(cases=(("friction",) * 2,) * 3, week=LEAST),
    "friction in all joints": WearScene(cases=(("friction",) * 5,) * 3, week=LEAST),
}


def measure_wear(robots: int, first: int, console: Console) -> list[Figure]:
    """Return how the monitor does on robots drawn of the kind that it was made with.

    Args:
        robots: How many.
        first: Seed of the first one.
        console: Hears what was missed.
    """
    trials = [judged(record) for record in records(OURS, robots, first, WearScene())]
    return [
        *figures(f"{OURS}, {counted(robots)}", trials, console),
        Figure("the monitor", "% of a core", CORE_PERCENT, _core_percent(), note="cost"),
    ]


def measure_robots(robots: int, first: int, console: Console) -> list[Figure]:
    """Return how it does on other kinds of robots, a sixth as many of each."""
    return [
        figure
        for name in OTHERS
        for figure in figures(
            f"{name}, {counted(few(robots))}",
            [judged(record) for record in records(name, few(robots), first, WearScene())],
            console,
        )
    ]


def measure_varied(robots: int, first: int, console: Console) -> list[Figure]:
    """Return how it does with other wear and other cycles, on a sixth as many robots."""
    return [
        figure
        for words, scene in VARIED.items()
        for figure in figures(
            f"{words}, {counted(few(robots))}",
            [judged(record) for record in records(OURS, few(robots), first, scene)],
            console,
        )
    ]


def measure_several(robots: int, first: int, console: Console) -> list[Figure]:
    """Return what it says where more than one part wears, on a sixth as many robots."""
    rows = []
    for words, scene in SEVERAL.items():
        trials = [judged(record) for record in records(OURS, few(robots), first, scene)]
        results = [each for trial in trials for each in trial.results]
        rows += figures(words, trials, console)[:2]
        for note, count in (
            (BOTH, sum(set(each.worn) <= set(each.said) for each in results)),
            (UNTRUE, sum(set(each.said) <= set(each.worn) for each in results)),
        ):
            share = 100.0 * count / len(results)
            rows.append(Figure(words, "%", FOUND_PERCENT, share, at_least=True, note=note))
    return rows


def few(robots: int) -> int:
    """Return a sixth of so many robots, at least one."""
    return max(1, robots // 6)


def counted(robots: int) -> str:
    """Return how many robots, in words."""
    return f"{robots} robot{'s' * (robots != 1)}"


@lru_cache(maxsize=1)
def records(name: str, robots: int, first: int, scene: WearScene) -> tuple[RobotRecord, ...]:
    """Return what the cycles of robots said; the last ones are kept for who asks again."""
    with ProcessPoolExecutor(WORKERS) as pool:
        run = partial(_run, ROBOTS / name, scene)
        return tuple(pool.map(run, range(first, first + robots)))


def _run(folder: Path, scene: WearScene, seed: int) -> RobotRecord:
    robot = load_robot(folder)
    plant = load_plant(robot, folder, f"field:{seed}")
    return run_robot(robot, plant, np.random.default_rng(seed), scene)


def figures(what: str, trials: Sequence[Trial], console: Console) -> list[Figure]:
    """Return found in time, found rightly, and false alarms; say what was missed."""
    results = [each for trial in trials for each in trial.results]
    for trial in trials:
        for result in trial.results:
            if not result.right:
                said = f"said {result.said}, after {result.after}"
                console.print(f"{what}: worn {result.worn}, {said}", markup=False)
        if trial.false_alarms:
            console.print(f"{what}: false {trial.false_alarms}", markup=False)
    found = [each for each in results if each.after]
    right = sum(each.right for each in found)
    shares = 100.0 * len(found) / len(results), 100.0 * right / max(1, len(found))
    false = max(len(trial.false_alarms) for trial in trials)
    slowest = max((each.after for each in found), default=0)
    console.print(f"{what}: {len(results)} cases; the last found after {slowest} cycles")
    return [
        Figure(what, "%", FOUND_PERCENT, shares[0], at_least=True, note=FOUND),
        Figure(what, "%", FOUND_PERCENT, shares[1], at_least=True, note=RIGHT),
        Figure(what, "", FALSE_A_WEEK, float(false), note=FALSE),
    ]


def _core_percent() -> float:
    """Return what looking at a cycle costs, over the cycle's own time."""
    robot = load_robot(ROBOTS / OURS)
    plant, random = load_plant(robot, ROBOTS / OURS, "field"), np.random.default_rng(1)
    cycle = run_cycle(robot, plant, Condition(), random)
    fastest = np.array([joint.velocity for joint in robot.joints])
    begin = time.process_time()
    for _ in range(20):
        signs_of(cycle, fastest)
    return 100.0 * (time.process_time() - begin) / 20 / float(cycle.times[-1])
