"""What a motion of a program asks for, and where its targets are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile

import msgspec
from scara_config.programs.files import Taught
from scara_config.programs.steps import MoveStep, PathStep, Target
from scara_config.programs.tp.listing import (
    Call,
    Case,
    If,
    Indexed,
    Line,
    MotionLine,
    Name,
    Select,
    Word,
)
from scara_config.programs.tp.motion import Asked, asked
from scara_config.programs.tp.printer import print_expression, print_line
from scara_config.programs.tp.values import ExecutionError, Memory, Pose, number, resolved
from scara_config.programs.walk import UnknownValueError, taught

from fanuc_emulator import alarms
from fanuc_emulator.alarms import RefusedError
from fanuc_emulator.tp.registers import FRAMES, NO_SHIFT, RunClock


class StreamStep(msgspec.Struct, frozen=True):
    """``J PR[1] R[2]% CNT100``: go on to the client's set point, as it is now."""

    line: int
    speed_percent: float


class CallFrame:
    """A program that runs, or that waits for one which it has called.

    Attributes:
        index: Of the line that comes next.
        clock: Of the program that was started: it counts for those that are called, too.
    """

    def __init__(self, program: Taught, index: int, memory: Memory) -> None:
        self.program, self.index, self.memory = program, index, memory
        self.clock = RunClock()


def motion_step(frame: CallFrame, line: MotionLine, shown: int) -> MoveStep | PathStep | StreamStep:
    """Return what a motion asks for.

    Raises:
        ExecutionError: It is not taught, or not executed.
    """
    memory, program = frame.memory, frame.program
    if program.streams:
        assert line.speed is not None
        percent = number(line.speed, memory)
        if not 0.0 < percent <= 100.0:
            raise ExecutionError(f"a speed of {percent:g} % is outside ]0, 100]")
        return StreamStep(shown, percent)
    motion = asked(line, memory)
    (target,) = motion.targets[-1:]
    if motion.kind == "J" and target.kind == "P" and not (motion.offset or motion.tool_offset):
        place = taught(target, memory, program.poses or program.positions)
        if place in program.positions:
            percent, fine = motion.percent or 100.0, motion.cnt is None
            ends = motion.cnt or 0.0, motion.seconds, motion.acc
            return MoveStep(shown, program.positions[place], percent, fine, *ends)
    return PathStep(shown, motion, tuple(_target(frame, motion, each) for each in motion.targets))


def _target(frame: CallFrame, motion: Asked, target: Indexed) -> Target:
    """Return where a motion goes to, with the frames in which that is told.

    Raises:
        ExecutionError: It is not taught, or there is no such frame.
        RefusedError: It was taught in another frame than the one that is selected.
    """
    memory, program = frame.memory, frame.program
    told: tuple[int | None, int | None] = (None, None)
    place: tuple[float, ...] | Pose
    if target.kind == "P":
        at = taught(target, memory, program.poses or program.positions)
        found = program.poses.get(at)
        place = program.positions.get(at) or found.pose if found else program.positions[at]
        told = (found.frame, found.tool) if found else told
    else:
        place = _pose(target, memory)
    checked = f"P[{at}]" if target.kind == "P" and isinstance(place, Pose) else ""
    # Joint positions are the same in every frame; what is added to them counts in one.
    counts = bool(checked or motion.offset or motion.tool_offset)
    selected = [_selected(kind, own, memory, checked, counts) for kind, own in zip(FRAMES, told)]
    frames = [
        NO_SHIFT if not each else _pose(Indexed(kind, (float(each),)), memory)
        for kind, each in zip(FRAMES, selected)
    ]
    shifts = [_pose(each, memory) if each else None for each in (motion.offset, motion.tool_offset)]
    if any(each is not None and each.config is None for each in shifts):
        raise ExecutionError("what is added to a position is no position in joints")
    return Target(place, *frames, *shifts)


def _selected(kind: str, own: int | None, memory: Memory, checked: str, counts: bool) -> int:
    """Return the frame of a target: the one selected, where none counts that of its teaching.

    Raises:
        RefusedError: It names another one than the one selected; joint positions may.

    Source:
        B-83284EN/09, section 4.3.5, for what is added.
    """
    if own is not None and not counts:
        return own
    try:
        selected = int(number(Name(f"{kind}_NUM"), memory))
    except UnknownValueError:
        # Told beforehand: a program that selects none counts on what its frames say.
        if own is None:
            raise
        return own
    if checked and own is not None and own != selected:
        why = f"{checked} was taught with {kind} {own}, selected is {selected}: set {kind}_NUM"
        raise RefusedError(alarms.FRAME_MISMATCH, why)
    return selected


def _pose(place: Indexed, memory: Memory) -> Pose:
    found = memory.read(resolved(place, memory))
    if not isinstance(found, Pose):
        raise ExecutionError(f"{print_expression(place)} is no position")
    return found


def needs_the_end(lines: Sequence[Line], here: int, locked: bool) -> bool:
    """Tell whether what comes waits for the end of the last motion's path.

    The end of a program does, behind a condition too. So does a motion whose place or speed stands
    in a register, which may still change: it is not read ahead, unless LOCK PREG keeps its place.

    Source:
        B-83284EN/09, sections 4.3.3, with $RGSPD_PREXE as delivered, and 9.4.
    """
    if here >= len(lines):
        return True
    line = lines[here]
    if isinstance(line, MotionLine):
        told = line.speed is None or isinstance(line.speed, float)
        return not told or (not locked and "PR[" in print_line(line))
    # SELECT executes an action of its own line or of a case behind it.
    cases = takewhile(lambda each: isinstance(each, Case), lines[here + 1 :])
    branches: tuple[Line, ...] = (line, *cases) if isinstance(line, Select) else (line,)
    return any(_action_of(each) in _LAST for each in branches)


def _action_of(line: Line) -> Line:
    """Return what a line does, behind its condition if it has one."""
    return line.action if isinstance(line, If | Select | Case) else line


_LAST = (Word("END"), Word("ABORT"))


def check_beside(
    program: Taught,
    callers: Sequence[Taught],
    tasks: Sequence[Taught | None],
    library: Mapping[str, Taught],
) -> None:
    """Refuse a program that cannot run beside another one.

    Args:
        program: What is to be begun.
        callers: Programs that have called each other, the last of which begins it.
        tasks: What runs or is halted beside the robot's own program.
        library: Programs that can be called, by name.

    Raises:
        RefusedError: It runs already, or both have the robot's motion group.
        ExecutionError: It moves the robot.

    Source:
        B-83284EN/09, sections 4.16.1, 9.14.2.1, 9.14.2.2.
    """
    if any(task is not None and task.name == program.name for task in tasks):
        raise RefusedError(alarms.PROGRAM_LOCKED, f"{program.name} runs already")
    for caller in callers if _has_group(program) else ():
        if _has_group(caller):
            why = f"{program.name} has motion group 1, as {caller.name} has"
            raise RefusedError(alarms.PROGRAM_LOCKED, f"{why}: its group mask has to be *,*,*,*,*")
    moving = [each.name for each in _reachable(program, library) if _moves(each)]
    if moving:
        why = f"{moving[0]} moves the robot as {callers[0].name} does"
        raise ExecutionError(f"{why}: only a program without motion runs beside")


def _has_group(program: Taught) -> bool:
    """Tell whether a program's group mask names group 1, the robot; a new program's does."""
    return program.flow.program.attributes.get("DEFAULT_GROUP", "1").startswith("1")


def _moves(program: Taught) -> bool:
    """Tell whether a program has a motion."""
    return any(isinstance(line, MotionLine) for line in program.flow.program.lines)


def _reachable(program: Taught, library: Mapping[str, Taught]) -> Iterator[Taught]:
    """Yield a program and those that it calls, and so on."""
    waiting, seen = [program], set[str]()
    while waiting:
        here = waiting.pop()
        if here.name in seen:
            continue
        seen.add(here.name)
        yield here
        for line in here.flow.program.lines:
            action = _action_of(line)
            if isinstance(action, Call) and isinstance(action.program, str):
                waiting += [library[name] for name in (action.program,) if name in library]
