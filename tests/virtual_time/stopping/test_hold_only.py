"""A robot as it is delivered, which only HOLD stops, leads, follows, stops and goes on."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from fanuc_emulator.tp.executor import ProgramState
from harness.scenes.steps import AT_REST_DEG_MM, ROBOT, both_stood, go, nothing_moves, run_program
from harness.scenes.truth import travel
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files

HOLD_ONLY = {"cstopi_for_abort": False, "imstp_assigned": False}
"""No CSTOPI for ABORT, and *IMSTP tied on."""
STANDS_S = 0.35
"""The stop on the wire, the robot's ramp from 30 % speed and the twin's."""


@pytest.fixture
def cell() -> Iterator[VirtualCell]:
    """Give an idle cell whose robot only HOLD stops."""
    with VirtualCell(load_files(ROBOT, settings=HOLD_ONLY)) as made:
        made.connect()
        made.real.robot.write_override(100)
        yield made


def aligned(cell: VirtualCell) -> None:
    """Let the operator align, until the pair is idle."""
    assert cell.operate("ALIGN").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "IDLE")


def test_a_program_stands_after_stop_and_goes_on_at_the_pendant_only(cell: VirtualCell) -> None:
    """It is paused, HOLD is back, and no alarm or drive was needed.

    That it goes on to its end and the pair is IDLE then test_pause.py says.
    """
    run_program(cell)
    cell.schedule.run(0.7)
    assert cell.operate("STOP").success
    stopped = cell.schedule.now
    assert both_stood(cell, stopped) - stopped < STANDS_S
    nothing_moves(cell, cell.schedule.now, 2.0)
    assert cell.mode == "STOPPED" and cell.real.shown.program_state is ProgramState.PAUSED
    assert "hold" in cell.real.shown.inputs and cell.real.shown.outputs.sysrdy
    cell.real.signal("panel_start", None)
    begun = cell.schedule.now
    cell.wait_whatever(lambda: cell.mode == "REAL_LEADS", 5.0, "REAL_LEADS")
    cell.schedule.run(1.0)
    assert travel(cell.real.truth, begun) > 1.0 < travel(cell.twin.truth, begun)


def test_a_program_that_was_paused_by_a_stop_keeps_the_twin_from_leading(
    cell: VirtualCell,
) -> None:
    """No stream can start beside it: whoever asks reads why, and what ends it."""
    run_program(cell, "ARTICLE")
    cell.schedule.run(0.7)
    assert cell.operate("STOP").success
    cell.schedule.run(1.0)
    aligned(cell)
    said = "the real robot has paused a program of its own: end it there, or let it go on"
    assert cell.operate("HOME").message == cell.refusals()["JOG"] == said
    rested = cell.schedule.now
    cell.twin.move_to.begin(cell.files.robot.positions_m["P2"], 30.0, "", lambda *_: None)
    cell.wait_whatever(lambda: cell.mode == "STOPPED", 2.0, "STOPPED")
    assert cell.decisions[-1].trigger == "TWIN_MOVED_UNLED" and said in cell.why
    cell.schedule.run(1.0)
    assert travel(cell.real.truth, rested) < AT_REST_DEG_MM
    cell.real.signal("panel_abort", None)
    cell.schedule.run(0.5)
    aligned(cell)
    assert cell.operate("HOME").success


def test_the_pair_goes_on_with_the_same_stream_after_a_stop(cell: VirtualCell) -> None:
    """START lets the paused stream go on where the robot stands; nothing waits in the robot."""
    for _ in range(2):
        go(cell, 30.0)
        cell.schedule.run(0.4)
        assert cell.operate("STOP").success
        stopped = cell.schedule.now
        assert both_stood(cell, stopped) - stopped < STANDS_S
        cell.schedule.run(1.0)
        rested = cell.schedule.now
        assert cell.real.shown.program_state is ProgramState.PAUSED
        aligned(cell)
        assert travel(cell.real.truth, rested) < AT_REST_DEG_MM
    home = cell.operate("HOME", speed_percent=30.0)
    assert home.success, home.message
    cell.wait_until(lambda: cell.mode == "OPERATOR_LEADS", 5.0, "OPERATOR_LEADS")
    cell.wait_until(lambda: cell.mode == "IDLE", 30.0, "IDLE")
    cell.wait_still(1.0)
    assert not any(each.mode_after in ("ESTOP", "FAULT") for each in cell.decisions)


def test_moves_follow_each_other_and_a_pause_goes_on(cell: VirtualCell) -> None:
    """The stream of each move is the one before, let go on."""
    positions = cell.files.robot.positions_m
    cell.move_to(positions["P2"], 60.0)
    cell.wait_still(0.5)
    go(cell, 60.0)
    cell.schedule.run(0.4)
    assert cell.operate("PAUSE").success
    both_stood(cell, cell.schedule.now)
    assert cell.operate("RESUME").success
    cell.wait_until(lambda: cell.mode == "IDLE", 30.0, "IDLE")
    assert not any(each.mode_after in ("ESTOP", "FAULT") for each in cell.decisions)


def test_an_emergency_stop_holds_a_robot_that_keeps_its_drives(cell: VirtualCell) -> None:
    """*IMSTP is tied on: HOLD and CSTOPI, which go with it, are what stops it."""
    run_program(cell, "ARTICLE")
    cell.schedule.run(0.7)
    assert cell.operate("ESTOP").success
    stopped = cell.schedule.now
    assert both_stood(cell, stopped) - stopped < STANDS_S
    nothing_moves(cell, cell.schedule.now, 2.0)
    assert cell.mode == "ESTOP" and "hold" not in cell.real.shown.inputs
    assert not any(each.trigger == "ESTOP_IGNORED" for each in cell.decisions)
    assert cell.operate("RESET").success
    cell.wait_whatever(lambda: cell.mode == "STOPPED", 5.0, "STOPPED")
    nothing_moves(cell, cell.schedule.now, 2.0)
