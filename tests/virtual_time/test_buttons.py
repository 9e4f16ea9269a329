"""Buttons of the person at the robot, in virtual time: who has pressed one releases it.

The real core, the real stand-in and the real twin. The person comes first: no command of anybody
else undoes what he has pressed, and his own release moves nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.plants.variants import Variant
from harness.running.thorough import thorough
from harness.scenes.copies import copied
from harness.scenes.steps import ROBOT, both_stood, go, nothing_moves, run_program
from harness.scenes.truth import standstill_since, travel
from harness.virtual_cell.cell import VirtualCell

HELD = "robot is held at its pendant"
DELIVERED = Variant("delivered", plant="ideal", kit=True).files(ROBOT)
"""Its pendant does not say that somebody holds it there."""
PRESSED = "the emergency stop at the robot is pressed"


@pytest.fixture
def cell(request: pytest.FixtureRequest) -> Iterator[VirtualCell]:
    """Give an idle cell whose robot runs at its full override."""
    with VirtualCell(getattr(request, "param", ROBOT)) as made:
        made.connect()
        made.real.robot.write_override(100)
        yield made


def test_reset_does_not_undo_the_emergency_stop_of_the_person_at_the_robot(
    cell: VirtualCell,
) -> None:
    """RESET says that the button is pressed; nothing moves until it is released and reset again."""
    go(cell, 30.0)
    cell.schedule.run(0.3)
    cell.real.signal("panel_imstp", False)
    cell.wait_whatever(lambda: cell.mode == "ESTOP", 1.0, "ESTOP")
    assert PRESSED in cell.why
    both_stood(cell, cell.schedule.now)
    rested = cell.schedule.now
    answer = cell.operate("RESET")
    assert not answer.success and PRESSED in answer.message
    for command in ("ALIGN", "RESUME", "HOME"):
        assert not cell.operate(command).success
    nothing_moves(cell, rested)
    assert cell.mode == "ESTOP" and not cell.real.shown.outputs.sysrdy
    cell.real.signal("panel_imstp", True)
    nothing_moves(cell, rested)
    assert cell.mode == "ESTOP" and not cell.real.shown.outputs.sysrdy
    assert cell.operate("RESET").success
    cell.wait_whatever(lambda: cell.mode == "STOPPED", 5.0, "STOPPED")
    nothing_moves(cell, rested)


@pytest.mark.parametrize("cell", [DELIVERED, *thorough(ROBOT)], indirect=True)
def test_stop_does_not_release_the_hold_of_the_person_at_the_robot(cell: VirtualCell) -> None:
    """A robot that is held at its pendant is moved by nobody until it is let go there."""
    run_program(cell)
    cell.schedule.run(0.5)
    cell.real.signal("panel_hold", False)
    both_stood(cell, cell.schedule.now)
    assert cell.operate("STOP").success
    both_stood(cell, cell.schedule.now)
    rested = cell.schedule.now
    assert cell.operate("ALIGN").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 10.0, "IDLE")
    for command in ("HOME", "MOVE_JOINTS"):
        answer = cell.operate(command, target=(0.3, 0.0, -0.1, 0.0), speed_percent=20.0)
        assert not answer.success and HELD in answer.message
    nothing_moves(cell, rested)
    cell.real.signal("panel_hold", True)
    nothing_moves(cell, rested)
    cell.wait_whatever(lambda: cell.mode == "IDLE", 10.0, "IDLE")
    go(cell, 100.0)
    cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "the end of the move")


@pytest.mark.parametrize(
    ("cell", "after_ms"),
    [(ROBOT, 0), (DELIVERED, 60), *thorough((ROBOT, 60), (DELIVERED, 0))],
    indirect=["cell"],
)
def test_a_hold_before_the_robot_has_begun_pauses_the_pair_at_once(
    cell: VirtualCell, after_ms: int
) -> None:
    """It has begun nothing that it could go on with, or its program waits: neither side moves."""
    go(cell, 60.0)
    cell.schedule.run(after_ms * 1e-3)
    cell.real.signal("panel_hold", False)
    pressed = cell.schedule.now
    cell.wait_whatever(lambda: cell.mode == "PAUSED", 0.15, "PAUSED")
    rested = both_stood(cell, cell.schedule.now)
    assert travel(cell.twin.truth, pressed) < 2.0
    nothing_moves(cell, rested)
    cell.real.signal("panel_hold", True)
    nothing_moves(cell, rested)
    # A robot that had no program yet has none to go on with.
    assert cell.operate("RESUME" if cell.mode == "PAUSED" else "ALIGN").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "IDLE")


def test_resume_says_that_the_robot_is_held_at_its_pendant(cell: VirtualCell) -> None:
    """The operator's RESUME releases the operator's pause alone."""
    go(cell, 80.0)
    cell.schedule.run(0.3)
    assert cell.operate("PAUSE").success
    both_stood(cell, cell.schedule.now)
    cell.real.signal("panel_hold", False)
    cell.schedule.run(0.2)
    rested = cell.schedule.now
    answer = cell.operate("RESUME")
    assert not answer.success and HELD in answer.message
    nothing_moves(cell, rested)
    cell.real.signal("panel_hold", True)
    nothing_moves(cell, rested)
    assert cell.operate("RESUME").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "the end of the move")


def test_speed_never_raises_the_override_of_the_person_at_the_robot(cell: VirtualCell) -> None:
    """A cap only lowers, and only a program of the robot's own; what it took stays taken.

    The person may have set just that meanwhile.
    """

    def override_after(percent: float) -> tuple[int, str]:
        answer = cell.operate("SPEED", speed_percent=percent)
        assert answer.success
        cell.schedule.run(1.5)
        return cell.real.shown.override, answer.message

    cell.real.robot.write_override(30)
    cell.schedule.run(1.0)
    override, text = override_after(100.0)
    assert override == 30
    assert "keeps its own override of 30 %: raise it there" in text
    assert override_after(20.0)[0] == 30, "the cap is in the set points"
    run_program(cell)
    cell.schedule.run(1.0)
    assert cell.mode == "REAL_LEADS" and cell.real.shown.override == 20
    override, text = override_after(100.0)
    assert override == 20
    assert "keeps its own override of 20 %: raise it there" in text
    cell.real.robot.write_override(10)
    cell.schedule.run(1.0)
    assert override_after(80.0)[0] == 10


@pytest.fixture(scope="module")
def arrived() -> Iterator[VirtualCell]:
    """Give a cell whose robot has just arrived behind a move of the twin; for copies of it."""
    with VirtualCell(ROBOT) as cell:
        cell.connect()
        cell.real.robot.write_override(100)
        begun = cell.schedule.now
        go(cell, 80.0)
        cell.schedule.run(1.0)

        def stands() -> bool:
            since = cell.schedule.now - 0.02
            still = standstill_since(cell.real.truth, since) == since
            return still and travel(cell.real.truth, begun) > 60.0

        cell.wait_whatever(stands, 15.0, "the end of the way")
        yield cell


@pytest.mark.parametrize("late", [0.0, *thorough(0.05, 0.1, 0.15, 0.2, 0.3)])
def test_a_start_at_the_pendant_right_behind_a_twins_move_is_taken(
    arrived: VirtualCell, late: float
) -> None:
    """While the stream that followed it comes to its end; nobody presses twice."""

    def start(cell: VirtualCell) -> None:
        cell.schedule.run(late)
        pressed = cell.schedule.now
        run_program(cell)
        assert cell.schedule.now < pressed + 0.6
        cell.schedule.run(2.0)
        assert cell.mode == "REAL_LEADS" and cell.real.running
        assert travel(cell.real.truth, pressed) > 10.0

    copied(lambda: start(arrived))


def test_a_start_at_the_pendant_that_waits_for_a_stream_begins_after_no_stop(
    arrived: VirtualCell,
) -> None:
    """HOLD, which a stop takes away, clears it: what was asked for before never begins after."""

    def stopped(cell: VirtualCell) -> None:
        cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "IDLE")
        home = (0.0, 0.0, -0.1, 0.0)
        assert cell.operate("MOVE_JOINTS", target=home, speed_percent=80.0).success
        cell.wait_until(lambda: cell.real.shown.control_type == 2, 5.0, "the stream")
        number = cell.files.program_number("TWO_POINT")
        cell.real.signal(f"panel_run{number}", None)
        cell.real.signal("panel_hold", False)
        cell.schedule.run(0.5)
        cell.real.signal("panel_hold", True)
        assert cell.operate("STOP").success
        rested = both_stood(cell, cell.schedule.now)
        nothing_moves(cell, rested)

    copied(lambda: stopped(arrived))
