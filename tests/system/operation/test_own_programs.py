"""A program that the robot's own pendant starts is judged; a REFUSED one is told, or held."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from harness.live_cell import LiveCell
from harness.processes import wait_until
from harness.wires.gateway_client import command_over, state_over
from harness.yaml_files import add_program, changed_yaml, copy_configuration

pytestmark = [pytest.mark.system, pytest.mark.thorough]
"""tests/unit/twin_controller/services/test_own_programs.py tells both settings each time."""

AWAY_MM, NEAR_MM = -160.0, -169.5
P = "GP1: UF : 0, UT : 1, J2= 0 deg, J4= 0 deg, E1= 0 deg"
NARROW = f"""/PROG NARROW
/MN
  1:J P[1] 2% FINE ;
  2:J P[2] 20% FINE ;
  3:J P[3] 10% FINE ;
/POS
P[1]{{ {P}, J1= 20 deg, J3= {AWAY_MM} mm
}};
P[2]{{ {P}, J1= 0 deg, J3= {AWAY_MM} mm
}};
P[3]{{ {P}, J1= 0 deg, J3= {NEAR_MM} mm
}};
/END
"""
"""The nozzle comes to 0.5 mm above parts that it does not stand over; nothing is touched by it.

Slow at first, so that it is judged long before its last line.
"""
SAID = "the robot's own program NARROW"
WHY = "the nozzle would hit part_"


@contextmanager
def judged_cell(folder: Path, hold: bool) -> Iterator[LiveCell]:
    """Give a ready cell with a judge, and with the program on the robot's pendant."""
    config = copy_configuration(folder / "changed")
    add_program(config, NARROW)
    changed_yaml(config / "what_if.yaml", config, ["hold_own_programs"], hold)
    changed_yaml(config / "what_if.yaml", config, ["gate_program_timeout_ms"], 20000.0)
    with LiveCell(folder).ready(config=config) as cell:
        judge = cell.start_node("what_if")
        wait_until(lambda: "is ready" in judge.output or judge.poll() is not None, 30.0, "a judge")
        assert judge.poll() is None, judge.tail()
        cell.make_ready()
        yield cell


def start(cell: LiveCell) -> None:
    """Start the program on the robot's own pendant."""
    for keys in (("override", "100"), ("run", "NARROW")):
        cell.pendant(*keys)


def judged(cell: LiveCell) -> dict[str, Any]:
    """Wait until the judgement is shown; return the state."""

    def shown() -> dict[str, Any]:
        state = state_over(cell.gateway_port)
        return state if SAID in state.get("judge", "") else {}

    return wait_until(shown, 30.0, "a judgement in twin_controller/state")


def height_mm(cell: LiveCell) -> float:
    """Return where joint_3 of the real robot is."""
    return cell.real_joints()[2]


def test_refused_program_is_held_before_it_harms_and_goes_on_by_the_operator(
    tmp_path: Path,
) -> None:
    """PAUSE holds both sides high above the part; RESUME is the operator's, and holds."""
    with judged_cell(tmp_path, hold=True) as cell:
        start(cell)
        assert f"{SAID}: refused: REFUSED at" in (said := judged(cell)["judge"]) and WHY in said
        wait_until(lambda: cell.mode() == "PAUSED", 20.0, "PAUSED")
        before = cell.real_joints()
        wait_until(lambda: cell.real_joints() == cell.real_joints(), 10.0, "a robot that stands")
        assert height_mm(cell) == pytest.approx(AWAY_MM, abs=0.1)
        assert before[0] < 20.5
        answer = command_over(cell.gateway_port, "RESUME")
        assert answer["success"], answer
        wait_until(lambda: abs(height_mm(cell) - NEAR_MM) < 0.1, 40.0, "the program's end")
        wait_until(lambda: cell.mode() == "IDLE", 20.0, "a ready pair")
        log = (cell.output / "log" / "twin_controller.log").read_text(encoding="utf-8")
        assert log.count("is held (hold_own_programs)") == 1, log


def test_refused_program_is_only_told_by_the_shipped_setting(tmp_path: Path) -> None:
    """It runs to its end; what the judge has said stands in the state."""
    with judged_cell(tmp_path, hold=False) as cell:
        start(cell)
        assert f"{SAID}: refused: REFUSED at" in (said := judged(cell)["judge"]) and WHY in said
        wait_until(lambda: abs(height_mm(cell) - NEAR_MM) < 0.1, 40.0, "the program's end")
        wait_until(lambda: cell.mode() == "IDLE", 20.0, "a ready pair")
        log = (cell.output / "log" / "twin_controller.log").read_text(encoding="utf-8")
        assert "PAUSED" not in log and "hold_own_programs" not in log
