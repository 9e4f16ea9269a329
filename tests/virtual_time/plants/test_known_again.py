"""A robot that was led before is led at its first move as at its later ones."""

from __future__ import annotations

import dataclasses

import msgspec
import pytest
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import CellFiles, load_files
from scara_config.set_up.kit_map import kit_map
from twin_controller.core.events import RealKnown
from twin_controller.core.follow.pace import follower_pace
from twin_controller.core.follow.response import SLOWEST_PERCENT
from twin_controller.engine.learned_io import event_of, learned

ROBOT, SPEED_PERCENT = "fanuc_sr6ia", 50.0


def kit_files(draw: int) -> CellFiles:
    """Return a drawn robot as the kit's sheets make it."""
    files = load_files(ROBOT, plant=f"field:{draw}")
    return dataclasses.replace(files, layout=kit_map(files.layout))


def moved(files: CellFiles, known: RealKnown | None) -> tuple[float, float, RealKnown]:
    """Lead a robot to a place, far from home.

    Returns:
        With what speed it may be led at first [percent], how long it took [s], what was learned.
    """
    with VirtualCell(files) as cell:
        cell.connect()
        if known is not None:
            cell.put(msgspec.structs.replace(known, now=cell.clock()))
        state = cell._state
        pace = follower_pace(cell.setup, state.follow, state.sides, 100.0, cell.clock()).percent
        places, begun = cell.files.robot.positions_m, cell.schedule.now
        for name in cell.files.experiments.experiments["twin_leads"].visits[1:2]:
            cell.move_to(places[name], SPEED_PERCENT)
        taken = cell.schedule.now - begun
        cell.schedule.run(0.5)
        kept = learned(cell._state, cell.setup.names)
    assert kept is not None
    return pace, taken, event_of(kept, cell.setup.names, 0.0)


@pytest.mark.thorough
def test_the_first_move_of_a_known_robot_is_not_slow() -> None:
    """What was learned is there again."""
    slow, unknown, known = moved(kit_files(3), None)
    faster, again, same = moved(kit_files(3), known)
    assert slow == SLOWEST_PERCENT < faster
    assert again < unknown
    assert same.delay == pytest.approx(known.delay, abs=0.012)
