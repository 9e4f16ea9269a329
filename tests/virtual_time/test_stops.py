"""Stops and releases in virtual time: the real core, the real stand-in, the real twin."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import pytest
from harness.parts import changed
from harness.plants.variants import Variant
from harness.running.thorough import thorough
from harness.scenes.steps import AT_REST_DEG_MM, ROBOT, both_stood, go, nothing_moves, run_program
from harness.scenes.truth import travel
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import CellFiles, load_files

AS_FILED = pytest.param("", id="as filed")
HOLD_ONLY = "cstopi_for_abort: false, imstp_assigned: false"
SINGLE = ("cstopi_for_abort: false", "imstp_assigned: false")
OTHERS = thorough(*SINGLE)
AFTER = (0.3, 0.8)
SET_UP = pytest.mark.parametrize(
    "settings", [AS_FILED, pytest.param(HOLD_ONLY, id="hold only"), *OTHERS]
)
"""How the robot was set up. stops/test_stop_table.py holds each pair of both settings each time."""


@pytest.fixture(params=[AS_FILED, *OTHERS, *thorough(HOLD_ONLY)])
def settings(request: pytest.FixtureRequest) -> str:
    """Return how the robot was set up, where the twin is what is to stop."""
    return str(request.param)


@pytest.fixture
def cell(settings: str) -> Iterator[VirtualCell]:
    """Give an idle cell whose robot was set up like that."""
    with VirtualCell(load_files(ROBOT, settings=settings)) as made:
        made.connect()
        yield made


@SET_UP
@pytest.mark.parametrize("speed_percent", [*thorough(10.0), 30.0])
def test_release_of_an_emergency_stop_moves_nothing(
    cell: VirtualCell, speed_percent: float
) -> None:
    """RESET and ALIGN give no motion back."""
    go(cell, speed_percent)
    cell.schedule.run(0.3)
    assert cell.operate("ESTOP").success
    both_stood(cell, cell.schedule.now)
    rested = cell.schedule.now
    assert cell.operate("RESET").success
    cell.wait_whatever(lambda: cell.mode == "STOPPED", 10.0, "STOPPED")
    nothing_moves(cell, rested)
    decided = len(cell.decisions)
    assert cell.operate("ALIGN").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 10.0, "IDLE")
    cell.wait_still(0.5)
    nothing_moves(cell, cell.schedule.now)
    assert travel(cell.real.truth, rested) < AT_REST_DEG_MM, "only the twin aligns"
    assert not any("LEADS" in decision.mode_after for decision in cell.decisions[decided:])


def with_slow_drives(power_on_ms: int, plant: str, kit: bool = False) -> CellFiles:
    """Return a cell whose robot takes so long from RESET until its drives are on."""
    slow = Variant("slow", lambda made: changed(made, power_on_ms=power_on_ms), plant, kit=kit)
    return slow.files(ROBOT)


def stopped_and_reset(cell: VirtualCell) -> float:
    """Stop both in mid-move by ESTOP, give RESET; return when."""
    cell.connect()
    go(cell, 30.0)
    cell.schedule.run(0.3)
    assert cell.operate("ESTOP").success
    both_stood(cell, cell.schedule.now)
    assert cell.operate("RESET").success
    return cell.schedule.now


@pytest.mark.parametrize(
    ("plant", "kit"), [("field", False), ("ideal", True), *thorough(("field", True))]
)
def test_a_reset_ends_when_the_drives_are_on_and_not_before(plant: str, kit: bool) -> None:
    """1.9 s of the 2 s that a controller may take; the kit's map tells it by the alarm alone."""
    with VirtualCell(with_slow_drives(1900, plant, kit)) as cell:
        asked = stopped_and_reset(cell)
        while cell.mode == "ESTOP":
            cell.schedule.run(0.01)
            flags = cell._state.sides.real.flags
            on = cell.real.robot.snapshot().outputs.sysrdy
            assert on or (flags is not None and flags.fault)
        assert cell.mode == "STOPPED" and 1.9 < cell.schedule.now - asked < 2.6
        decided = [each.trigger for each in cell.decisions]
        assert decided[decided.index("RESET") :] == ["RESET", "RESET_DONE"]
        nothing_moves(cell, asked)
        assert cell.operate("ALIGN").success
        cell.wait_whatever(lambda: cell.mode == "IDLE", 10.0, "IDLE")
        go(cell, 30.0)


@pytest.mark.parametrize("pressed", [False, True])
def test_drives_that_do_not_come_are_a_failed_reset_with_its_cause(pressed: bool) -> None:
    """They come too late, or somebody at the robot stops it; what comes late is off again."""
    with VirtualCell(with_slow_drives(5000, "field")) as cell:
        asked = stopped_and_reset(cell)
        if pressed:
            cell.schedule.run(1.0)
            cell.real.signal("panel_imstp", False)
        cell.schedule.run(4.2 - (cell.schedule.now - asked))
        failed = cell.decisions[-1]
        said = "(its drives are off: its emergency stop is pressed)" if pressed else "are off)"
        assert failed.trigger == "RESET_FAILED" and said in failed.why
        cell.schedule.run(2.0)
        assert cell.mode == "ESTOP" and not cell.real.shown.outputs.sysrdy
        missed = [each.trigger for each in cell.decisions].count("ESTOP_MISSED")
        assert missed == (not pressed)
        nothing_moves(cell, asked)


@pytest.mark.parametrize("command", ["STOP", "ESTOP", "PAUSE"])
def test_the_simulator_obeys_a_stop_itself(cell: VirtualCell, command: str) -> None:
    """A joint that no motion node drives comes to rest too, and the robot with it."""
    cell.twin.command_velocity("joint_1", 0.25)
    cell.wait_whatever(lambda: cell.mode == "TWIN_LEADS", 5.0, "TWIN_LEADS")
    assert cell.operate(command).success
    stopped = cell.schedule.now
    assert both_stood(cell, stopped) - stopped < 0.35
    nothing_moves(cell, cell.schedule.now)


def test_after_an_emergency_stop_no_direct_command_moves_the_twin(cell: VirtualCell) -> None:
    """Until RESET; then it is stopped again, and nobody follows before both have aligned."""
    assert cell.operate("ESTOP").success
    cell.schedule.run(1.0)
    rested = cell.schedule.now
    cell.twin.command_velocity("joint_1", 0.25)
    nothing_moves(cell, rested)
    assert "the emergency stop is latched: RESET first" in cell.twin.refused[-1]
    assert cell.operate("RESET").success
    cell.wait_whatever(lambda: cell.mode == "STOPPED", 5.0, "STOPPED")
    nothing_moves(cell, rested)
    cell.twin.command_velocity("joint_1", 0.25)
    cell.schedule.run(1.0)
    assert travel(cell.real.truth, rested) < AT_REST_DEG_MM
    assert travel(cell.twin.truth, rested) < 0.1
    assert cell.decisions[-1].trigger == "TWIN_MOVED_STOPPED"


def test_a_velocity_that_nobody_repeats_ends(cell: VirtualCell) -> None:
    """Whoever has sent it may be gone."""
    begun = cell.schedule.now
    cell.twin.command_velocity("joint_1", 0.25)
    cell.wait_whatever(lambda: cell.mode == "TWIN_LEADS", 5.0, "TWIN_LEADS")
    both_stood(cell, begun)
    timeout = cell.files.simulation.velocity_timeout_ms * 1e-3
    assert travel(cell.twin.truth, begun) < math.degrees(0.25 * (timeout + 0.1))


@pytest.mark.parametrize(
    ("settings", "after"),
    [("", 0.3), (HOLD_ONLY, 0.8), *thorough(("", 0.8), (HOLD_ONLY, 0.3), *product(SINGLE, AFTER))],
)
def test_release_of_a_hold_moves_nothing_after_stop(cell: VirtualCell, after: float) -> None:
    """STOP clears the program of the robot that is held; the robot stays."""
    run_program(cell)
    cell.schedule.run(after)
    cell.real.signal("hold", False)
    both_stood(cell, cell.schedule.now)
    assert cell.operate("STOP").success
    both_stood(cell, cell.schedule.now)
    rested = cell.schedule.now
    nothing_moves(cell, rested)
    cell.real.signal("hold", True)
    nothing_moves(cell, rested)
