"""A program that is being taught: each edit returns a new one that the robot's reader accepts.

The draft is the maker's text and nothing else: an edit changes the program, prints it and reads it
back in the same call. What does not come back the same is refused, in the reader's own words.
A line is named by its number in the listing, from 1; what is new stands behind line ``after``, and
0 is in front of all.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import msgspec
from scara_config import ConfigError, Robot
from scara_config.programs.files import position_faults, taught_of
from scara_config.programs.tp.execution import flow_of
from scara_config.programs.tp.listing import (
    AssignLine,
    Binary,
    For,
    Indexed,
    Line,
    MotionLine,
    Name,
    Position,
    Program,
    Remark,
    Wait,
    WaitUntil,
    Word,
)
from scara_config.programs.tp.printer import print_program
from scara_config.programs.tp.reader import read

NAME = re.compile(r"[A-Z][A-Z0-9_]{0,31}")
"""Of a program; our choice: what every controller of the maker takes."""
UNITS = {"J": "%", "L": "mm/sec"}
FIRST_COUNTER = 51
"""Register of the first loop, as in the programs that come with the robots."""
LONGEST_WAIT_S = 327.67
"""Source: the maker's operator's manual B-83284EN/09, WAIT."""
SUCTION, VACUUM = Indexed("RO", (1.0,), 0, "suction"), Indexed("RI", (1.0,), 0, "vacuum")
MOST_LINES = 999
"""Our choice: more is no program that a person teaches."""


class TeachError(ValueError):
    """An edit cannot be made; the text says why."""


class Draft(msgspec.Struct, frozen=True):
    """A program, valid for the robot's reader.

    Attributes:
        program: As it was read back from its own text.
    """

    program: Program

    @property
    def text(self) -> str:
        """Of the file ``NAME.LS``."""
        return print_program(self.program)


def draft_of(text: str, robot: Robot, source: str = "the file") -> Draft:
    """Return a program from its text.

    Raises:
        TeachError: It is no program of this robot; in the reader's words.
    """
    try:
        return checked(read(text, source), robot)
    except ConfigError as error:
        raise TeachError(str(error)) from error


def empty(name: str, robot: Robot) -> Draft:
    """Return a program without lines."""
    return renamed(checked(Program("TAUGHT", ()), robot), robot, name)


def checked(program: Program, robot: Robot) -> Draft:
    """Return a program as it comes back from its own text.

    Raises:
        TeachError: It does not, or this robot cannot make it; in the reader's words.
    """
    # It is a file's name too: no other folder may stand in it.
    if not NAME.fullmatch(program.name):
        rule = "capitals, digits and underlines, 32 at most, a capital first"
        raise TeachError(f"{program.name!r}: {rule}")
    if len(program.lines) > MOST_LINES:
        raise TeachError(f"{len(program.lines)} lines: allowed are {MOST_LINES}")
    try:
        found = read(print_program(program), program.name)
        for position in found.positions:
            for _, fault in position_faults(position, robot):
                raise TeachError(f"P[{position.number}].{fault}")
        taught_of(found, robot, program.name)
    except ConfigError as error:
        raise TeachError(str(error)) from error
    for made, back in zip(program.lines, found.lines):
        if made != back:
            raise TeachError(f"{made} comes back from its text as {back}")
    if len(found.lines) != len(program.lines) or found.positions != program.positions:
        raise TeachError("the program does not come back from its text")
    return Draft(found)


def renamed(draft: Draft, robot: Robot, name: str) -> Draft:
    """Give the program another name.

    Raises:
        TeachError: No controller takes it.
    """
    return checked(msgspec.structs.replace(draft.program, name=name), robot)


def recorded(
    draft: Draft,
    robot: Robot,
    after: int,
    position: Position,
    kind: str,
    speed: float,
    cnt: float | None,
) -> Draft:
    """Add a motion to a new position.

    Args:
        draft: The program.
        robot: Its joints.
        after: The line in front of it.
        position: Its number is chosen here.
        kind: J or L.
        speed: In percent, or of the tool [mm/s].
        cnt: How far its corner is rounded, 0..100; None: FINE.

    Raises:
        TeachError: A number is out of range, or a joint.
    """
    taken = [each.number for each in draft.program.positions]
    new = msgspec.structs.replace(position, number=max(taken, default=0) + 1)
    target = Indexed("P", (float(new.number),), 0, new.comment)
    line = MotionLine(kind, (target,), speed, UNITS[kind], cnt)
    return inserted(draft, robot, after, (line,), (*draft.program.positions, new))


def touched_up(draft: Draft, robot: Robot, number: int, position: Position) -> Draft:
    """Put another position in place of that of a motion; whoever goes there too goes with it.

    Raises:
        TeachError: The line is no motion to a position of its own.
    """
    place = int(own_position(draft, number).index[0])  # type: ignore[arg-type]
    positions = [
        msgspec.structs.replace(position, number=place, comment=old.comment)
        if old.number == place
        else old
        for old in draft.program.positions
    ]
    return changed(draft, robot, draft.program.lines, tuple(positions))


def own_position(draft: Draft, number: int) -> Indexed:
    """Return the P[n] that a line goes to.

    Raises:
        TeachError: It is no motion, or a register says where it goes.
    """
    line = line_of(draft, number)
    if not isinstance(line, MotionLine):
        raise TeachError(f"line {number} is no motion")
    target = line.targets[-1]
    if target.kind != "P" or not isinstance(target.index[0], float):
        raise TeachError(f"a register says where line {number} goes: it has no position of its own")
    return target


def line_of(draft: Draft, number: int) -> Line:
    """Return a line by its number.

    Raises:
        TeachError: There is none.
    """
    if not 1 <= number <= len(draft.program.lines):
        raise TeachError("no line is chosen" if number < 1 else f"there is no line {number}")
    return draft.program.lines[number - 1]


def moved(draft: Draft, robot: Robot, number: int, by: int) -> Draft:
    """Exchange a line with the one above (-1) or below (1).

    Raises:
        TeachError: There is none, or a loop would be torn.
    """
    first, second = line_of(draft, number), line_of(draft, number + by)
    lines = list(draft.program.lines)
    lines[number - 1], lines[number + by - 1] = second, first
    return changed(draft, robot, tuple(lines))


def deleted(draft: Draft, robot: Robot, number: int) -> Draft:
    """Take a line away; of a loop or an IF all its words, and a position that nobody needs now."""
    lines = draft.program.lines
    gone = line_of(draft, number)
    whole = {number - 1}
    partners = flow_of(draft.program, draft.program.name).partners
    pairs = [{begin, end} for begin, end in partners.items()]
    # An IF leads to its ELSE and that to its ENDIF: it is asked until no pair is torn.
    while more := [pair for pair in pairs if pair & whole and not pair <= whole]:
        whole |= set().union(*more)
    kept = tuple(line for index, line in enumerate(lines) if index not in whole)
    freed = {target for target in _targets(gone) if target is not None}
    return changed(draft, robot, kept, needed_positions(draft.program.positions, freed, kept))


def needed_positions(
    positions: tuple[Position, ...], freed: set[int], lines: tuple[Line, ...]
) -> tuple[Position, ...]:
    """Return the positions without those of ``freed`` that no line goes to.

    Where a register says which one a line goes to, that may be each of them: all stay.
    """
    needed = {target for line in lines for target in _targets(line)}
    freed = set() if None in needed else freed - needed
    return tuple(each for each in positions if each.number not in freed)


def _targets(line: Line) -> Iterator[int | None]:
    """Yield the numbers of a motion's positions; None: a register says which."""
    for target in line.targets if isinstance(line, MotionLine) else ():
        if target.kind == "P":
            index = target.index[0]
            yield int(index) if isinstance(index, float) else None


def with_speed(draft: Draft, robot: Robot, number: int, speed: float) -> Draft:
    """Give a motion another speed [percent, or mm/s of a line]."""
    line = _motion(draft, number)
    unit = UNITS.get(line.kind, "mm/sec")
    return _with_line(draft, robot, number, msgspec.structs.replace(line, speed=speed, unit=unit))


def with_corner(draft: Draft, robot: Robot, number: int, cnt: float | None) -> Draft:
    """Round a motion's corner by CNT 0..100; None: FINE."""
    line = _motion(draft, number)
    return _with_line(draft, robot, number, msgspec.structs.replace(line, cnt=cnt))


def noted(draft: Draft, robot: Robot, number: int, text: str) -> Draft:
    """Name the position of a motion, change a remark, or add one behind any other line."""
    text = text.strip()
    line = line_of(draft, number) if number else None
    if not isinstance(line, MotionLine) and not text:
        raise TeachError("a remark has words: type them first")
    if isinstance(line, Remark):
        return _with_line(draft, robot, number, msgspec.structs.replace(line, text=text))
    if not isinstance(line, MotionLine):
        return inserted(draft, robot, number, (Remark("!", text),))
    wanted = own_position(draft, number)

    def name(target: Indexed) -> Indexed:
        same = (target.kind, target.index) == (wanted.kind, wanted.index)
        return msgspec.structs.replace(target, comment=text) if same else target

    lines = tuple(
        msgspec.structs.replace(each, targets=tuple(map(name, each.targets)))
        if isinstance(each, MotionLine)
        else each
        for each in draft.program.lines
    )
    positions = tuple(
        msgspec.structs.replace(each, comment=text) if each.number == wanted.index[0] else each
        for each in draft.program.positions
    )
    return changed(draft, robot, lines, positions)


def waiting(draft: Draft, robot: Robot, after: int, seconds: float) -> Draft:
    """Add a wait [s]; the robot counts hundredths.

    Raises:
        TeachError: It is too long or no time at all.
    """
    seconds = round(seconds, 2)
    if not 0.0 < seconds <= LONGEST_WAIT_S:
        raise TeachError(f"a wait of {seconds:g} s is outside ]0, {LONGEST_WAIT_S:g}]")
    return inserted(draft, robot, after, (Wait(seconds),))


def gripping(draft: Draft, robot: Robot, after: int, close: bool) -> Draft:
    """Switch the suction and wait until the vacuum is there, or gone."""
    level = Name("ON" if close else "OFF")
    until = WaitUntil(Binary("=", VACUUM, level))
    return inserted(draft, robot, after, (AssignLine(SUCTION, level), until))


def looped(draft: Draft, robot: Robot, first: int, last: int, times: int) -> Draft:
    """Repeat the lines ``first`` to ``last``.

    Raises:
        TeachError: They hold half of a block, or there are none.
    """
    if not 1 <= times <= MOST_LINES:
        raise TeachError(f"{times} rounds are outside [1, {MOST_LINES}]")
    whole_block(draft, first, last)
    lines = draft.program.lines
    counter = Indexed("R", (float(free_register(lines)),), 0, "round")
    begin = For(counter, 1.0, float(times))
    whole = (begin, *lines[first - 1 : last], Word("ENDFOR"))
    return changed(draft, robot, (*lines[: first - 1], *whole, *lines[last:]))


def whole_block(draft: Draft, first: int, last: int) -> None:
    """Make sure that lines can be put into a loop.

    Raises:
        TeachError: They hold half of a block, or there are none.
    """
    for number in (first, last):
        line_of(draft, number)
    inside = range(first - 1, last)
    partners = flow_of(draft.program, draft.program.name).partners
    if first > last or any((a in inside) != (b in inside) for a, b in partners.items()):
        raise TeachError(f"lines {first} to {last} hold half of a block")


def free_register(lines: tuple[Line, ...]) -> int:
    """Return the number of the first register that no line uses, nor one behind it."""
    taken = [int(index) for index in _registers(lines) if index >= FIRST_COUNTER]
    return max(taken, default=FIRST_COUNTER - 1) + 1


def _registers(thing: object) -> Iterator[float]:
    """Yield the numbers of all registers R[n] within lines and their expressions."""
    if isinstance(thing, tuple):
        for each in thing:
            yield from _registers(each)
    elif isinstance(thing, msgspec.Struct):
        if isinstance(thing, Indexed) and thing.kind == "R" and isinstance(thing.index[0], float):
            yield thing.index[0]
        for name in thing.__struct_fields__:
            yield from _registers(getattr(thing, name))


def _motion(draft: Draft, number: int) -> MotionLine:
    line = line_of(draft, number)
    if not isinstance(line, MotionLine):
        raise TeachError(f"line {number} is no motion")
    return line


def _with_line(draft: Draft, robot: Robot, number: int, line: Line) -> Draft:
    lines = draft.program.lines
    return changed(draft, robot, (*lines[: number - 1], line, *lines[number:]))


def inserted(
    draft: Draft,
    robot: Robot,
    after: int,
    lines: tuple[Line, ...],
    positions: tuple[Position, ...] | None = None,
) -> Draft:
    """Put lines behind line ``after``, and positions in place of those that are there."""
    old = draft.program.lines
    if not 0 <= after <= len(old):
        raise TeachError(f"there is no line {after}")
    return changed(draft, robot, (*old[:after], *lines, *old[after:]), positions)


def changed(
    draft: Draft,
    robot: Robot,
    lines: tuple[Line, ...],
    positions: tuple[Position, ...] | None = None,
) -> Draft:
    """Put lines, and perhaps positions, in place of those that are there."""
    program = msgspec.structs.replace(draft.program, lines=lines)
    if positions is not None:
        program = msgspec.structs.replace(program, positions=positions)
    return checked(program, robot)
