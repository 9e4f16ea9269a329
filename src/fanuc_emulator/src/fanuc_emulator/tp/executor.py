"""Execute one of the robot's programs, line by line.

What stands in a program's file: :mod:`scara_config.programs.tp.listing`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from typing import TypeAlias

import msgspec
from scara_config.programs.files import Taught
from scara_config.programs.steps import MoveStep, PathStep, WaitStep
from scara_config.programs.tp.execution import execute, flow_of, line_of
from scara_config.programs.tp.listing import (
    Call,
    Expression,
    Indexed,
    Line,
    MotionLine,
    Name,
    Numbered,
    Wait,
    WaitUntil,
    Word,
)
from scara_config.programs.tp.printer import print_expression
from scara_config.programs.tp.values import (
    ExecutionError,
    Memory,
    Value,
    evaluate,
    number,
    truth,
)
from scara_config.set_up import kit_programs

from fanuc_emulator import alarms
from fanuc_emulator.alarms import AlarmCode, RefusedError
from fanuc_emulator.tp.motions import (
    CallFrame,
    StreamStep,
    check_beside,
    motion_step,
    needs_the_end,
)
from fanuc_emulator.tp.registers import ProgramRegisters, Registers

Program: TypeAlias = Taught
MOST_LINES = 100
"""Lines without motion and wait that are executed in one period [our]; an endless loop goes on in
the next one."""
DEEPEST = 10
"""Programs that have called each other [our]."""


class UntilStep(msgspec.Struct, frozen=True):
    """A condition is waited for; ``jump`` is where the program goes when that lasts too long."""

    line: int
    condition: Expression
    jump: Indexed | None


MOVES = (MoveStep, PathStep)
Step = MoveStep | PathStep | WaitStep | UntilStep | StreamStep


class ProgramState(IntEnum):
    """What the register ``program_state`` says."""

    ABORTED = 0
    PAUSED = 1
    RUNNING = 2


def stream_program(name: str) -> Program:
    """Return the program that follows the client's set points."""
    return Taught(flow_of(kit_programs.stream_program(name), name), {}, streams=True)


class Executor:
    """Run one program at a time.

    Args:
        memory: Registers and signals.
        library: Programs that can be called, by name.

    Attributes:
        cursor: Index of the line at which the last program was ended; 0 after its own end.
        line: Number of the line that runs or ran last, of the program that was started; 0 before
            the first.
        waited: For how long a condition has been waited for [s].
        beside: Programs without motion that run beside, by RUN; each is halted and ends alone.
        library: Programs that one which starts from now on can call, by name.
    """

    def __init__(self, memory: Registers, library: Mapping[str, Program] | None = None) -> None:
        self.cursor = 0
        self.line = 0
        self.state = ProgramState.ABORTED
        self.program: Program | None = None
        self._memory = memory
        self.library = self._callable = library if library is not None else {}
        self._frames: list[CallFrame] = []
        self._step: Step | None = None
        self._delay = 0.0
        self.waited = 0.0
        self.beside: list[Executor] = []
        # LOCK PREG: position registers count as they are when a line is read ahead.
        self._locked = False
        # The last motion has been left before its end, for the corner to the next one.
        self._rounded: MoveStep | PathStep | None = None
        # Where the motion stands that began last, and the one whose corner it rounded then.
        self._began: tuple[CallFrame, int, MoveStep | PathStep | None] | None = None

    @property
    def step(self) -> Step | None:
        """What is being executed now, None while nothing runs or the start delay lasts."""
        return None if self.state is ProgramState.ABORTED else self._step

    @property
    def ended(self) -> bool:
        """No program runs or is paused."""
        return self.state is ProgramState.ABORTED

    @property
    def locks(self) -> bool:
        """This program, or one beside it, has locked the position registers and has not ended."""
        return any(each._locked and not each.ended for each in (self, *self.beside))

    @property
    def frame(self) -> CallFrame:
        """The program that runs, of those that have called each other."""
        return self._frames[-1]

    def start(
        self, program: Program, delay: float, index: int = 0, arguments: Sequence[Value] = ()
    ) -> None:
        """Begin ``program`` at a line, which starts after ``delay`` [s]."""
        self.program, self._callable = program, self.library
        self.state = ProgramState.RUNNING
        self.line = index + 1
        self._frames = [self._frame(program, index, arguments)]
        self._step = self._rounded = self._began = None
        self._locked, self._delay = False, delay

    def pause(self, others: bool = False) -> None:
        """RUNNING -> PAUSED; what runs beside is halted only with ``others``."""
        for each in (self, *self.beside) if others else (self,):
            if each.state is ProgramState.RUNNING:
                each.state = ProgramState.PAUSED

    def resume(self) -> None:
        """PAUSED -> RUNNING, with all that is halted beside. Source: B-83284EN/09, 9.14.2.3."""
        if self.state is not ProgramState.PAUSED:
            return
        for each in (self, *self.beside):
            if each.state is ProgramState.PAUSED:
                each.state = ProgramState.RUNNING

    def abort(self) -> None:
        """End the program here; what runs beside goes on."""
        self.state = ProgramState.ABORTED
        self.cursor = max(0, self.line - 1)

    def refuse(self) -> None:
        """Take back the motion that began last: its line is executed anew when the program goes on.

        What a set point asks for counts anew by itself.
        """
        if self._began is not None:
            frame, index, rounded = self._began
            frame.index, self._step, self._rounded = index, rounded, rounded

    def advance(
        self,
        dt: float,
        path_done: bool,
        arrived: bool,
        nears_end: Callable[[float], bool] = lambda _: False,
    ) -> Step | None:
        """Go on for ``dt`` and return a step that begins now, if one does.

        Args:
            dt: Step [s].
            path_done: The last move's path is finished.
            arrived: ... and the motors are there.
            nears_end: Tells whether so much of its deceleration is left, 0..1, or less.

        Raises:
            ExecutionError: A line cannot be executed; the text names program and line.
            RefusedError: A line raises an alarm that stops; the text names program and line.
        """
        if self.state is not ProgramState.RUNNING:
            return None
        clock = self._memory.clock = self._frames[0].clock
        clock.seconds += dt
        if self._delay > 0.0:
            self._delay -= dt
            # What is left after so many subtractions may be rounding alone.
            if self._delay > 1e-9:
                return None
        step = self._step
        # A set point is done at once: the next round of the program's loop takes the newest.
        follows = step.__class__ is StreamStep
        if step and not follows and not self._finished(step, dt, path_done, arrived):
            if not isinstance(step, MOVES) or self._rounded is not None:
                return None
            if not step.cnt or not nears_end(0.01 * step.cnt):
                return None
            self._rounded = step
        if path_done:
            self._rounded = None
        self._step = None
        for _ in range(MOST_LINES):
            frame = self._frames[-1]
            here, lines = frame.index, frame.program.flow.program.lines
            if self._rounded is not None and needs_the_end(lines, here, self._locked):
                self._step = self._rounded
                return None
            if here >= len(lines):
                self._return()
            else:
                try:
                    frame.index, line = execute(frame.program.flow, here, frame.memory)
                except RefusedError as refused:
                    # This line comes again, and not the motion that began last.
                    self._began = None
                    where = frame.program.flow.named(here, str(refused))
                    raise RefusedError(refused.code, where) from refused
                if line is not None:
                    self._begin(frame, line, here)
            if self._step is not None or self.state is not ProgramState.RUNNING:
                return self._step
        return None

    def overdue(self, patience: float) -> str:
        """Return which answer of the gripper has been waited for longer than this [s], or "".

        It is waited for anew then. A line with a TIMEOUT of its own knows what to do.
        """
        step = self._step
        if not isinstance(step, UntilStep) or step.jump is not None or self.waited <= patience:
            return ""
        condition = print_expression(step.condition)
        if not condition.startswith("RI["):
            return ""
        self.waited = 0.0
        return f"{condition.replace('=', ' is not ')} in line {step.line}"

    def _begin(self, frame: CallFrame, line: Line, here: int) -> None:
        """Begin what takes time or leads to another program.

        Raises:
            ExecutionError: The stand-in cannot do it.
        """
        self._began = None
        try:
            self._step = self._step_of(frame, line, here + 1)
        except ExecutionError as error:
            raise ExecutionError(frame.program.flow.named(here, str(error))) from error
        except RefusedError as refused:
            if isinstance(line, Numbered):
                raise
            # UALM is behind its line; a motion that was not made comes again, and a RUN.
            frame.index = here
            where = frame.program.flow.named(here, str(refused))
            raise RefusedError(refused.code, where) from refused
        if isinstance(self._step, MOVES):
            self._began = frame, here, self._rounded
            self._rounded = None
        if self._step is not None or line == Word("PAUSE"):
            self.waited = 0.0
            if frame is self._frames[0]:
                self.line = here + 1

    def _step_of(self, frame: CallFrame, line: Line, shown: int) -> Step | None:
        match line:
            case MotionLine():
                return motion_step(frame, line, shown)
            case Wait():
                self._delay = number(line.seconds, frame.memory)
                return WaitStep(shown, self._delay)
            case WaitUntil():
                return UntilStep(shown, line.condition, line.timeout)
            case Call(beside=False):
                self._call(line, frame)
            case Word(words="END"):
                self._return()
            case Word(words="ABORT"):
                # ABORT ends all programs that have called each other, END only the one that runs.
                self._frames = self._frames[:1]
                self._return()
            case Word(words="PAUSE"):
                self.pause()
            case Call(beside=True):
                self._run(line, frame)
            case Numbered() if line.instruction.kind == "UALM":
                alarm = int(number(line.instruction.index[0], frame.memory))
                raise RefusedError(
                    alarms.USER_ALARM, f"UALM[{alarm}] in line {shown} of {frame.program.name}"
                )
            case Word(words="LOCK PREG" | "UNLOCK PREG"):
                self._locked = line.words == "LOCK PREG"
            # What the robot carries is a number of its plant.
            case Numbered() if line.instruction.kind == "PAYLOAD":
                pass
            case _:
                raise ExecutionError("is not executed by the stand-in")
        return None

    def _named(self, line: Call) -> Program:
        """Return the program that a line calls or runs."""
        if not isinstance(line.program, str) or line.program not in self._callable:
            raise ExecutionError(f"unknown, there are {', '.join(self._callable)}")
        return self._callable[line.program]

    def _run(self, line: Call, frame: CallFrame) -> None:
        """Begin a program beside this one."""
        program = self._named(line)
        callers = [each.program for each in self._frames]
        tasks = [task.program for task in self.beside if not task.ended]
        check_beside(program, callers, tasks, self._callable)
        if len(self.beside) == DEEPEST:
            raise ExecutionError(f"{DEEPEST} programs run beside this one already")
        task = Executor(self._memory, self._callable)
        # One list for all: a program beside may begin one, too.
        task.beside = self.beside
        arguments: list[Value] = [evaluate(each, frame.memory) for each in line.arguments]
        task.start(program, 0.0, arguments=arguments)
        self.beside.append(task)

    def advance_beside(self, dt: float) -> list[tuple[AlarmCode, str]]:
        """Let the programs go on that run beside the robot's own.

        Returns:
            Alarms with their causes: each has halted or ended the program that raised it, alone.

        Source:
            B-83284EN/09, section 9.15.2: STOP and ABORT are for local tasks only.
        """
        told: list[tuple[AlarmCode, str]] = []
        for task in list(self.beside):
            try:
                task.advance(dt, True, True)
            except RefusedError as refused:
                task.pause()
                told.append((refused.code, str(refused)))
            except ExecutionError as error:
                task.abort()
                told.append((alarms.LINE_REFUSED, str(error)))
        self.beside[:] = [task for task in self.beside if not task.ended]
        return told

    def _call(self, line: Call, frame: CallFrame) -> None:
        program = self._named(line)
        if len(self._frames) == DEEPEST:
            raise ExecutionError(f"more than {DEEPEST} programs have called each other")
        arguments: list[Value] = [evaluate(each, frame.memory) for each in line.arguments]
        self._frames.append(self._frame(program, 0, arguments))

    def _frame(self, program: Program, index: int, arguments: Sequence[Value] = ()) -> CallFrame:
        """Return a program at a line, with its own positions and arguments."""
        memory: Memory = self._memory
        if arguments or program.poses:
            poses = {place: found.pose for place, found in program.poses.items()}
            memory = ProgramRegisters(memory, arguments, poses)
        return CallFrame(program, index, memory)

    def _return(self) -> None:
        """Go back to the program that called this one; without one it ends."""
        if len(self._frames) > 1:
            self._frames.pop()
            return
        self.state = ProgramState.ABORTED
        self.cursor = 0

    def _finished(self, step: Step, dt: float, path_done: bool, arrived: bool) -> bool:
        """Tell whether ``step`` is done.

        A wait is done when its delay has run out.
        """
        if isinstance(step, MOVES):
            return arrived if step.fine else path_done
        if not isinstance(step, UntilStep):
            return True
        frame = self._frames[-1]
        try:
            if truth(step.condition, frame.memory):
                return True
            self.waited += dt
            # $WAITTMOUT counts hundredths of a second.
            if step.jump is None or self.waited < 0.01 * number(Name("$WAITTMOUT"), frame.memory):
                return False
            frame.index = line_of(frame.program.flow, step.jump, frame.memory)
        except ExecutionError as error:
            raise ExecutionError(frame.program.flow.named(step.line - 1, str(error))) from error
        return True
