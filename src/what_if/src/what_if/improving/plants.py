"""How long the stand-in runs a program, and what becomes of the parts: virtual time."""

from __future__ import annotations

import math

import msgspec
import numpy as np
from fanuc_emulator.config import EmulatorConfig
from fanuc_emulator.controller import Controller
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.tp.executor import ProgramState
from scara_config.palletise import MM, Palletise
from scara_config.programs.files import Taught

from what_if.world import Cell

LONGEST_S = 600.0
"""A program that takes longer is not waited for; our choice."""
NUMBER = 2
"""Under which RSR it is started: RSR1 is the stream program."""
STARTED, LET_GO = 5, 10
"""Steps after which the panel's button is pressed, and let go."""


class PlantRun(msgspec.Struct, frozen=True):
    """What came of a program on a plant.

    Attributes:
        seconds: From its start to its end [s].
        lines: Since when it showed which line [s].
        placed: Parts that were set down, in that order.
        off_mm: The one that lies furthest from every place of the pallet does so by so much.
        drops: Parts that were dropped.
        collisions: So often something was hit.
    """

    seconds: float
    lines: list[tuple[int, float]]
    placed: tuple[str, ...]
    off_mm: float
    drops: int
    collisions: int


def run_on(
    config: EmulatorConfig,
    cell: Cell,
    program: Taught,
    chance: np.random.Generator,
    others: tuple[Taught, ...] = (),
    override: int = 100,
) -> PlantRun | None:
    """Run a program on the stand-in, from its start position and with all parts on their stands.

    Args:
        config: emulator.yaml with the plant.
        cell: The cell.
        program: What is run.
        chance: Draws what the plant leaves to it.
        others: What it can call.
        override: Of every speed [percent].

    Returns:
        None: it did not come to its end.
    """
    robot, work = cell.robot, cell.work
    parts = CellParts(work, robot) if work else None
    programs = dict(enumerate((program, *others), start=NUMBER))
    controller = Controller(config, robot, programs, 1.7e9, parts=parts, random=chance)
    controller.write_override(override)
    running, seen = 0, list[tuple[int, float]]()
    for step in range(int(LONGEST_S / config.dt)):
        if step in (STARTED, LET_GO):
            controller.write_input(f"panel_run{NUMBER}", step == STARTED)
        shown = controller.step()
        running += shown.program_state is ProgramState.RUNNING
        if running and (not seen or seen[-1][0] != shown.program_line):
            seen.append((shown.program_line, running * config.dt))
        if running and shown.program_state is ProgramState.ABORTED:
            found = PlantRun(running * config.dt, seen, (), 0.0, 0, 0)
            return _with_parts(found, parts, work) if parts and work else found
        # An alarm has paused it, and nobody is there to resume it.
        if running and shown.program_state is ProgramState.PAUSED:
            return None
    return None


def _with_parts(found: PlantRun, parts: CellParts, work: Palletise) -> PlantRun:
    """Return a run with what became of the parts."""
    placed = tuple(event.part for event in parts.events if event.kind == "placed")
    places = work.pallet.places()
    lying = [parts.place(part) for part in parts.parts if part.name in placed]
    off = [min(math.dist(at[:2], place) for place in places) for at in lying]
    return msgspec.structs.replace(
        found,
        placed=placed,
        off_mm=max(off, default=0.0) / MM,
        drops=parts.drops,
        collisions=parts.collisions,
    )
