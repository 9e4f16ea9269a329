"""Answers that are true, in virtual time: a move that was accepted and failed says so."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.running.thorough import thorough
from harness.scenes.steps import ROBOT
from harness.virtual_cell.cell import VirtualCell

NEAR = (0.4, 0.3, -0.10, 0.0)


@pytest.fixture
def cell() -> Iterator[VirtualCell]:
    """Give an idle cell."""
    with VirtualCell(ROBOT) as made:
        made.connect()
        yield made


def failures(cell: VirtualCell) -> list[str]:
    """Return why moves have failed, as it was decided."""
    return [made.why for made in cell.decisions if made.trigger == "MOVE_FAILED"]


@pytest.mark.parametrize("late", [*thorough(0.005), 0.03, *thorough(0.08)])
def test_a_late_zero_of_the_move_before_ends_no_move(cell: VirtualCell, late: float) -> None:
    """The last packets of a trim may come when the next move is announced; nothing moves yet."""
    assert cell.operate("MOVE", target=(0.55, 0.1, 0.1), speed_percent=40.0).success
    cell.wait_still(0.2)
    assert cell.operate("MOVE_JOINTS", target=NEAR, speed_percent=40.0).success
    cell.schedule.run(late)
    cell.twin.command_velocity("joint_1", 0.0)
    cell.wait_still(0.5)
    assert failures(cell) == []
    assert cell.twin.truth[-1][1] == pytest.approx(NEAR, abs=5e-4)


@pytest.mark.parametrize("mover", ["move_to", *thorough("operator")])
def test_a_program_starts_on_the_pendant_as_soon_as_the_pair_is_idle(
    cell: VirtualCell, mover: str
) -> None:
    """The robot refuses it while its stream program runs, so RUN is refused with that until then.

    The stream ends 20 ms after the answer of move_to, and once both have rested after a move of
    the operator.
    """
    cell.real.robot.write_override(100)
    cell.schedule.run(0.3)
    answers: list[tuple[bool, str]] = []
    if mover == "operator":
        assert cell.operate("MOVE_JOINTS", target=NEAR, speed_percent=50.0).success
        cell.wait_until(lambda: cell.mode == "OPERATOR_LEADS", 1.0, "OPERATOR_LEADS")
    else:
        begin = cell.twin.move_to.begin
        begin((0.51, 0.16, 0.10), 50.0, "", lambda *answer: answers.append(answer))
        cell.wait_until(lambda: cell.mode == "TWIN_LEADS", 1.0, "TWIN_LEADS")
    assert "STOP first" in cell.refusals()["RUN"]
    if mover == "move_to":
        cell.wait_until(lambda: bool(answers), 5.0, "the answer")
        cell.schedule.run(0.03)
        assert cell.mode == "IDLE", "the answer of move_to ends the lead"
    cell.wait_until(lambda: cell.mode == "IDLE", 5.0, "IDLE")
    cell.wait_until(lambda: cell.refusals()["RUN"] == "", 0.1, "RUN")
    cell.real.pendant(100.0, cell.files.program_number("TWO_POINT"))
    cell.wait_until(lambda: cell.mode == "REAL_LEADS", 0.3, "REAL_LEADS")
    assert cell.real.shown.alarm is None
