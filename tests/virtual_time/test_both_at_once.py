"""Both sides started at once: one leads, the other side's motion ends, and they stay together.

A program on the robot's pendant beside a move of the twin, or of the operator, with every gap. In
virtual time: the real core, the real stand-in and the real twin. HYPOTHESIS_SEARCH=1 tries 5 ms
after the other, from 100 before to 100 after.
"""

from __future__ import annotations

from itertools import pairwise, product

import pytest
from harness.running.thorough import SEARCH, thorough
from harness.scenes.steps import AWAY, ROBOT
from harness.scenes.truth import farthest_apart_mm
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files

APART_MM = 0.05 * 650.0
"""5 % of the reach."""
EACH_TIME = (*thorough(("operator", -10)), ("move_to", 0))
"""Each millisecond of two ideal sides, whoever leads, is a matter of core/test_arbitration."""
OTHERS = ("move_to", "operator")
BEGIN_S = 0.2
LEADS = ("REAL_LEADS", "TWIN_LEADS", "OPERATOR_LEADS")


@pytest.mark.parametrize(
    ("other", "gap_ms"),
    list(product(OTHERS, range(-100, 101, 5))) if SEARCH else EACH_TIME,
)
def test_both_sides_started_at_once_stay_together(other: str, gap_ms: int) -> None:
    """One leader after the other, together at rest in the end, never PAUSED, never 5 % apart."""
    with VirtualCell(ROBOT) as cell:
        cell.connect()
        cell.real.robot.write_override(100)
        cell.schedule.run(0.5)
        begun = len(cell.decisions)
        program = cell.files.program_number("TWO_POINT")
        answers: list[tuple[bool, str]] = []

        def move() -> None:
            if other == "operator":
                cell.operate("MOVE_JOINTS", target=AWAY, speed_percent=30.0)
            else:
                point = cell.files.robot.positions_m["P2"]
                cell.twin.move_to.begin(point, 50.0, "", lambda *answer: answers.append(answer))

        cell.schedule.after(BEGIN_S, lambda: cell.real.pendant(100.0, program))
        cell.schedule.after(BEGIN_S + gap_ms * 1e-3, move)
        cell.wait_whatever(lambda: cell.mode in LEADS, 3.0, "a leader")
        cell.wait_until(lambda: cell.mode == "IDLE", 30.0, "IDLE")
        cell.schedule.run(1.0)
        assert cell.mode == "IDLE"
        modes = [decision.mode_after for decision in cell.decisions[begun:]]
        assert set(modes) <= {*LEADS, "IDLE"}
        leads = [(a, b) for a, b in pairwise(modes) if a in LEADS and b in LEADS and a != b]
        assert len(leads) <= 1 and all(b == "REAL_LEADS" for _, b in leads)
        assert farthest_apart_mm(cell.real.truth, cell.twin.truth) < APART_MM
        if other == "move_to":
            assert answers, "whoever asked is told how it ended"


def test_a_stream_that_waited_for_the_end_of_a_program_moves_nothing() -> None:
    """RSR1 comes right behind the press of that program's key, and starts the stream at its end."""
    with VirtualCell(load_files(ROBOT, plant="field")) as cell:
        cell.connect()
        begun = len(cell.decisions)
        program = cell.files.program_number("TWO_POINT")
        cell.operate("MOVE_JOINTS", target=AWAY, speed_percent=30.0)
        cell.real.pendant(100.0, program)
        cell.wait_until(lambda: cell.real.running, 3.0, "the program")
        cell.wait_until(lambda: not cell.real.running, 30.0, "its end")
        cell.schedule.run(0.2)
        _, ended, _ = cell.real.truth[-1]
        cell.wait_until(lambda: cell.mode == "IDLE", 5.0, "IDLE")
        cell.schedule.run(1.0)
        triggers = [decision.trigger for decision in cell.decisions[begun:]]
        assert triggers[-1] == "AT_REST_STREAMED", triggers
        _, stands, _ = cell.real.truth[-1]
        assert max(abs(a - b) for a, b in zip(stands, ended)) < 1e-3
        assert cell.real.shown.control_type == 0
