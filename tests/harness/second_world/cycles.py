"""How long the stand-in runs its programs: both plants, with parts, in virtual time."""

from __future__ import annotations

import numpy as np
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.tp.executor import ProgramState
from what_if.world import World

from harness.yaml_files import CONFIG

LONGEST_S = 90.0


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
    robot, work = world.cell.robot, world.cell.work
    config, programs = load_emulator(robot, CONFIG, plant), load_programs(robot, CONFIG)
    parts = CellParts(work, robot) if work else None
    chance = np.random.default_rng(1)
    controller = Controller(config, robot, programs, boot_seconds=1.7e9, parts=parts, random=chance)
    controller.write_override(override)
    number = next(rsr for rsr, program in programs.items() if program.name == name)
    running, seen = 0, list[tuple[int, float]]()
    for step in range(int(LONGEST_S / config.dt)):
        if step in (5, 10):
            controller.write_input(f"panel_run{number}", step == 5)
        shown = controller.step()
        state = shown.program_state
        running += state is ProgramState.RUNNING
        if running and (not seen or seen[-1][0] != shown.program_line):
            seen.append((shown.program_line, running * config.dt))
        if running and state is ProgramState.ABORTED:
            if parts is not None and (parts.drops or parts.collisions):
                raise CycleError(f"{name}: {parts.drops} drops, {parts.collisions} collisions")
            return running * config.dt, seen
    raise CycleError(f"{name} does not end within {LONGEST_S:g} s")
