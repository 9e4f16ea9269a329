"""Programs, executed: moves, waits, calls, states."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from fanuc_emulator.alarms import RefusedError
from fanuc_emulator.tp.executor import MOST_LINES, Executor, ProgramState, Step, stream_program
from fanuc_emulator.tp.motions import StreamStep
from fanuc_emulator.tp.registers import Registers
from harness.programs import program_of
from scara_config.programs.files import Taught
from scara_config.programs.steps import MoveStep, WaitStep
from scara_config.programs.tp.execution import flow_of
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Indexed, Program
from scara_config.programs.tp.values import ExecutionError, Pose

if TYPE_CHECKING:
    from conftest import Bench

MOVE = MoveStep(1, (0.0,), 50.0, True)
NEXT = MoveStep(2, (1.0,), 50.0, False)
POSITIONS = {1: (0.0,), 2: (1.0,)}
DT = 0.002


def taught(*lines: str, name: str = "TEST", group: str = "*,*,*,*,*") -> Taught:
    """Return a program of these lines."""
    program = Program(name, tuple(map(read_line, lines)), (), {"DEFAULT_GROUP": group})
    return Taught(flow_of(program, name), POSITIONS)


def start(*steps: MoveStep | WaitStep, delay: float = 0.0) -> Executor:
    """Return an executor that runs the steps."""
    executor = Executor(Registers())
    executor.start(program_of("TEST", steps), delay)
    return executor


def run(*lines: str, memory: Registers | None = None, called: Taught | None = None) -> Executor:
    """Return an executor that runs the lines."""
    executor = Executor(memory or Registers(), {called.name: called} if called else None)
    executor.start(taught(*lines), 0.0)
    return executor


def stepped(executor: Executor, count: int = 1) -> list[Step | None]:
    """Let periods pass in which all motion is at its end."""
    return [executor.advance(DT, True, True) for _ in range(count)]


def test_first_step_waits_for_the_start_delay() -> None:
    """Nothing begins before the delay is over, counted in whole steps."""
    executor = start(MOVE, delay=0.006)
    assert stepped(executor, 3) == [None, None, MOVE]
    assert executor.step == MOVE


@pytest.mark.parametrize(
    ("step", "path_done", "arrived", "goes_on"),
    [
        (MOVE, False, False, False),
        (MOVE, True, False, False),
        (MOVE, True, True, True),
        (NEXT, False, False, False),
        (NEXT, True, False, True),
    ],
)
def test_a_move_ends_by_its_termination(
    step: MoveStep, path_done: bool, arrived: bool, goes_on: bool
) -> None:
    """FINE waits for the motors, CNT for the path only."""
    executor = start(step, MOVE)
    assert stepped(executor) != [None]
    began = executor.advance(DT, path_done, arrived)
    assert began == (MoveStep(2, (0.0,), 50.0, True) if goes_on else None)


def test_a_wait_lasts_its_time_and_the_program_ends_after_its_last_step() -> None:
    """After the last line the state is ABORTED, the line stays."""
    executor = start(WaitStep(1, 0.01), NEXT)
    assert stepped(executor, 7).index(NEXT) == 5
    assert executor.state is ProgramState.ABORTED
    assert executor.line == 2


def test_a_paused_program_stands_still_and_goes_on_where_it_was() -> None:
    """Pause freezes waits too; resume does not start anything anew."""
    executor = start(WaitStep(1, 0.004), NEXT)
    stepped(executor)
    executor.pause()
    assert stepped(executor, 100) == [None] * 100
    executor.resume()
    assert stepped(executor, 2) == [None, NEXT]


def test_stream_takes_a_set_point_in_each_period() -> None:
    """Its loop is executed; R[2] counts as it is then, and nothing but an abort ends it."""
    speed = [50.0]
    executor = Executor(Registers({"R[2]": lambda: speed[0], "JPOS": lambda: Pose((0.0,) * 9)}))
    executor.start(stream_program("RSR0101"), 0.0)
    assert stepped(executor, 2) == [StreamStep(5, 50.0)] * 2
    speed[0] = 20.0
    assert stepped(executor) == [StreamStep(5, 20.0)]
    assert executor.state is ProgramState.RUNNING


def test_endless_loop_without_motion_goes_on_in_the_next_period() -> None:
    """The controller never hangs in it, and it can be ended."""
    memory = Registers()
    executor = run("LBL[1]", "R[5]=R[5]+1", "JMP LBL[1]", memory=memory)
    assert stepped(executor, 3) == [None] * 3
    assert memory.read(Indexed("R", (5.0,))) == pytest.approx(MOST_LINES, abs=1)
    assert executor.state is ProgramState.RUNNING
    executor.abort()
    assert executor.state is ProgramState.ABORTED


def test_condition_is_waited_for() -> None:
    """It is asked in each period, from the next one on."""
    vacuum = [False]
    switched: list[object] = []
    memory = Registers({"RI[1]": lambda: vacuum[0]}, {"RO[1]": switched.append})
    executor = run("RO[1]=ON", "WAIT RI[1]=ON", "J P[2] 50% CNT0", memory=memory)
    began = stepped(executor, 3)
    assert switched == [True] and executor.line == 2
    assert began[1:] == [None, None]
    vacuum[0] = True
    assert stepped(executor) == [MoveStep(3, (1.0,), 50.0, False)]


def test_answer_of_the_gripper_that_is_overdue_is_told_once() -> None:
    """With its line; it is waited for anew then, and a line with a TIMEOUT is left alone."""
    executor = run("RO[1]=ON", "WAIT RI[1:vacuum]=ON")
    stepped(executor, 5)
    assert executor.overdue(0.0071) == "RI[1:vacuum] is not ON in line 2"
    assert executor.overdue(0.0) == ""
    stepped(executor)
    assert executor.overdue(0.001) != ""
    other = run("WAIT RI[1]=ON TIMEOUT,LBL[1]", "LBL[1]")
    stepped(other, 5)
    assert other.overdue(0.0) == ""


def test_condition_that_takes_too_long_leads_to_its_label() -> None:
    """After $WAITTMOUT, in hundredths of a second."""
    lines = ("$WAITTMOUT=2", "WAIT DI[1]=ON TIMEOUT,LBL[1]", "J P[1] 50% FINE", "LBL[1]")
    executor = run(*lines, "J P[2] 50% FINE")
    assert stepped(executor, 12)[10] == MoveStep(5, (1.0,), 50.0, True)


def test_called_program_runs_with_its_arguments_and_comes_back() -> None:
    """The line that is shown is that of the program that was started."""
    called = taught("J P[AR[1]] AR[2]% FINE", "END", "J P[1] 1% FINE", name="OTHER")
    executor = run("R[1]=2", "CALL OTHER(R[1],30)", "J P[1] 50% FINE", called=called)
    assert stepped(executor, 2) == [
        MoveStep(1, (1.0,), 30.0, True),
        MoveStep(3, (0.0,), 50.0, True),
    ]
    assert executor.line == 3
    assert stepped(executor) == [None] and executor.state is ProgramState.ABORTED


def test_words_pause_and_end_a_program() -> None:
    """PAUSE is left by a resume, in the line behind it; ABORT ends the caller too."""
    executor = run("PAUSE", "J P[1] 50% FINE")
    assert stepped(executor, 2) == [None, None]
    assert (executor.state, executor.line) == (ProgramState.PAUSED, 1)
    executor.resume()
    assert stepped(executor) == [MoveStep(2, (0.0,), 50.0, True)]
    ended = run("CALL OTHER", "J P[1] 50% FINE", called=taught("ABORT", name="OTHER"))
    assert stepped(ended) == [None] and ended.state is ProgramState.ABORTED


def test_started_at_its_cursor_a_program_begins_with_the_line_that_was_ended() -> None:
    """Registers are as they were: a loop goes on with its round."""
    memory = Registers()
    executor = run("FOR R[51]=1 TO 2", "J P[1] 50% FINE", "ENDFOR", memory=memory)
    stepped(executor, 2)
    executor.abort()
    assert (executor.cursor, memory.read(Indexed("R", (51.0,)))) == (1, 2.0)
    assert executor.program is not None
    executor.start(executor.program, 0.0, executor.cursor)
    assert stepped(executor, 2) == [MoveStep(2, (0.0,), 50.0, True), None]
    assert (executor.state, executor.cursor) == (ProgramState.ABORTED, 0)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("J P[9] 50% FINE", r"line 1 of TEST: J P\[9\] 50% FINE: P\[9\] is not taught"),
        ("J PR[2] 50% CNT0", r"PR\[2\] was never set"),
        ("J P[1] 50mm/sec FINE", "a joint motion has a speed in %, sec or msec, not in mm/sec"),
        ("L P[1] 50% FINE", "the tool has no speed in %"),
        ("L P[1] 9000mm/sec FINE", r"a speed of 9000 mm/sec is outside \]0, 5000\]"),
        ("J P[1] 50% CNT200", r"CNT of 200 is outside \[0, 100\]"),
        ("A P[1] 50mm/sec FINE", "a motion A is not executed, J, L and C are"),
        ("J P[1] 50% FINE INC", "the option INC is not executed"),
        ("R[1]=P[1]+1", r"keeps no P\[1\]"),
        ("CALL OTHER", "CALL OTHER: unknown, there are"),
        ("RUN OTHER", "RUN OTHER: unknown, there are"),
        ("COL DETECT ON", "is not executed by the stand-in"),
        ("SKIP CONDITION DI[1]=ON", "is not executed by the stand-in"),
        ("DI[1]=PULSE", r"DI\[1\]: DO and RO have pulses"),
        ("R[1]=START", r"R\[1\]: only a timer is set to START"),
        ("TIMER[1]=5", r"TIMER\[1\] cannot be set"),
        ("DI[1]=ON", r"DI\[1\] cannot be set"),
        ("R[201]=1", r"the stand-in keeps no R\[201\]"),
        ("PR[1]=LPOS", "the stand-in keeps no LPOS"),
        ("R[1]=AR[1]", r"the stand-in keeps no AR\[1\]"),
        ("M[1]=(DI[1])", r"the stand-in keeps no M\[1\]"),
    ],
)
def test_what_is_not_executed_is_named(line: str, said: str) -> None:
    """With program and line; nothing is left out silently."""
    with pytest.raises(ExecutionError, match=said):
        stepped(run(line))


@pytest.mark.parametrize("number", [math.inf, math.nan])
@pytest.mark.parametrize(
    "line",
    ["R[1]=R[5]*1", "R[1]=R[5]/2", "R[1]=R[5] MOD 2", "R[1]=R[5] DIV 2", "JMP LBL[R[5]]"],
)
def test_what_is_no_number_is_refused_where_it_is_used(line: str, number: float) -> None:
    """A client's set point may be none, and a program may read it."""
    memory = Registers({"R[5]": lambda: number})
    with pytest.raises(ExecutionError, match=f"line 1 of TEST: .*: {number:g} is no number"):
        stepped(run(line, memory=memory))


class Clock:
    """Registers with a clock that the test turns."""

    def __init__(self) -> None:
        self.now = 0.0
        self.registers = Registers(now=lambda: self.now)

    def run(self, executor: Executor, seconds: float) -> None:
        """Let an executor and its outputs go on."""
        for _ in range(round(seconds / DT)):
            self.now += DT
            executor.advance(DT, True, True)
            executor.advance_beside(DT)
            self.registers.end_pulses()

    def of(self, kind: str, number: int = 1) -> object:
        """Return what stands there."""
        return self.registers.read(Indexed(kind, (float(number),)))


def test_a_timer_counts_while_it_runs() -> None:
    """START, STOP, on from there, RESET; a running one goes on counting from 0."""
    clock = Clock()
    wait = "WAIT .5(sec)"
    lines = ["TIMER[1]=START", wait, "TIMER[1]=STOP", wait, "R[1]=TIMER[1]", "TIMER[1]=START"]
    lines += [wait, "R[2]=TIMER[1]", "TIMER[1]=RESET", wait, "R[3]=TIMER[1]"]
    clock.run(run(*lines, memory=clock.registers), 3.0)
    assert [clock.of("R", k) for k in (1, 2, 3)] == pytest.approx([0.5, 1.0, 0.5], abs=0.01)


def test_a_timer_stands_while_its_program_does() -> None:
    """It goes on with the program, and not with another one that comes behind a forced end."""
    clock = Clock()
    lines = ("TIMER[1]=START", "WAIT 1(sec)", "R[1]=TIMER[1]", "WAIT 9(sec)")
    executor = run(*lines, memory=clock.registers)
    clock.run(executor, 0.5)
    executor.pause()
    clock.run(executor, 2.0)
    assert clock.of("TIMER") == pytest.approx(0.5, abs=0.01)
    executor.resume()
    clock.run(executor, 1.0)
    executor.abort()
    executor.start(taught("WAIT 9(sec)"), 0.0)
    clock.run(executor, 1.0)
    found = [clock.of("R"), clock.of("TIMER")]
    assert found == pytest.approx([1.0, 1.5], abs=0.01)


@pytest.mark.parametrize("before", ["OFF", "ON"])
@pytest.mark.parametrize(("line", "seconds"), [("PULSE,0.3sec", 0.3), ("PULSE", 0.1)])
def test_a_pulse_ends_by_itself(line: str, seconds: float, before: str) -> None:
    """An output that was on is off for so long; the program goes on meanwhile."""
    clock = Clock()
    lines = (f"DO[1]={before}", f"DO[1]={line}", "R[1]=1", "WAIT 5(sec)")
    executor = run(*lines, memory=clock.registers)
    clock.run(executor, seconds - 0.01)
    assert clock.of("DO") is (before == "OFF") and clock.of("R") == 1.0
    clock.run(executor, 0.02)
    assert clock.of("DO") is (before == "ON")


def test_a_pulse_within_a_pulse_makes_it_longer() -> None:
    """It does not end with the output left the other way round."""
    clock, pulse = Clock(), "DO[1]=PULSE,0.3sec"
    executor = run(pulse, "WAIT .2(sec)", pulse, "WAIT 5(sec)", memory=clock.registers)
    shown = []
    for seconds in (0.25, 0.2, 0.1, 0.5):
        clock.run(executor, seconds)
        shown.append(clock.of("DO"))
    assert shown == [True, True, False, False]


COUNTED = Indexed("R", (40.0,))
COUNTS = ("LBL[1]", "R[40]=R[40]+1", "WAIT .1(sec)", "JMP LBL[1]")


def test_a_program_without_motion_runs_beside() -> None:
    """Neither the other's pause halts it, nor its end, nor an abort; a hold of all does."""
    clock = Clock()
    other = taught("LBL[1]", "R[1]=R[1]+AR[1]", "WAIT .1(sec)", "JMP LBL[1]", name="OTHER")
    executor = run("RUN OTHER(2)", "WAIT .5(sec)", memory=clock.registers, called=other)
    clock.run(executor, 0.35)
    assert clock.of("R") == 8.0
    executor.pause(others=True)
    clock.run(executor, 0.5)
    assert clock.of("R") == 8.0
    executor.resume()
    executor.pause()
    clock.run(executor, 0.5)
    assert clock.of("R") == pytest.approx(18.0, abs=2.0)
    executor.resume()
    clock.run(executor, 0.5)
    assert executor.state is ProgramState.ABORTED
    executor.abort()
    before = clock.of("R")
    clock.run(executor, 0.5)
    assert clock.of("R") == pytest.approx(before + 10.0, abs=2.0)


def beside(bench: Bench, *lines: str) -> Bench:
    """Return a stand-in that has begun these lines beside a program that waits."""
    programs = {2: taught("RUN OTHER", "WAIT 99(sec)"), 3: taught(*lines, name="OTHER")}
    made = type(bench)(bench.config, bench.robot, programs)
    made.pulse("rsr2")
    made.run(0.1)
    return made


@pytest.mark.parametrize(
    ("line", "said"), [("UALM[3]", "UALM[3] in line 1 of OTHER"), ("R[1]=1/0", "line 1 of OTHER")]
)
def test_an_alarm_of_a_program_beside_stops_that_one_alone(
    bench: Bench, line: str, said: str
) -> None:
    """FAULT is on, and the robot's own program goes on."""
    bench = beside(bench, line, *COUNTS)
    assert bench.now.alarm is not None and said in bench.now.alarm.cause
    assert bench.now.outputs.fault and bench.now.program_state is ProgramState.RUNNING
    assert bench.controller.registers.read(COUNTED) == 0.0


@pytest.mark.parametrize(
    ("key", "state", "counts"),
    [
        ("cstopi", ProgramState.ABORTED, True),
        ("panel_abort", ProgramState.ABORTED, False),
        ("hold", ProgramState.PAUSED, False),
        ("imstp", ProgramState.PAUSED, False),
    ],
)
def test_what_ends_or_halts_the_selected_program_and_what_all(
    bench: Bench, key: str, state: ProgramState, counts: bool
) -> None:
    """CSTOPI ends the selected one, ABORT at the pendant all; an input that halts, halts all."""
    bench = beside(bench, *COUNTS)
    bench.controller.write_input(key, key not in ("hold", "imstp"))
    bench.run(0.1)
    before = bench.controller.registers.read(COUNTED)
    bench.run(1.0)
    assert bench.now.program_state is state
    assert (bench.controller.registers.read(COUNTED) != before) is counts


@pytest.mark.parametrize(
    ("groups", "lines", "said"),
    [
        (("1,*,*,*,*",) * 2, ["RUN OTHER"], "OTHER has motion group 1, as TEST has"),
        (("*,*,*,*,*",) * 2, ["RUN OTHER", "RUN OTHER"], "OTHER runs already"),
        (("*,*,*,*,*", "1,*,*,*,*"), ["RUN OTHER", "PAUSE"], ""),
        (("1,*,*,*,*", "*,*,*,*,*"), ["RUN OTHER", "PAUSE"], ""),
    ],
)
def test_a_program_runs_beside_once_and_not_with_the_same_motion_group(
    groups: tuple[str, str], lines: list[str], said: str
) -> None:
    """The line comes again when the program goes on: until then the other one may have ended."""
    other = taught("WAIT 1(sec)", name="OTHER", group=groups[1])
    executor = Executor(Registers(), {"OTHER": other})
    executor.start(taught(*lines, group=groups[0]), 0.0)
    if not said:
        assert stepped(executor) == [None] and len(executor.beside) == 1
        return
    for _ in range(2):
        with pytest.raises(RefusedError, match=f"line {len(lines)} of TEST: RUN OTHER: {said}"):
            stepped(executor)
    assert len(executor.beside) == len(lines) - 1
    executor.beside.clear()
    if groups[0] == groups[1] == "*,*,*,*,*":
        stepped(executor)
        assert executor.ended and len(executor.beside) == 1


@pytest.mark.parametrize(
    ("lines", "locked"),
    [
        (["LOCK PREG", "PAUSE"], True),
        (["CALL OTHER", "PAUSE"], True),
        (["RUN OTHER", "PAUSE"], False),
        (["LOCK PREG", "UNLOCK PREG", "UNLOCK PREG", "PAUSE"], False),
        (["LOCK PREG"], False),
    ],
)
def test_position_registers_are_locked_until_the_program_ends(
    lines: list[str], locked: bool
) -> None:
    """A program that was called locks for the one that called it; its own end unlocks nothing."""
    memory = Registers()
    executor = run(*lines, memory=memory, called=taught("LOCK PREG", name="OTHER"))
    memory.locked = lambda: executor.locks
    stepped(executor, 3)
    executor.advance_beside(DT)
    assert executor.locks is locked
    executor.abort()
    memory.write(Indexed("PR", (1.0,)), Pose((0.0,) * 9))


def test_two_programs_that_move_do_not_run_beside_each_other() -> None:
    """There is one robot, whatever a group mask says; the line tells which program it is about."""
    mover = taught("WAIT 1(sec)", "J P[1] 50% FINE", name="MOVER")
    with pytest.raises(ExecutionError, match="line 1 of TEST: RUN MOVER: MOVER moves the robot as"):
        stepped(run("RUN MOVER", called=mover))


def test_a_users_alarm_pauses_and_start_goes_on_behind_it(bench: Bench) -> None:
    """With its number and line, through RESET and START."""
    program = taught("R[1]=1", "UALM[3]", "R[1]=2", "WAIT 9(sec)")
    bench = type(bench)(bench.config, bench.robot, {2: program})
    bench.pulse("rsr2")
    bench.run(0.1)
    alarm = bench.now.alarm
    assert alarm is not None and alarm.code.text == "INTP-213 UALM"
    assert alarm.cause == "UALM[3] in line 2 of TEST"
    assert bench.now.program_state is ProgramState.PAUSED and bench.now.outputs.fault
    bench.pulse("fault_reset")
    bench.pulse("start")
    bench.run(0.1)
    assert bench.now.program_state is ProgramState.RUNNING and bench.now.program_line == 4


@pytest.mark.parametrize("word", ["CALL", "RUN"])
def test_what_was_saved_meanwhile_counts_from_the_next_start(word: str) -> None:
    """A program that runs calls, and begins, those that were there when it was started."""
    clock, program = Clock(), taught("WAIT .1(sec)", f"{word} OTHER")
    old, new = ({"OTHER": taught(f"R[1]={number}", name="OTHER")} for number in (1, 2))
    executor = Executor(clock.registers, old)
    for wanted in (1.0, 2.0):
        executor.start(program, 0.0)
        executor.library = new
        clock.run(executor, 0.5)
        assert clock.of("R") == wanted


def test_programs_that_call_each_other_without_an_end_are_stopped() -> None:
    """Before the machine's memory is used up."""
    with pytest.raises(ExecutionError, match="more than 10 programs have called each other"):
        stepped(run("CALL OTHER", called=taught("CALL OTHER", name="OTHER")))


@pytest.mark.parametrize(
    ("before", "do", "after"),
    [
        ("running", "pause", ProgramState.PAUSED),
        ("running", "resume", ProgramState.RUNNING),
        ("running", "abort", ProgramState.ABORTED),
        ("paused", "pause", ProgramState.PAUSED),
        ("paused", "resume", ProgramState.RUNNING),
        ("paused", "abort", ProgramState.ABORTED),
        ("aborted", "pause", ProgramState.ABORTED),
        ("aborted", "resume", ProgramState.ABORTED),
        ("aborted", "abort", ProgramState.ABORTED),
    ],
)
def test_every_state_answers_every_command(before: str, do: str, after: ProgramState) -> None:
    """An ended program cannot be resumed."""
    executor = start(MOVE)
    if before != "running":
        getattr(executor, "pause" if before == "paused" else "abort")()
    getattr(executor, do)()
    assert executor.state is after


def test_before_the_first_program_there_is_no_line() -> None:
    """Line 0 and no step, so that a reader cannot take it for a running program."""
    executor = Executor(Registers())
    assert (executor.line, executor.step, executor.advance(DT, True, True)) == (0, None, None)
