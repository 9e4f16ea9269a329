"""A robot that holds what a person typed by the kit, and nothing else, leads and is led.

No speeds, no stamp of its readings but its plain clock, no set points ahead: PR[1] alone.
"""

from __future__ import annotations

import dataclasses

import pytest
from harness.scenes.steps import AT_REST_DEG_MM, AWAY, ROBOT
from harness.scenes.truth import travel
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.experiments import figures, run_experiments
from harness.virtual_cell.files import load_files
from scara_config.set_up.kit_map import kit_map
from twin_controller.core.events import LinkChanged

PERCENT = {"real_leads": 1.2, "twin_leads": 2.0}
"""Of reach, at 50 %, the first move of an unknown robot included. Measured on 2026-11-26: field
0.89 and 1.50 %, ideal 0.47 and 0.09 %."""


def test_flags_that_a_cold_start_left_off_move_nothing_until_a_person_switches_them_on() -> None:
    """The pair gives *IMSTP and HOLD by RESET; *SFSPD and ENBL are for the person there."""
    files = load_files(ROBOT, settings={"unwired": ("imstp", "hold", "sfspd", "enbl")})
    with VirtualCell(dataclasses.replace(files, layout=kit_map(files.layout))) as cell:
        begun = cell.schedule.now
        cell.put(LinkChanged(cell.clock(), "twin", True, ""))
        cell.wait_whatever(lambda: cell.mode == "ESTOP", 5.0, "ESTOP")
        ready(cell)
        assert not cell.real.shown.outputs.cmdenbl
        assert cell.operate("MOVE_JOINTS", target=AWAY, speed_percent=30.0).success
        cell.wait_whatever(lambda: cell.mode == "FAULT", 10.0, "FAULT")
        assert "does not start its stream program" in cell.why
        cell.schedule.run(1.0)
        assert travel(cell.real.truth, begun) < AT_REST_DEG_MM
        for name in ("sfspd", "enbl"):
            cell.real.signal(name, True)
        cell.real.robot.write_override(100)
        ready(cell)
        cell.move_to(files.robot.positions_m["P2"], 60.0)
        cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "IDLE")


def ready(cell: VirtualCell) -> None:
    """Let the operator reset and align, until the pair is idle."""
    assert cell.operate("RESET").success
    cell.wait_whatever(lambda: cell.mode == "STOPPED", 5.0, "STOPPED")
    assert cell.operate("ALIGN").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "IDLE")


@pytest.mark.thorough
@pytest.mark.parametrize("plant", ["field", "ideal"])
def test_a_robot_of_typed_programs_and_its_twin_keep_together(plant: str) -> None:
    """Both experiments of the demo, one after the other.

    By day such a robot leads and is led in test_alarms.py and test_palletise.py.
    """
    files = load_files("fanuc_sr6ia", plant=plant)
    with VirtualCell(dataclasses.replace(files, layout=kit_map(files.layout))) as cell:
        cell.connect()
        results = run_experiments(cell)
        latch = cell._state.sides.real.latch
    for name, result in results.items():
        assert not result.reasons, result.reasons
        percent = 100.0 * figures(result).path_max_mm / files.robot.reach_mm
        assert percent <= PERCENT[name], (name, percent)
    assert latch.settled and latch.period == (0.008 if plant == "field" else 0.0)
