"""How long the stand-in runs its programs: both plants, with parts, in virtual time."""

from __future__ import annotations

import numpy as np
from fanuc_emulator.config import load_emulator, load_programs
from what_if.improving.plants import LONGEST_S, run_on
from what_if.world import World

from harness.yaml_files import CONFIG


class CycleError(RuntimeError):
    """The program did not end as it should."""


def measured(world: World, name: str, plant: str = "ideal", override: int = 100) -> float:
    """Return how long a plant runs a program from its start [s].

    Raises:
        CycleError: It does not end, or a part was dropped or hit.
    """
    return run(world, name, plant, override)[0]


def run(
    world: World, name: str, plant: str, override: int = 100
) -> tuple[float, list[tuple[int, float]]]:
    """Return how long a plant runs a program, and since when it showed which line [s].

    Raises:
        CycleError: It does not end, or a part was dropped or hit.
    """
    robot = world.cell.robot
    config, programs = load_emulator(robot, CONFIG, plant), load_programs(robot, CONFIG)
    program = next(each for each in programs.values() if each.name == name)
    found = run_on(config, world.cell, program, np.random.default_rng(1), override=override)
    if found is None:
        raise CycleError(f"{name} does not end within {LONGEST_S:g} s")
    if found.drops or found.collisions:
        raise CycleError(f"{name}: {found.drops} drops, {found.collisions} collisions")
    return found.seconds, found.lines
