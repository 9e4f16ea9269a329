"""Background logic of the user: executed each 8 ms, beside all programs, and stopped by none."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec
import pytest
from fanuc_emulator.config import load_programs
from fanuc_emulator.snapshot import WatchdogState
from fanuc_emulator.tp.executor import ProgramState
from fanuc_emulator.tp.registers import Registers
from scara_config import ConfigError
from scara_config.programs.tp.execution import background
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Indexed, Program

if TYPE_CHECKING:
    from conftest import Bench

FLAG = Indexed("F", (30.0,))


def program(*lines: str) -> Program:
    """Return a program of these lines."""
    return Program("LOGIC", tuple(map(read_line, lines)))


def with_logic(bench: Bench, *lines: str) -> Bench:
    """Return a stand-in that executes these lines as background logic."""
    config = msgspec.structs.replace(bench.config, background=(program(*lines),))
    made = type(bench)(config, bench.robot, load_programs(bench.robot))
    made.controller.write_override(100)
    return made


@pytest.mark.parametrize("on", [False, True])
def test_a_jump_leaves_out_what_is_between(on: bool) -> None:
    """With a condition and without one."""
    memory = Registers()
    memory.write(FLAG, on)
    lines = ("IF (F[30]),JMP LBL[2]", "R[30]=(1)", "JMP LBL[1]", "LBL[2]", "R[30]=(2)", "LBL[1]")
    background(program(*lines))(memory)
    assert memory.read(Indexed("R", (30.0,))) == (2.0 if on else 1.0)


@pytest.mark.parametrize(
    "line",
    [
        *("WAIT 1(sec)", "CALL OTHER", "PAUSE", "R[R[1]]=(1)", "PAYLOAD[1]", "JMP LBL[R[1]]"),
        *("JMP LBL[1]", "IF DI[1]=ON,R[1]=(1)", "IF (DI[1]),CALL OTHER"),
        *("IF (DI[1]),DO[1]=PULSE,0.5sec", "DO[1]=PULSE", "TIMER[1]=START", "TIMER[1]=RESET"),
        "IF (DI[1]),M[1]=(DI[2])",
    ],
)
def test_what_background_logic_does_not_have_is_refused(line: str) -> None:
    """A jump back would not end, and a condition without brackets is no mixed logic."""
    with pytest.raises(ConfigError, match=r"line 2 of LOGIC: .*background logic has assignments"):
        background(program("LBL[1]", line))


def test_a_user_alarm_is_told_and_stops_no_program(bench: Bench) -> None:
    """FAULT is on. It is told once, and anew when its line was left out for a scan."""
    bench = with_logic(bench, "IF (!F[30]),JMP LBL[1]", "UALM[2]", "LBL[1]")
    bench.start_moving()
    bench.controller.registers.write(FLAG, True)
    bench.run(0.02)
    alarm = bench.now.alarm
    assert alarm is not None and alarm.code.text == "INTP-213 UALM"
    assert alarm.cause == "UALM[2] in line 2 of LOGIC" and bench.now.outputs.fault
    assert bench.now.program_state is ProgramState.RUNNING and bench.moving
    bench.pulse("fault_reset")
    assert not bench.now.outputs.fault
    for on in (False, True):
        bench.controller.registers.write(FLAG, on)
        bench.run(0.02)
    assert bench.now.outputs.fault


def test_a_number_that_is_no_state_of_the_watch_is_none(bench: Bench) -> None:
    """A program may set R[9]: then nobody watches, and the stand-in goes on."""
    bench = with_logic(bench, "R[9]=(7)")
    bench.controller.write_heartbeat(5)
    assert bench.run(0.05).watchdog_state is WatchdogState.DISARMED


@pytest.mark.parametrize("line", ["R[30]=(1/R[31])", "PR[5,1]=(1)"])
def test_a_line_that_cannot_be_executed_ends_its_program_alone(bench: Bench, line: str) -> None:
    """The alarm names it; the robot's program goes on, and the watch over the heartbeat."""
    counted = Indexed("R", (32.0,))
    bench = with_logic(bench, "R[32]=(R[32]+1)", f"IF (F[30]),{line}")
    bench.start_moving()
    bench.controller.registers.write(FLAG, True)
    bench.run(0.01)
    before = bench.controller.registers.read(counted)
    bench.run(0.1)
    assert bench.now.alarm is not None and "line 2 of LOGIC" in bench.now.alarm.cause
    assert bench.now.program_state is ProgramState.RUNNING and bench.now.outputs.fault
    assert bench.controller.registers.read(counted) == before
    bench.controller.write_heartbeat(5)
    bench.run(1.0)
    assert bench.now.program_state is ProgramState.ABORTED
