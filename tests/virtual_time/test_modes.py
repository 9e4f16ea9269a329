"""The real robot's mode switch, in virtual time: real core, real stand-in, real twin."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import pytest
from harness.plants.variants import Variant
from harness.running.thorough import thorough
from harness.scenes.steps import ROBOT, both_stood, go, run_program
from harness.scenes.truth import tool_and_elbow
from harness.virtual_cell.cell import VirtualCell

T1_M_S = 0.25
T1_S = 2.0
"""So long a program runs in T1: it is at that speed by then."""
BY_KIT = Variant("modes", plant="ideal", kit=True).files(ROBOT)


@pytest.fixture
def cell(request: pytest.FixtureRequest) -> Iterator[VirtualCell]:
    """Give an idle cell whose robot runs at its full override."""
    with VirtualCell(getattr(request, "param", ROBOT)) as made:
        made.connect()
        made.real.robot.write_override(100)
        yield made


def turn(cell: VirtualCell, mode: str) -> None:
    """Turn the switch at the robot, then reset and align from here: the pair is ready again."""
    cell.real.signal(f"panel_{mode.lower()}", None)
    cell.wait_whatever(lambda: cell.mode == "ESTOP", 2.0, "ESTOP")
    both_stood(cell, cell.schedule.now)
    assert cell.operate("RESET").success
    cell.wait_whatever(lambda: cell.mode == "STOPPED", 5.0, "STOPPED")
    assert cell.operate("ALIGN").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 10.0, "IDLE")


@pytest.mark.parametrize("cell", [ROBOT, *thorough(BY_KIT)], indirect=True)
def test_a_turned_switch_ends_the_following_and_t1_is_never_led(cell: VirtualCell) -> None:
    """The robot halts, both stand; in T1 its person leads, at 250 mm/s; in AUTO it is led.

    That the map of the kit tells the switch, too, is held each time in fanuc_emulator/test_modes.py
    and twin_controller/test_registers.py; what is told of it in core/lead/test_operation_mode.py.
    """
    go(cell, 50.0)
    cell.schedule.run(0.5)
    assert cell.real.shown.outputs.progrun
    turn(cell, "T1")
    (told,) = [made for made in cell.decisions if made.trigger == "OPERATION_MODE"]
    assert "mode switch is at T1" in told.why
    for command in ("HOME", "MOVE_JOINTS"):
        answer = cell.operate(command, target=(0.0, 0.0, -0.1, 0.0))
        assert not answer.success and "mode switch is at T1" in answer.message
    begun = cell.schedule.now
    run_program(cell)
    cell.schedule.run(T1_S)
    cell.real.signal("panel_abort", None)
    cell.wait_whatever(lambda: cell.mode == "IDLE", 10.0, "the end of the program")
    # Tool and flange of this robot are one place; its elbow may be faster.
    places = [(at, tool_and_elbow(q)[0]) for at, q, _ in cell.real.truth if at >= begun]
    speeds = [math.dist(a, b) / (t - s) for (s, a), (t, b) in pairwise(places)]
    assert 0.9 * T1_M_S < max(speeds) <= T1_M_S
    turn(cell, "AUTO")
    assert cell.operate("HOME").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 30.0, "home")
    assert cell.real.shown.alarm is None
