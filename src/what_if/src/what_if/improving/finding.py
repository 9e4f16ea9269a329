"""Which choices a program has: from its text and from what it does.

What a person has decided about touching stays: waits, the motion that ends where the suction is
switched, and the height at which that motion begins.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

import msgspec
from scara_config import Robot
from scara_config.programs.files import Taught, axis_names, is_cartesian
from scara_config.programs.steps import GripperStep, MoveStep, PathStep, Step
from scara_config.programs.tp.execution import Flow
from scara_config.programs.tp.listing import (
    AssignLine,
    Blank,
    For,
    Indexed,
    Label,
    Line,
    MotionLine,
    Position,
    Program,
    Remark,
    Wait,
    WaitUntil,
    Word,
)
from scara_config.programs.tp.printer import print_line

from what_if.converting import READS
from what_if.improving.choices import AS_USUAL, Choice, Corner, Height, Order, Speed, Usual

SAME = 1e-3
"""Coordinates that differ by less are the same [deg, mm]; our choice."""
_ACC = re.compile(r"ACC\s*(\d+)")


class Motion(msgspec.Struct, frozen=True):
    """A motion that the program makes.

    Attributes:
        line: Its number.
        position: Number of P[n] that it ends at; 0: at a register's.
        next_moves: Behind it comes another motion, and nothing waits or is switched before.
        touches: It ends where the suction is switched.
        approaches: Behind it comes a motion that touches.
    """

    line: int
    position: int
    next_moves: bool = False
    touches: bool = False
    approaches: bool = False


def motions_of(taught: Taught, steps: Sequence[Step]) -> list[Motion]:
    """Return the motions of a program's own lines, in the order in which they are made."""
    # A step's target is the very object that the program holds, so it tells the number.
    numbers = {id(place): number for number, place in taught.positions.items()}
    numbers |= {id(each.pose): number for number, each in taught.poses.items()}
    found: list[Motion] = []
    for step, after in pairwise((*steps, None)):
        match step:
            case MoveStep() | PathStep() if not step.program:
                place = step.target if isinstance(step, MoveStep) else step.targets[-1].place
                moves = isinstance(after, MoveStep | PathStep) and not after.program
                found.append(Motion(step.line, numbers.get(id(place), 0), moves))
            case GripperStep() if found:
                found[-1] = msgspec.structs.replace(found[-1], touches=True)
    touching = [each.touches for each in found[1:]] + [False]
    return [msgspec.structs.replace(each, approaches=after) for each, after in zip(found, touching)]


def numbers_read(program: Program) -> set[int]:
    """Return the positions whose numbers a line reads that is no motion; by a register: all."""
    lines = (each for each in program.lines if not isinstance(each, MotionLine | Remark))
    found = {number for line in lines for number in READS.findall(print_line(line))}
    known = {position.number for position in program.positions}
    return known if "" in found else {int(number) for number in found}


def choices_of(taught: Taught, steps: Sequence[Step], robot: Robot) -> list[Choice]:
    """Return what of a program may be otherwise."""
    motions = motions_of(taught, steps)
    over = heights_of(taught, motions, robot)
    via = {number for height in over for number in height.positions}
    lines = sorted({each.line for each in motions if not each.touches})
    lines = [line for line in lines if not any(m.touches for m in motions if m.line == line)]
    found: list[Choice] = []
    for number in lines:
        line = taught.flow.program.lines[number - 1]
        here = [each for each in motions if each.line == number]
        if not isinstance(line, MotionLine):
            continue
        if isinstance(line.speed, float) and line.unit in ("%", "mm/sec"):
            found.append(Speed(number, line.speed, line.unit))
        slowed = [int(each[1]) for each in map(_ACC.fullmatch, line.options) if each]
        found += [Usual(number, float(acc)) for acc in slowed if acc < AS_USUAL]
        free = all(each.next_moves and not each.approaches for each in here[:-1])
        free &= not here[-1].approaches and (here[-1].next_moves or len(here) > 1)
        passed = isinstance(line.cnt, float) or {each.position for each in here} <= via
        if free and passed and _only_moves_follow(taught.flow, number):
            found.append(Corner(number, line.cnt if isinstance(line.cnt, float) else None))
    rounds = rounds_of(taught.flow, motions)
    all_of_them = [*([Order(rounds)] if rounds else []), *found, *over]
    return [choice for choice in all_of_them if choice.values(None)]


def heights_of(taught: Taught, motions: Sequence[Motion], robot: Robot) -> list[Height]:
    """Return the positions above others that nothing but motions depends on, line by line."""
    positions = {position.number: position for position in taught.flow.program.positions}
    # 0 stands for a place in a register: the program's text has no coordinates of it.
    kept = {each.position for each in motions if each.touches or each.approaches} | {0}
    # Whatever is set or waited for at a place belongs to that place.
    flow = taught.flow
    kept |= {each.position for each in motions if not _only_moves_follow(flow, each.line)}
    kept |= numbers_read(flow.program)
    # Positions that one line goes to belong together.
    groups: list[set[int]] = []
    for line in sorted({each.line for each in motions}):
        here = {each.position for each in motions if each.line == line}
        joined = [group for group in groups if group & here]
        groups = [group for group in groups if not group & here]
        groups.append(here.union(*joined))
    beside: dict[int, set[int]] = {}
    for one, other in pairwise(each.position for each in motions):
        beside.setdefault(one, set()).add(other)
        beside.setdefault(other, set()).add(one)
    found = []
    for group in groups:
        if group & kept:
            continue
        name = _height_name(positions[min(group)], robot)
        rooms = [
            max(
                (
                    _above(positions[k], positions[other], name)
                    for other in beside.get(k, set()) - {0}
                ),
                default=0.0,
            )
            for k in group
        ]
        if name and min(rooms) > SAME:
            numbers = tuple(sorted(group))
            there = [positions[k].groups[0].coordinates for k in numbers]
            was = min(next(c.value or 0.0 for c in each if c.name == name) for each in there)
            found.append(Height(numbers, name, was, min(rooms), ", ".join(_runs(numbers))))
    return found


def rounds_of(flow: Flow, motions: Sequence[Motion]) -> tuple[tuple[int, ...], ...]:
    """Return the positions of each round of the program's first loop; empty: they cannot change.

    Every round has the same lines, no position belongs to two of them, and nothing but motions,
    waits and the suction can be seen from outside.
    """
    lines = flow.program.lines
    for begin in (k for k, line in enumerate(lines) if isinstance(line, For)):
        # Lines count from 1 and indexes from 0: the line behind FOR is two more than FOR's index.
        body = range(begin + 2, flow.partners[begin] + 1)
        inside = [each for each in motions if each.line in body]
        quiet = all(map(_stays_inside, lines[begin + 1 : flow.partners[begin]]))
        if not inside or not quiet:
            continue
        first = inside[0].line
        starts = [k for k, each in enumerate(inside) if each.line == first]
        rounds = [inside[a:b] for a, b in pairwise((*starts, len(inside)))]
        alike = all([m.line for m in each] == [m.line for m in rounds[0]] for each in rounds)
        places = tuple(tuple(each.position for each in round_) for round_ in rounds)
        others = {each.position for each in motions if each.line not in body} | {0}
        others |= numbers_read(flow.program)
        if (
            alike
            and len(rounds) > 1
            and not others & {n for row in places for n in row}
            and _apart(places)
        ):
            return places
    return ()


def _apart(places: Sequence[Sequence[int]]) -> bool:
    """Tell whether each position has one place in one round, and another in no other."""
    rows = [set(row) for row in places]
    alike = all(
        [row.index(n) for n in row] == [places[0].index(n) for n in places[0]] for row in places
    )
    return alike and sum(map(len, rows)) == len(set[int]().union(*rows))


def _stays_inside(line: Line) -> bool:
    """Tell whether of a line of a loop nobody outside learns which round it is."""
    if isinstance(line, AssignLine):
        return isinstance(line.target, Indexed) and line.target.kind in ("R", "RO")
    return isinstance(line, MotionLine | Wait | WaitUntil | Remark | Blank)


def _only_moves_follow(flow: Flow, number: int) -> bool:
    """Tell whether up to the next motion there is nothing that somebody could see or wait for."""
    lines = flow.program.lines
    waiting, seen = [number], set[int]()
    while waiting:
        index = waiting.pop()
        if index in seen or index >= len(lines) or isinstance(lines[index], MotionLine):
            continue
        seen.add(index)
        line = lines[index]
        quiet = isinstance(line, Remark | Blank | Label | For) or line == Word("ENDFOR")
        if isinstance(line, AssignLine):
            quiet = isinstance(line.target, Indexed) and line.target.kind == "R"
        if not quiet:
            return False
        waiting.append(index + 1)
        if line == Word("ENDFOR"):
            waiting.append(flow.partners[index])
    return True


def _height_name(position: Position, robot: Robot) -> str:
    """Return the coordinate that grows with a position's height; empty: there is none."""
    if is_cartesian(position):
        return "Z" if position.groups[0].frame == "0" else ""
    slides = [
        name
        for name, joint in axis_names(robot).items()
        if joint.screw_axis is not None and joint.si_unit == "m" and joint.screw_axis[5] > 0.0
    ]
    return slides[0] if len(slides) == 1 else ""


def _above(position: Position, other: Position, name: str) -> float:
    """Return how far a position is straight above another [mm]; 0: it is not."""
    if not name or is_cartesian(position) != is_cartesian(other):
        return 0.0
    apart = {
        one.name: (one.value or 0.0) - (two.value or 0.0)
        for one, two in zip(position.groups[0].coordinates, other.groups[0].coordinates)
    }
    aside = max((abs(gap) for key, gap in apart.items() if key != name), default=math.inf)
    return max(apart.get(name, 0.0), 0.0) if aside <= SAME else 0.0


def _runs(numbers: Sequence[int]) -> Iterator[str]:
    """Yield numbers as ``P[1] to P[9]``."""
    begin = numbers[0]
    for number in numbers:
        if number + 1 not in numbers:
            yield f"P[{begin}]" if begin == number else f"P[{begin}] to P[{number}]"
            begin = next((each for each in numbers if each > number), 0)
