"""Say a program's positions otherwise: in joints, or where the tool is in a user frame.

The robot's own interpreter turns the one into the other, as it does when it runs the program. What
does not come back from its new numbers within ``EXACT`` stays as it was, and that is told.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Literal, get_args

import msgspec
from fanuc_emulator.alarms import RefusedError
from fanuc_emulator.drives.planner import Limits, Planner
from scara_config import Robot
from scara_config.frames import WORDS, FrameTable, Kind
from scara_config.programs.configuration import read_configuration
from scara_config.programs.files import (
    TIP,
    axis_names,
    checked_listing,
    is_cartesian,
    joint_values,
    taught_pose,
)
from scara_config.programs.frame_remarks import frame_remarks, told_frames
from scara_config.programs.steps import Target
from scara_config.programs.tp.listing import (
    AssignLine,
    Blank,
    Coordinate,
    Expression,
    GroupPosition,
    Line,
    MotionLine,
    Name,
    Position,
    Program,
    Remark,
    Wait,
)
from scara_config.programs.tp.printer import print_line, print_program
from scara_config.programs.tp.values import POSE_NUMBERS, Pose

from what_if.errors import WhatIfError

Form = Literal["joints", "cartesian"]
FORMS: tuple[Form, ...] = get_args(Form)
DIGITS = 6
"""Behind the point [deg or mm], as recorded positions have them."""
EXACT = 1e-3
"""Joint positions come back so exactly [deg or mm]."""
READS = re.compile(r"(?<![A-Z])P\[(\d*)")
"""A line reads a position's numbers; the group tells which one's, empty: a register does."""
_COUNTS_IN_FRAME = re.compile(r"LPOS|Offset|OFFSET|PR\[")
_SETS_FRAME = re.compile(r"\s*(UFRAME|UTOOL)\[[^\]]*\]\s*=")
_DELIVERED_TOOL = 1
"""All 0 where nobody set it: settings/ of the stand-in."""


def converted(
    program: Program, robot: Robot, table: FrameTable, form: Form, frame: int | None = None
) -> tuple[Program, tuple[str, ...]]:
    """Say the positions of a program otherwise; its motions stay the same.

    Args:
        program: Without faults: its positions are this robot's.
        robot: robot.yaml.
        table: Frames that were taught.
        form: What the positions shall tell.
        frame: User frame of Cartesian positions, 0: the base; None: each stays in its own.

    Returns:
        The program, and why some positions are not said otherwise.

    Raises:
        WhatIfError: A line reads a position's numbers or counts in a frame that changes, a position
            would be in a frame that is not selected, or cannot be told otherwise: it does not say
            how the arm is bent.
        ConfigError: A frame was never taught.
    """
    converter = _Converter(robot, table)
    _check_lines(program, frame)
    if form == "joints":
        made = tuple(map(converter.in_joints, program.positions))
        return msgspec.structs.replace(program, positions=made), ()
    kept: list[str] = []
    positions = []
    for position in program.positions:
        found, why = converter.in_space(position, frame)
        positions.append(found)
        if why:
            kept.append(f"P[{position.number}] stays in joints: {why}")
    _check_selected(program, positions)
    lines = (*_selections(program, positions), *program.lines)
    cartesian = filter(is_cartesian, positions)
    used = {key for each in cartesian for key in zip(WORDS, _numbers_of(each))}
    used -= set(told_frames(program))
    lines += tuple(frame_remarks(table, sorted(used, reverse=True)))
    made = tuple(positions)
    return msgspec.structs.replace(program, lines=lines, positions=made), tuple(kept)


def converted_text(
    text: str,
    robot: Robot,
    table: FrameTable,
    form: str,
    frame: int | None = None,
    name: str = "",
) -> tuple[str, tuple[str, ...]]:
    """Return the text of a program with its positions said otherwise, and which are not.

    Args:
        text: Of a file ``NAME.LS``.
        robot: robot.yaml.
        table: Frames that were taught.
        form: joints or cartesian.
        frame: As for :func:`converted`.
        name: Of the new program; empty: it keeps its own.

    Raises:
        WhatIfError: As :func:`converted`, or there is no such form.
        ConfigError: The text is no program of this robot, or a frame was never taught.
    """
    if form not in FORMS:
        raise WhatIfError(f"to = {form!r}: allowed are {', '.join(FORMS)}")
    program = checked_listing(text, robot, "the program")
    made, kept = converted(program, robot, table, form, frame)
    return print_program(msgspec.structs.replace(made, name=name or program.name)), kept


def _check_lines(program: Program, frame: int | None) -> None:
    """Refuse a program whose lines would mean something else.

    Raises:
        WhatIfError: One would; the text names it.
    """
    frames = {each.groups[0].frame for each in program.positions}
    moves = frame is not None and frames - {str(frame)}
    for number, line in enumerate(program.lines, start=1):
        # A remark may hold any words, even P[1]: nobody executes them.
        text = "" if isinstance(line, Remark) else print_line(line)
        why = ""
        # A motion goes to the same place however it is said; other lines read the numbers.
        if not isinstance(line, MotionLine) and READS.search(text):
            why = "reads the numbers of a position"
        elif _SETS_FRAME.match(text):
            why = "sets a frame while it runs"
        elif moves and (_COUNTS_IN_FRAME.search(text) or _selects(line, WORDS["user"])):
            listed = ", ".join(f"UF {each}" for each in sorted(frames))
            why = f"counts in the frame that is selected: leave the positions in {listed}"
        if why:
            raise WhatIfError(f"line {number} of {program.name}: {text.strip()}: {why}")


def _check_selected(program: Program, positions: list[Position]) -> None:
    """Refuse a Cartesian position of another frame than the one selected: a robot stops at it.

    Where others may lead to a line, each frame counts that the program selects anywhere.

    Raises:
        WhatIfError: There is one; the text names the line and both frames.
    """
    own: dict[Expression, tuple[int, int]] = {
        float(each.number): _numbers_of(each) for each in positions if is_cartesian(each)
    }
    texts = ["" if isinstance(line, Remark) else print_line(line).strip() for line in program.lines]
    for at, word in enumerate(WORDS.values()):
        name = f"{word}_NUM"
        anywhere = {text.removeprefix(f"{name}=") for text in texts if name in text}
        # A register may hold any number, and a program that is called may select any frame.
        if any("CALL" in text for text in texts) or not all(map(str.isdigit, anywhere)):
            anywhere = set()
        selected: set[str] = set()  # empty: not known
        for number, (line, text) in enumerate(zip(program.lines, texts), start=1):
            if _selects(line, word):
                told = text.removeprefix(f"{name}=")
                selected = {told} if told.isdigit() else set()
            elif isinstance(line, MotionLine):
                for target in line.targets:
                    if target.kind != "P" or target.index[0] not in own:
                        continue
                    frame = str(own[target.index[0]][at])
                    if selected and frame not in selected:
                        raise WhatIfError(
                            f"line {number} of {program.name}: {text}: would go to {word} {frame}, "
                            f"selected is {' or '.join(sorted(selected))}: set {name} before"
                        )
                    selected = {frame}
            elif not isinstance(line, AssignLine | Blank | Remark | Wait):
                selected = anywhere


def _selects(line: Line, word: str) -> bool:
    return isinstance(line, AssignLine) and line.target == Name(f"{word}_NUM")


def _selections(program: Program, positions: list[Position]) -> Iterator[Line]:
    """Yield lines that select the frames of the positions, where the program does not."""
    for at, word in enumerate(WORDS.values()):
        numbers = {_numbers_of(each)[at] for each in positions}
        chosen = any(_selects(line, word) for line in program.lines)
        if len(numbers) == 1 and not chosen:
            yield AssignLine(Name(f"{word}_NUM"), float(numbers.pop()))


def _numbers_of(position: Position) -> tuple[int, int]:
    """Return UF and UT.

    Raises:
        WhatIfError: One is that which is selected.
    """
    group = position.groups[0]
    if not (group.frame.isdigit() and group.tool.isdigit()):
        told = f"UF : {group.frame}, UT : {group.tool}"
        raise WhatIfError(f"P[{position.number}]: {told}: no number tells its frame")
    return int(group.frame), int(group.tool)


class _Converter:
    def __init__(self, robot: Robot, table: FrameTable) -> None:
        limits = [Limits(joint.velocity, joint.acceleration) for joint in robot.joints]
        self._robot, self._table, self._planner = robot, table, Planner(robot, limits)
        self._home = [robot.home.get(joint.name, 0.0) * joint.scale for joint in robot.joints]

    def in_joints(self, position: Position) -> Position:
        """Return a position of joints.

        Raises:
            WhatIfError: It leads nowhere, or nothing tells how the arm is bent.
            ConfigError: Its frame was never taught.
        """
        if not is_cartesian(position):
            return position
        told = read_configuration(position.groups[0].config)
        if told is None or not told.turns:
            raise WhatIfError(
                f"P[{position.number}]: CONFIG : '{position.groups[0].config}': where the joints "
                "go depends on where the arm comes from"
            )
        try:
            q = self._solved(position, _numbers_of(position))
        except RefusedError as refused:
            raise WhatIfError(f"P[{position.number}]: {refused}") from refused
        values = dict(zip((joint.name for joint in self._robot.joints), q))
        coordinates = [
            # Adding 0.0 makes 0.0 of -0.0, whose sign would puzzle a reader of the program.
            Coordinate(name, round(values[joint.name] / joint.scale, DIGITS) + 0.0, joint.unit)
            for name, joint in axis_names(self._robot).items()
        ]
        return _with(position, position.groups[0].frame, "", coordinates)

    def in_space(self, position: Position, frame: int | None) -> tuple[Position, str]:
        """Return a position that tells where the tool is, and why it is still one of joints."""
        own, tool = _numbers_of(position)
        number = own if frame is None else frame
        if is_cartesian(position):
            if number == own:
                return position, ""
            position = self.in_joints(position)
        q = joint_values(position, self._robot)
        stays = _with(position, str(number), "", position.groups[0].coordinates)
        if self._planner.is_singular(q):
            return stays, "the arm is stretched there, or its wrist: small errors turn it far"
        pose = self._planner.tip_pose(q, self._frame("user", number), self._frame("tool", tool))
        units = ("mm", "mm", "mm", "deg", "deg", "deg")
        coordinates = [
            Coordinate(name, round(value, DIGITS) + 0.0, unit)
            for name, value, unit in zip(TIP, pose.values, units)
        ]
        # An axis of its own, such as the table (E1), is no part of where the tool is.
        external = [each for each in position.groups[0].coordinates if each.name.startswith("E")]
        made = _with(position, str(number), pose.config or "", [*coordinates, *external])
        # Tried backwards: near a stretched arm the last digit of a coordinate moves the joints far.
        try:
            back = self._solved(made, (number, tool))
        except RefusedError as refused:
            why = str(refused)
        else:
            joints = self._robot.joints
            apart = max(abs(a - b) / joint.scale for a, b, joint in zip(q, back, joints))
            if apart <= EXACT:
                return made, ""
            why = f"its {DIGITS} digits lead {apart:.3g} deg or mm away"
        return stays, why

    def _solved(self, position: Position, frames: tuple[int, int]) -> tuple[float, ...]:
        """Return where a Cartesian position leads from home [rad or m].

        Raises:
            RefusedError: Nowhere.
        """
        user, tool = (self._frame(kind, each) for kind, each in zip(WORDS, frames))
        pose = taught_pose(position, self._robot).pose
        return self._planner.joints_at(Target(pose, user, tool), self._home)

    def _frame(self, kind: Kind, number: int) -> Pose:
        """Return a frame.

        Raises:
            ConfigError: It was never taught.
        """
        # A delivered robot knows these without anybody having taught them, so no file has them.
        untouched = number == 0 or (kind == "tool" and number == _DELIVERED_TOOL)
        known = self._table.numbered(kind)
        if untouched and number not in known:
            return Pose((0.0,) * POSE_NUMBERS, "")
        numbers = self._table.find(kind, number).numbers
        return Pose((*numbers, *(0.0,) * (POSE_NUMBERS - len(numbers))), "")


def _with(
    position: Position,
    frame: str,
    config: str,
    coordinates: list[Coordinate] | tuple[Coordinate, ...],
) -> Position:
    group = position.groups[0]
    made = GroupPosition(group.number, frame, group.tool, config, tuple(coordinates))
    return msgspec.structs.replace(position, groups=(made, *position.groups[1:]))
