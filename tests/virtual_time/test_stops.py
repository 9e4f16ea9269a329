"""Stops and releases in virtual time: the real core, the real stand-in, the real twin."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

import pytest
from harness.running.thorough import thorough
from harness.scenes.steps import AT_REST_DEG_MM, ROBOT, both_stood, go, nothing_moves, run_program
from harness.scenes.truth import travel
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files

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
