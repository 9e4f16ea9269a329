"""Programs of the robot and the executor that runs them line by line.

What a program's file makes the robot do: :mod:`scara_config.programs.steps`.
"""

from __future__ import annotations

from enum import IntEnum
from functools import cached_property

import msgspec
from scara_config.programs.steps import GripperStep, MoveStep, WaitStep


class StreamStep(msgspec.Struct, frozen=True):
    """``J PR[1] R[2]% CNT100; JMP LBL``: follow the set points of the client until aborted."""

    line: int


Step = MoveStep | WaitStep | GripperStep | StreamStep


class Program(msgspec.Struct, frozen=True, dict=True):
    """A program ready to run: its loops are unrolled, each step knows its line in the listing."""

    name: str
    steps: tuple[Step, ...]

    @cached_property
    def streams(self) -> bool:
        """It is the program that follows PR[1]."""
        return any(isinstance(step, StreamStep) for step in self.steps)


class ProgramState(IntEnum):
    """What the register ``program_state`` says."""

    ABORTED = 0
    PAUSED = 1
    RUNNING = 2


class Executor:
    """Run one program at a time.

    Attributes:
        cursor: The step at which the last program was ended; 0 after its own end.
    """

    def __init__(self) -> None:
        self.cursor = 0
        self.state = ProgramState.ABORTED
        self.program: Program | None = None
        self._index = 0
        self._started = False
        self._delay = 0.0

    @property
    def line(self) -> int:
        """Line of the running or last program; 0 before the first."""
        if self.program is None or not self.program.steps:
            return 0
        return self.program.steps[min(self._index, len(self.program.steps) - 1)].line

    @property
    def step(self) -> Step | None:
        """What is being executed now, None while nothing runs or the start delay lasts."""
        if self.program is None or self.state is ProgramState.ABORTED or not self._started:
            return None
        return self.program.steps[self._index]

    def start(self, program: Program, delay: float, index: int = 0) -> None:
        """Begin ``program`` at a step, which starts after ``delay`` [s]."""
        self.program = program
        self.state = ProgramState.RUNNING
        self._index = index
        self._started = False
        self._delay = delay

    def pause(self) -> None:
        """RUNNING -> PAUSED."""
        if self.state is ProgramState.RUNNING:
            self.state = ProgramState.PAUSED

    def resume(self) -> None:
        """PAUSED -> RUNNING."""
        if self.state is ProgramState.PAUSED:
            self.state = ProgramState.RUNNING

    def abort(self) -> None:
        """End the program here."""
        self.state = ProgramState.ABORTED
        self.cursor = self._index

    def advance(
        self, dt: float, path_done: bool, arrived: bool, vacuum: bool = False
    ) -> Step | None:
        """Go on for ``dt`` and return a step that begins now, if one does.

        Args:
            dt: Step [s].
            path_done: The last move's path is finished.
            arrived: ... and the motors are there.
            vacuum: A part is held.
        """
        if self.state is not ProgramState.RUNNING or self.program is None:
            return None
        if self._delay > 0.0:
            self._delay -= dt
            if self._delay > 1e-9:
                return None
        if self._started:
            if not self._finished(self.program.steps[self._index], path_done, arrived, vacuum):
                return None
            self._index += 1
            if self._index >= len(self.program.steps):
                self.state = ProgramState.ABORTED
                self.cursor = 0
                return None
        self._started = True
        step = self.program.steps[self._index]
        if isinstance(step, WaitStep):
            self._delay = step.seconds
        return step

    def _finished(self, step: Step, path_done: bool, arrived: bool, vacuum: bool) -> bool:
        """Tell whether ``step`` is done.

        A wait is done when its delay has run out, a stream never.
        """
        if isinstance(step, MoveStep):
            return arrived if step.fine else path_done
        if isinstance(step, GripperStep):
            return vacuum == step.on
        return isinstance(step, WaitStep)
