"""What a motion of a program asks for, and where its targets are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import msgspec
from scara_config.programs.files import Taught
from scara_config.programs.steps import MoveStep, PathStep, Target
from scara_config.programs.tp.listing import Call, Case, If, Indexed, MotionLine, Name, Select
from scara_config.programs.tp.motion import Asked, asked
from scara_config.programs.tp.printer import print_expression
from scara_config.programs.tp.values import ExecutionError, Memory, Pose, number, resolved
from scara_config.programs.walk import UnknownValueError, taught

from fanuc_emulator import alarms
from fanuc_emulator.alarms import RefusedError
from fanuc_emulator.tp.registers import FRAMES, NO_SHIFT


class StreamStep(msgspec.Struct, frozen=True):
    """``J PR[1] R[2]% CNT100``: go on to the client's set point, as it is now."""

    line: int
    speed_percent: float


class CallFrame:
    """A program that runs, or that waits for one which it has called.

    Attributes:
        index: Of the line that comes next.
    """

    def __init__(self, program: Taught, index: int, memory: Memory) -> None:
        self.program, self.index, self.memory = program, index, memory


def motion_step(frame: CallFrame, line: MotionLine, shown: int) -> MoveStep | PathStep | StreamStep:
    """Return what a motion asks for.

    Raises:
        ExecutionError: It is not taught, or not executed.
    """
    memory, program = frame.memory, frame.program
    if shown in program.stream_lines:
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
    selected = [_selected(kind, own, memory, checked) for kind, own in zip(FRAMES, told)]
    frames = [
        NO_SHIFT if not each else _pose(Indexed(kind, (float(each),)), memory)
        for kind, each in zip(FRAMES, selected)
    ]
    shifts = [_pose(each, memory) if each else None for each in (motion.offset, motion.tool_offset)]
    if any(each is not None and each.config is None for each in shifts):
        raise ExecutionError("what is added to a position is no position in joints")
    return Target(place, *frames, *shifts)


def _selected(kind: str, own: int | None, memory: Memory, checked: str) -> int:
    """Return in which frame a position counts: that of its teaching, else the one selected.

    Raises:
        RefusedError: It names another one than the one selected; joint positions may.
    """
    if own is not None and not checked:
        return own
    try:
        selected = int(number(Name(f"{kind}_NUM"), memory))
    except UnknownValueError:
        # Told beforehand: a program that selects none counts on what its frames say.
        if own is None:
            raise
        return own
    if own is not None and own != selected:
        why = f"{checked} was taught with {kind} {own}, selected is {selected}: set {kind}_NUM"
        raise RefusedError(alarms.FRAME_MISMATCH, why)
    return selected


def _pose(place: Indexed, memory: Memory) -> Pose:
    found = memory.read(resolved(place, memory))
    if not isinstance(found, Pose):
        raise ExecutionError(f"{print_expression(place)} is no position")
    return found


def moves(program: Taught) -> bool:
    """Tell whether a program has a motion."""
    return any(isinstance(line, MotionLine) for line in program.flow.program.lines)


def reachable(program: Taught, library: Mapping[str, Taught]) -> Iterator[Taught]:
    """Yield a program and those that it calls, and so on."""
    waiting, seen = [program], set[str]()
    while waiting:
        here = waiting.pop()
        if here.name in seen:
            continue
        seen.add(here.name)
        yield here
        for line in here.flow.program.lines:
            action = line.action if isinstance(line, If | Select | Case) else line
            if isinstance(action, Call) and isinstance(action.program, str):
                waiting += [library[name] for name in (action.program,) if name in library]
