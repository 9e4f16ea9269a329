"""PALLETISE on a robot of which a person typed the kit: two slots tell of its own gripper.

The twin's gripper is told each time; its parts are the simulator's affair, not looked at here.
"""

from __future__ import annotations

import dataclasses
from functools import partial

import numpy as np
import pytest
from fanuc_emulator.controller import Controller
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.gripping.vehicle import dock
from fanuc_emulator.tp.executor import ProgramState
from harness.scenes.steps import ROBOT
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files
from harness.virtual_cell.real_side import SEED
from harness.workspace import ROOT
from scara_config.palletise import load_palletise
from scara_config.set_up.kit_map import kit_map
from twin_controller.core.actions import AnyAction, Grip
from twin_controller.core.events import TwinGripper

TWIN_GRIPS_S = 0.05
"""Until the twin's suction shows what it was told."""
TOLD_S = 0.1
"""From the robot's own switch until the twin is told."""


class GrippingCell(VirtualCell):
    """A cell whose twin has a gripper that obeys."""

    def __init__(self, *arguments: object) -> None:
        self.grips: list[tuple[float, Grip]] = []
        super().__init__(*arguments)  # type: ignore[arg-type]

    def _carry_out(self, action: AnyAction) -> None:
        if isinstance(action, Grip):
            self.grips.append((self.schedule.now, action))
            self.schedule.after(TWIN_GRIPS_S, partial(self._gripped, action.on))
        super()._carry_out(action)

    def _gripped(self, on: bool) -> None:
        self.put(TwinGripper(self.clock(), on, on))


@pytest.mark.thorough
@pytest.mark.parametrize("count", [1, 9])
def test_the_parts_arrive_and_the_twins_gripper_follows_each_switch(count: int) -> None:
    """On the kit's own map and programs, stand-in `ready`; no coil of ours switches anything."""
    files = load_files(ROBOT)
    layout = kit_map(files.layout)
    assert "gripper" not in layout.coils and layout.shows_gripper
    with GrippingCell(dataclasses.replace(files, layout=layout)) as cell:
        parts = cell.real.robot.parts = CellParts(load_palletise(ROOT / "config"), files.robot)
        cell.connect()
        cell._gripped(False)
        switches: list[tuple[float, bool]] = [(0.0, False)]

        def note() -> None:
            on = cell.real.robot.snapshot().outputs.gripper
            if on != switches[-1][1]:
                switches.append((cell.schedule.now, on))

        cell.schedule.every(0.002, note, first=0.0)
        if count == 9:
            cell.run_program("PALLETISE")
        else:
            cell.real.pendant(100.0, files.program_number("PALLETISE"))
            cell.wait_until(lambda: len(cell.grips) == 2 * count, 30.0, "the parts")
            cell.schedule.run(0.5)
    placed = [event for event in parts.events if event.kind == "placed"]
    assert len({event.part for event in placed}) == count
    assert (parts.drops, parts.collisions) == (0, 0)
    assert all(grip.side == "twin" for _, grip in cell.grips)
    assert (
        [grip.on for _, grip in cell.grips]
        == [on for _, on in switches[1:]]
        == [True, False] * count
    )
    late = [told - at for (told, _), (at, _) in zip(cell.grips, switches[1:])]
    assert max(late) < TOLD_S
    assert cell._state.orders.grips.trouble == ""


def test_a_vehicle_that_leaves_under_the_robot_stops_both_sides() -> None:
    """Its background logic holds the robot; the pair stops, and RESET alone lets it go.

    The pair's own STOP has ended the program: nothing waits for a vehicle.
    """
    files, work = load_files(ROBOT), load_palletise(ROOT / "config")
    with GrippingCell(files) as cell:
        parts, real = CellParts(work, files.robot), cell.real
        rings, chance = files.layout.ring_places, np.random.default_rng(SEED)
        real.robot = Controller(
            files.emulator, files.robot, files.programs, 0.0, parts, chance, rings
        )
        cell.connect()
        cell._gripped(False)
        parts.dock(dock(work, np.random.default_rng(2)))
        real.pendant(100.0, files.program_number("VEHICLE"))
        cell.wait_until(lambda: real.shown.program_line == 22, 30.0, "the vehicle")
        began = cell.schedule.now
        parts.dock(None)
        cell.wait_whatever(lambda: cell.mode == "FAULT", 1.0, "FAULT")
        assert cell.schedule.now - began < 0.1
        cell.wait_whatever(lambda: cell.still_for() > 0.2, 1.0, "both sides to stand")
        assert cell.decisions[-1].trigger == "REAL_FAULT"
        cell.schedule.run(2.0)
        shown = real.robot.snapshot()
        assert shown.outputs.held and shown.outputs.fault
        assert shown.program_state is ProgramState.ABORTED and cell.mode == "FAULT"
        assert cell.operate("RESET").success
        cell.wait_whatever(lambda: cell.mode == "STOPPED", 5.0, "RESET")
        assert cell.still_for() > 2.0 and not real.robot.snapshot().outputs.held
    assert [event.kind for event in parts.events if event.kind == "placed"] == []
