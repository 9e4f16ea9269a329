"""An alarm of the robot's own, severity STOP: both sides stand, and nothing goes on by itself.

The robot's program is paused, not ended; it may go on after RESET, where a person lets it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import pytest
from fanuc_emulator.tp.executor import ProgramState
from harness.running.thorough import thorough
from harness.scenes.steps import AWAY, ROBOT, both_stood, go, nothing_moves
from harness.virtual_cell.cell import VirtualCell
from harness.virtual_cell.files import load_files
from scara_config.programs.files import Taught
from scara_config.programs.tp.execution import flow_of
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Program
from scara_config.set_up.kit_map import kit_map

from fanuc_emulator import alarms

READY, ENDS_NOTHING = {}, {"cstopi_for_abort": False}
"""As shipped, and where CSTOPI ends no program."""
STANDS_S = 0.45
"""The alarm seen, the twin told, its ramp from 30 % speed."""
LINES = "J P[1] 50% FINE;PR[3]=LPOS;J P[2] 50% FINE;PR[3,1]=900;L PR[3] 200mm/sec FINE"
FAR = tuple(map(read_line, LINES.split(";")))
"""Its last line leads 900 mm away."""


@pytest.fixture
def cell(request: pytest.FixtureRequest) -> Iterator[VirtualCell]:
    """Give an idle cell whose robot has a program that leads too far."""
    files = load_files(ROBOT, settings=request.param)
    taught = next(iter(files.programs.values()))
    places = dict(zip((1, 2), ((0.1, 1.2, -0.1, 0.0, 0.0), (0.5, 0.9, -0.1, 0.0, 0.0))))
    far = Taught(flow_of(Program(taught.name, FAR), "FAR"), places)
    layout = kit_map(files.layout)
    with VirtualCell(dataclasses.replace(files, programs={2: far}, layout=layout)) as made:
        made.connect()
        made.real.robot.write_override(100)
        yield made


def stands_in_a_fault(cell: VirtualCell, since: float) -> None:
    """Hold the pair to a fault: both stood soon, nothing goes on.

    The fault is a stop too: CSTOPI ends the paused program where it ends programs.
    """
    cell.wait_whatever(lambda: cell.mode == "FAULT", 2.0, "FAULT")
    assert both_stood(cell, since) - since < STANDS_S
    nothing_moves(cell, cell.schedule.now)
    ends = cell.files.emulator.settings.cstopi_for_abort
    state = ProgramState.ABORTED if ends else ProgramState.PAUSED
    assert cell.mode == "FAULT" and cell.real.shown.program_state is state
    assert not cell.operate("MOVE_JOINTS", target=AWAY, speed_percent=30.0).success


@pytest.mark.parametrize("cell", [READY, *thorough(ENDS_NOTHING)], indirect=True)
def test_a_set_point_that_the_robot_refuses_stops_the_pair_and_the_stream_serves_again(
    cell: VirtualCell,
) -> None:
    """A stranger's write to PR[1] during a move: RESET, ALIGN, then the twin leads again.

    A stream that CSTOPI does not end goes on in stopping/test_hold_only.py each time.
    """
    go(cell, 30.0)
    cell.schedule.run(0.4)
    begun = cell.schedule.now
    for _ in range(200):
        cell.real.robot.write_setpoint((9.0, 0.0, -0.1, 0.0, 0.0))
        cell.schedule.run(0.002)
        if cell.real.shown.alarm is not None:
            break
    assert cell.real.shown.alarm is not None
    assert cell.real.shown.alarm.code is alarms.POSITION_LIMIT
    stands_in_a_fault(cell, begun)
    assert cell.operate("RESET").success
    cell.schedule.run(1.0)
    assert cell.real.shown.alarm is None
    nothing_moves(cell, cell.schedule.now)
    assert cell.operate("ALIGN").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "IDLE")
    cell.move_to(cell.files.robot.positions_m["P2"], speed_percent=60.0)
    cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "IDLE")


@pytest.mark.parametrize("cell", [ENDS_NOTHING, *thorough(READY)], indirect=True)
def test_a_line_that_leads_too_far_stops_the_twin_with_the_robot_until_somebody_lets_it_go_on(
    cell: VirtualCell,
) -> None:
    """While the robot leads: paused before that line; START tries it again, behind RESET."""
    cell.real.pendant(100.0, 2)
    cell.wait_whatever(lambda: cell.mode == "REAL_LEADS", 3.0, "REAL_LEADS")
    cell.wait_whatever(lambda: cell.real.shown.alarm is not None, 20.0, "the alarm")
    stands_in_a_fault(cell, cell.schedule.now)
    cell.real.signal("panel_start", None)
    nothing_moves(cell, cell.schedule.now)
    assert cell.operate("RESET").success
    cell.schedule.run(0.5)
    assert cell.operate("ALIGN").success
    cell.wait_whatever(lambda: cell.mode == "IDLE", 20.0, "IDLE")
    if cell.real.shown.program_state is ProgramState.PAUSED:
        cell.real.signal("panel_start", None)
        cell.schedule.run(0.5)
    else:
        cell.real.pendant(100.0, 2)
        cell.wait_whatever(lambda: cell.real.shown.alarm is not None, 20.0, "the alarm")
    stands_in_a_fault(cell, cell.schedule.now)
    assert cell.real.shown.program_line == 5
