"""What a program makes the robot do, told beforehand: by the interpreter that executes it.

Nothing is known of the robot but what the program itself has set. The vacuum follows the suction.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import msgspec
from scara_config import Robot
from scara_config.frames import NO_FRAMES, FrameTable, find_frames
from scara_config.loader import ConfigError
from scara_config.programs.configuration import read_configuration
from scara_config.programs.files import ProgramSteps, Taught, program_files, read_taught
from scara_config.programs.steps import GripperStep, MoveStep, PathStep, Step, WaitStep
from scara_config.programs.tp.listing import (
    Binary,
    Expression,
    Indexed,
    Name,
    PulseTime,
)
from scara_config.programs.tp.printer import print_expression
from scara_config.programs.tp.values import ExecutionError, Pose, Value, Written, as_number
from scara_config.programs.walk import UnknownValueError

from fanuc_emulator.alarms import RefusedError
from fanuc_emulator.drives.planner import Limits, Planner, joint_pose
from fanuc_emulator.places import tool_place
from fanuc_emulator.tp.executor import MOST_LINES, MOVES, Executor, ProgramState, UntilStep
from fanuc_emulator.tp.registers import Registers

MOST = 100_000
"""A program that does more, or executes more lines without a motion or a wait, does not end, as far
as anybody can know [our]."""
GRIPPER, VACUUM = Indexed("RO", (1.0,)), Indexed("RI", (1.0,))
"""The suction and its answer."""
ANSWER = re.compile(r"\bRI\[1[:\]]")
"""The answer, in a condition as it is printed."""


def read_program(path: Path, robot: Robot, directory: Path | str | None = None) -> ProgramSteps:
    """Read one file of programs/ and return what it makes the robot do.

    Args:
        path: The file.
        robot: robot.yaml.
        directory: Folder with all YAML files; its programs can be called.

    Raises:
        ConfigError: The file is wrong, or what the program does cannot be told beforehand; the
            text names file, program and line.
    """
    program = read_taught(path, robot)
    try:
        steps = tuple(rehearse(program, robot, library_of(path, robot, directory)))
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error
    return ProgramSteps(program.name, steps)


def library_of(
    path: Path, robot: Robot, directory: Path | str | None = None
) -> Mapping[str, Taught]:
    """Return the programs that the one in a file can call, each read when it is asked for.

    They bring the frames of their folder.

    Raises:
        ConfigError: Two files of programs have the same name, or frames.yaml is wrong.
    """
    called = program_files(directory)
    files = {name: each for name, each in called.items() if each != path}
    return _Library(files, robot, find_frames(directory))


class _Library(Mapping[str, Taught]):
    """Programs that can be called, each read when it is, and the frames that were taught."""

    def __init__(self, files: Mapping[str, Path], robot: Robot, frames: FrameTable) -> None:
        self._files, self._robot, self.frames = files, robot, frames

    def __getitem__(self, name: str) -> Taught:
        return read_taught(self._files[name], self._robot)

    def __iter__(self) -> Iterator[str]:
        return iter(self._files)

    def __len__(self) -> int:
        return len(self._files)


class _Known(Registers):
    """Registers and signals that the program itself has set."""

    def __init__(self, robot: Robot, frames: FrameTable) -> None:
        places = {"JPOS": self._joints, "LPOS": self._tool}
        super().__init__(places, {"OVERRIDE": _no_override}, table=frames)
        limits = [Limits(joint.velocity, joint.acceleration) for joint in robot.joints]
        self._planner = Planner(robot, limits)
        # The motions so far, and where those end of which that was asked.
        self.moves: list[MoveStep | PathStep] = []
        self._here: tuple[float, ...] | None = None
        # How the suction was switched, until its answer is awaited or a motion comes; whether
        # the answer was read.
        self.switched: GripperStep | None = None
        self.asked = False
        # Tells number and program of the line that is executed; no name: the one that was started.
        self.place: Callable[[], tuple[int, str]] = lambda: (0, "")
        # The last motion may go on while the lines behind it are executed.
        self.goes_on = False

    def read(self, place: Indexed | Name) -> Value:
        """Return what the program has put there.

        Raises:
            UnknownValueError: It has put nothing there.
        """
        if place == VACUUM:
            place, self.asked = GRIPPER, True
        element = isinstance(place, Indexed) and place.kind == "PR" and len(place.index) > 1
        if place in self._values or place in self._reads or element:
            return super().read(place)
        raise UnknownValueError(f"depends on {print_expression(place)}, which is not known")

    def write(self, place: Indexed | Name, value: Written) -> None:
        """Note what is there from now on.

        Raises:
            ExecutionError: It cannot be set, or it is the suction and the last motion goes on.
        """
        if place == GRIPPER:
            self._stand()
        super().write(place, value)
        if place == GRIPPER:
            line, program = self.place()
            self.switched, self.asked = GripperStep(line, bool(self._values[place]), program), False

    def wait_for(self, condition: Expression) -> None:
        """Know that an input is on behind ``WAIT DI[n]=ON``: only with it the program goes on."""
        match condition:
            case Binary("=", Indexed("DI", index), Name("ON")):
                self._values[Indexed("DI", index)] = True

    def _pulse(self, place: Indexed | Name, pulse: PulseTime) -> None:
        if place == GRIPPER:
            raise UnknownValueError("a pulse of the suction cannot be told beforehand")
        # It goes back by itself; it is known again once the program sets it.
        self._values.pop(place, None)

    def _joints(self) -> Value:
        return joint_pose(self._planner.robot.joints, self._end())

    def _tool(self) -> Value:
        return tool_place(self, self._planner, self._end())

    def _stand(self) -> None:
        """Refuse what asks where the arm is while the last motion goes on."""
        if self.goes_on:
            why = "depends on how far the last motion has come, which is not known"
            raise UnknownValueError(f"{why}: give that motion FINE")

    def _end(self) -> tuple[float, ...]:
        """Return where the motions so far end [rad or m].

        Raises:
            ExecutionError: There is none, the last one goes on, or one of them cannot be made.
        """
        self._stand()
        # Not planned before: only JPOS and LPOS ask where the motions end.
        for step in self.moves:
            # A later motion may lead to one place from wherever this one ends.
            if self._here is None and not _leads_to_one_place(step):
                continue
            home, joints = self._planner.robot.home, self._planner.robot.joints
            begin = self._here or tuple(home.get(j.name, 0.0) * j.scale for j in joints)
            try:
                self._here = self._planner.plan(step, begin).end
            except RefusedError as refused:
                raise ExecutionError(f"line {step.line} leads nowhere: {refused}") from refused
        self.moves = []
        if self._here is None:
            raise UnknownValueError("depends on where the robot stands, which is not known")
        return self._here


def _leads_to_one_place(step: MoveStep | PathStep) -> bool:
    """Tell whether a motion ends with the same joint positions, wherever it begins."""
    if isinstance(step, MoveStep):
        return True
    place = step.targets[-1].place
    if step.motion.kind != "J" or not isinstance(place, Pose):
        return False
    told = read_configuration(place.config or "")
    return place.config is None or (told is not None and bool(told.turns))


def _no_override(_: Value) -> None:
    raise ExecutionError("sets the override, which is that of the robot here")


def rehearse(program: Taught, robot: Robot, library: Mapping[str, Taught]) -> Iterator[Step]:
    """Yield what a program does, from its first line to its end.

    A motion whose corner is not rounded, because what follows it waits for its end, has a CNT of 0.

    Args:
        program: The program.
        robot: robot.yaml.
        library: Programs that it can call; that of :func:`library_of` brings frames.

    Raises:
        ConfigError: What it does depends on an input or a register that it has not set, it does
            not end, or a line asks for what cannot be judged; the text names program and line.
    """
    memory = _Known(robot, library.frames if isinstance(library, _Library) else NO_FRAMES)
    executor = Executor(memory, library)
    executor.start(program, 0.0)

    def place() -> tuple[int, str]:
        name = executor.frame.program.name
        return executor.frame.index + 1, "" if name == program.name else name

    memory.place, memory.locked = place, lambda: executor.locks
    for step in _steps(executor, memory):
        if isinstance(step, MOVES):
            memory.moves.append(step)
        yield step


def _steps(executor: Executor, memory: _Known) -> Iterator[Step]:
    """Yield what is done, line by line; a motion once it is told whether its corner is rounded."""
    waiting: MoveStep | PathStep | None = None
    # The switch that was told, though its answer has not been awaited yet.
    told: GripperStep | None = None
    seconds, name, count = 0.0, "", 0
    while count <= MOST:
        try:
            step = executor.advance(seconds, waiting is None, waiting is None, lambda _: True)
        except RefusedError as refused:
            raise ConfigError(f"{executor.frame.program.name}: {refused}") from refused
        seconds = 0.0
        if executor.state is ProgramState.PAUSED or executor.beside:
            raise _named(executor, "what follows cannot be told beforehand")
        left = executor.step is waiting or executor.ended
        if step is None and waiting is not None and left:
            # What comes next waits for its end, and no program ends without its last motion.
            yield msgspec.structs.replace(_to_its_end(waiting), program=name)
            waiting, memory.goes_on = None, False
            continue
        if step is not None and waiting is not None:
            yield msgspec.structs.replace(waiting, program=name)
            waiting = None
        until = executor.step if isinstance(executor.step, UntilStep) else None
        count += 1 if step is not None or until is not None else MOST_LINES
        switched = memory.switched
        if switched is not None and (step is not None or executor.ended):
            tell = switched
            if isinstance(step, UntilStep) and ANSWER.search(print_expression(step.condition)):
                # It takes its time in the line that waits for it.
                tell = GripperStep(step.line, switched.on, memory.place()[1])
            elif step is not None or switched is told:
                # A loop that asks for the answer by IF waits for it as well.
                tell = msgspec.structs.replace(switched, awaited=memory.asked)
            # Told where it is switched; behind other waits once more where its answer is awaited.
            if tell.awaited or switched is not told:
                yield tell
            told = switched
            if tell.awaited or isinstance(step, MOVES):
                memory.switched = None
        if executor.ended:
            return
        _, program = memory.place()
        match step:
            case MoveStep() | PathStep():
                # Whether it has ended behind a rounded corner, no wait tells either.
                waiting, name, memory.goes_on = step, program, True
            case WaitStep():
                yield msgspec.structs.replace(step, program=program)
                seconds = step.seconds
            case None if until is not None:
                if until.jump is None:
                    raise _named(executor, "nothing that the program does makes this true")
                seconds = 0.01 * as_number(memory.read(Name("$WAITTMOUT")))
                yield WaitStep(until.line, seconds, program)
        if isinstance(step, UntilStep) and step.jump is None:
            memory.wait_for(step.condition)
    raise ConfigError(f"{executor.frame.program.name}: {MOST} lines do not lead to its end")


def _to_its_end(step: MoveStep | PathStep) -> MoveStep | PathStep:
    """Return a motion whose corner is not rounded."""
    if isinstance(step, MoveStep):
        return msgspec.structs.replace(step, cnt=0.0)
    cnt = None if step.fine else 0.0
    motion = msgspec.structs.replace(step.motion, cnt=cnt)
    return msgspec.structs.replace(step, motion=motion)


def _named(executor: Executor, why: str) -> ConfigError:
    """Return an error that names the line which was executed last."""
    frame = executor.frame
    return ConfigError(frame.program.flow.named(frame.index - 1, why))
