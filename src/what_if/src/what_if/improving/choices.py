"""What of a program's text may be otherwise, and the program in which it is.

Every choice begins with a program as it was written and changes only what it names; remarks, lines
and loops stay.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

import msgspec
from scara_config.programs.tp.listing import (
    Coordinate,
    GroupPosition,
    MotionLine,
    Position,
    Program,
)

SPEEDS_PERCENT = tuple(map(float, range(100, 0, -5)))
FASTER = (4.0, 3.0, 2.0, 1.5, 1.25)
"""A path may be so many times quicker than it was; our choice."""
CORNERS = (100.0, 75.0, 50.0, 25.0, 0.0)
LOWER_MM = 5.0
"""Heights are lowered in steps of this."""
AS_USUAL = 100.0
"""ACC of a motion that says nothing of it; none is driven beyond."""
Value: TypeAlias = Any
"""A number, or of :class:`Order` a row of them: what the choice itself has given."""


class Speed(msgspec.Struct, frozen=True):
    """A motion's speed; a value has the unit of the line.

    Attributes:
        line: Its number.
        was: As written.
        unit: Of the line.
    """

    line: int
    was: float
    unit: str

    def values(self, _: Value | None) -> Sequence[Value]:
        """Return the speeds that are greater."""
        if self.unit == "%":
            return [speed for speed in SPEEDS_PERCENT if speed > self.was]
        return [float(round(self.was * times)) for times in FASTER]

    def applied(self, program: Program, value: Value) -> Program:
        """Return the program with another speed."""
        return _with_line(program, self.line, speed=value)

    def words(self, value: Value) -> tuple[str, str, str]:
        """Return what it is, how it was and how it is, in words."""
        return f"line {self.line}: speed", f"{self.was:g} {self.unit}", f"{value:g} {self.unit}"


class Corner(msgspec.Struct, frozen=True):
    """How far the corner at a motion's end is rounded.

    Attributes:
        line: Its number.
        was: CNT as written; None: FINE.
    """

    line: int
    was: float | None

    def values(self, _: Value | None) -> Sequence[Value]:
        """Return the corners that are rounder."""
        return [cnt for cnt in CORNERS if self.was is None or cnt > self.was]

    def applied(self, program: Program, value: Value) -> Program:
        """Return the program with another corner."""
        return _with_line(program, self.line, cnt=value)

    def words(self, value: Value) -> tuple[str, str, str]:
        """Return what it is, how it was and how it is, in words."""
        was = "FINE" if self.was is None else f"CNT{self.was:g}"
        return f"line {self.line}: corner", was, f"CNT{value:g}"


class Usual(msgspec.Struct, frozen=True):
    """A motion that was slowed by ACC gets the usual acceleration.

    Attributes:
        line: Its number.
        was: ACC as written.
    """

    line: int
    was: float

    def values(self, _: Value | None) -> Sequence[Value]:
        """Return the usual acceleration."""
        return [AS_USUAL]

    def applied(self, program: Program, _: Value) -> Program:
        """Return the program without ACC in that line."""
        line = program.lines[self.line - 1]
        assert isinstance(line, MotionLine)
        kept = tuple(each for each in line.options if not each.startswith("ACC"))
        return _with_line(program, self.line, options=kept)

    def words(self, value: Value) -> tuple[str, str, str]:
        """Return what it is, how it was and how it is, in words."""
        return f"line {self.line}: acceleration", f"ACC{self.was:g}", f"ACC{value:g}"


class Height(msgspec.Struct, frozen=True):
    """How high positions lie above others; a value is by how much they are lowered [mm].

    Attributes:
        positions: Their numbers.
        coordinate: Which one tells the height.
        was: The lowest of them, in that coordinate [mm].
        room: They are higher than the next ones by this, at least [mm].
        title: What the positions are, in words.
    """

    positions: tuple[int, ...]
    coordinate: str
    was: float
    room: float
    title: str

    def values(self, _: Value | None) -> Sequence[Value]:
        """Return by how much they may be lowered."""
        # The last step stays short of the other position: without any height there is no lift.
        steps = math.ceil(self.room / LOWER_MM) - 1
        return [LOWER_MM * step for step in range(steps, 0, -1)]

    def applied(self, program: Program, value: Value) -> Program:
        """Return the program with lower positions."""

        def lowered(group: GroupPosition) -> GroupPosition:
            return with_coordinates(group, {self.coordinate: lambda was: round(was - value, 6)})

        return with_positions(program, dict.fromkeys(self.positions, lowered))

    def words(self, value: Value) -> tuple[str, str, str]:
        """Return what it is, how it was and how it is, in words."""
        return (
            f"{self.title}: height ({self.coordinate})",
            f"{self.was:g} mm",
            f"{self.was - value:g} mm",
        )


class Order(msgspec.Struct, frozen=True):
    """In which order a loop does its rounds; a value says which round of the old order comes when.

    Attributes:
        rounds: Of each round the numbers of its positions, in the order of its motions.
    """

    rounds: tuple[tuple[int, ...], ...]

    def values(self, now: Value | None) -> Sequence[Value]:
        """Return the orders with two rounds exchanged, or a row of rounds turned round."""
        here = tuple(range(len(self.rounds))) if now is None else now
        # A dictionary drops doubles and keeps the order: two neighbours swapped are a row reversed.
        found: dict[tuple[int, ...], None] = {}
        for a, b in itertools.combinations(range(len(here)), 2):
            swapped = [*here]
            swapped[a], swapped[b] = swapped[b], swapped[a]
            found[tuple(swapped)] = None
            found[(*here[:a], *reversed(here[a : b + 1]), *here[b + 1 :])] = None
        return list(found)

    def applied(self, program: Program, value: Value) -> Program:
        """Return the program in which positions have changed their places."""
        taken = {
            number: old
            for round_, other in zip(self.rounds, value)
            for number, old in zip(round_, self.rounds[other])
        }
        by_number = {position.number: position for position in program.positions}
        # A place takes the number of the one that it replaces: the lines keep naming the same P[n].
        positions = tuple(
            msgspec.structs.replace(
                by_number[taken.get(position.number, position.number)], number=position.number
            )
            for position in program.positions
        )
        return msgspec.structs.replace(program, positions=positions)

    def words(self, value: Value) -> tuple[str, str, str]:
        """Return what it is, how it was and how it is, in words."""
        was = " ".join(str(number + 1) for number in range(len(self.rounds)))
        return "order of rounds", was, " ".join(str(number + 1) for number in value)


class Way(msgspec.Struct, frozen=True):
    """The same places by other joint positions; a value says by which, in words.

    Attributes:
        title: Which places, in words.
        was: The value as written.
        mirrored: The value with nothing but the arm bent to the other side; empty: there is none.
        places: By the value, of positions by number their coordinates by name [deg, mm].
    """

    title: str
    was: str
    mirrored: str
    places: dict[str, dict[int, dict[str, float]]]

    def values(self, _: Value | None) -> Sequence[Value]:
        """Return the other ways."""
        return list(self.places)

    def applied(self, program: Program, value: Value) -> Program:
        """Return the program whose joints go there otherwise."""

        def moved(to: Mapping[str, float], group: GroupPosition) -> GroupPosition:
            return with_coordinates(group, {name: partial(_put, at) for name, at in to.items()})

        changes = {number: partial(moved, to) for number, to in self.places[value].items()}
        return with_positions(program, changes)

    def words(self, value: Value) -> tuple[str, str, str]:
        """Return what it is, how it was and how it is, in words."""
        return self.title, self.was, value


Choice = Speed | Corner | Usual | Height | Order | Way


def chosen(program: Program, choices: Sequence[Choice], values: Sequence[Value | None]) -> Program:
    """Return a program with a value of each choice; None: as it was written."""
    for choice, value in zip(choices, values):
        if value is not None:
            program = choice.applied(program, value)
    return program


def _put(to: float, _: float) -> float:
    return to


def _with_line(program: Program, number: int, **fields: object) -> Program:
    lines = list(program.lines)
    lines[number - 1] = msgspec.structs.replace(lines[number - 1], **fields)
    return msgspec.structs.replace(program, lines=tuple(lines))


def with_positions(
    program: Program, changes: Mapping[int, Callable[[GroupPosition], GroupPosition]]
) -> Program:
    """Return a program in which the first group of some positions is otherwise."""

    def changed(position: Position) -> Position:
        change = changes.get(position.number)
        if change is None:
            return position
        groups = (change(position.groups[0]), *position.groups[1:])
        return msgspec.structs.replace(position, groups=groups)

    return msgspec.structs.replace(program, positions=tuple(map(changed, program.positions)))


def with_coordinates(
    group: GroupPosition, changes: Mapping[str, Callable[[float], float]]
) -> GroupPosition:
    """Return a position with some coordinates changed."""

    def changed(each: Coordinate) -> Coordinate:
        if each.name not in changes or each.value is None:
            return each
        return msgspec.structs.replace(each, value=changes[each.name](each.value))

    return msgspec.structs.replace(group, coordinates=tuple(map(changed, group.coordinates)))
