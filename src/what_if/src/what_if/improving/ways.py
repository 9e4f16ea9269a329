"""The same places with the table turned otherwise, or the arm bent to the other side.

Parts are discs, so how the tool is turned about the vertical is free where there are parts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import msgspec
from scara_config.palletise import MM, Palletise
from scara_config.programs.files import Taught, axis_names
from scara_config.programs.steps import GripperStep, MoveStep, Step
from scara_control.errors import ScaraControlError
from scara_control.kinematics.arm_kinematics import ArmKinematics
from scara_control.kinematics.scara import Elbow

from what_if.handling import switch
from what_if.improving.choices import Way
from what_if.improving.finding import Motion, numbers_read
from what_if.world import World

TURNS_DEG = tuple(10.0 * step for step in range(-6, 7))
"""The table is turned by so much at most; our choice."""
DIGITS = 6
"""Of coordinates, as the robot's own files have them: 1e-6 deg are 11 nm at 0.65 m."""


class Place(msgspec.Struct, frozen=True):
    """A place that is touched, with the positions straight above it.

    Attributes:
        name: Of the position that touches, in words.
        numbers: Of all its positions.
        turns: It turns with the table.
        table: Where the table stands [rad].
        elbow: How the arm is bent there.
    """

    name: str
    numbers: tuple[int, ...]
    turns: bool
    table: float
    elbow: Elbow


def ways_of(
    world: World, taught: Taught, steps: Sequence[Step], motions: Sequence[Motion]
) -> list[Way]:
    """Return the choices of a program's places; without parts and a table there are none."""
    work, robot = world.cell.work, world.cell.robot
    if work is None or robot.geometry is None:
        return []
    arm = _Arm(world, taught, work)
    places = list(arm.places(steps, motions))
    found = []
    for table in dict.fromkeys(place.table for place in places):
        here = [place for place in places if place.table == table]
        on_table = [place for place in here if place.turns]
        others = [place for place in here if not place.turns]
        if on_table:
            found.append(arm.turned(table, on_table, others))
        if others:
            found.append(arm.bent(others))
    return found


class _Arm:
    """An arm that goes to the places of a program, beside a table that turns."""

    def __init__(self, world: World, taught: Taught, work: Palletise) -> None:
        robot = world.cell.robot
        self._world, self._taught, self._work = world, taught, work
        self._arm = ArmKinematics(robot)
        self._names = {joint.name: name for name, joint in axis_names(robot).items()}
        self._columns = [robot.joints.index(joint) for joint in robot.arm_joints]
        self._slides = {k for k in self._columns if robot.joints[k].si_unit == "m"}
        (self._table,) = (
            k for k, joint in enumerate(robot.joints) if joint.name == work.table.joint
        )

    def places(self, steps: Sequence[Step], motions: Sequence[Motion]) -> Iterator[Place]:
        """Yield the places that are touched, each once."""
        cell = self._world.cell
        twin = [k for k, joint in enumerate(cell.robot.joints) if joint.twin]
        column = cell.tree.joints.index(self._work.table.joint)
        numbers = sorted({motion.position for motion in motions} & set(self._taught.positions))
        read = numbers_read(self._taught.flow.program)
        parts, q, seen = self._world.parts, self._world.q, set[tuple[float, ...]]()
        target: tuple[float, ...] = ()
        for step in steps:
            if isinstance(step, MoveStep):
                q = tuple(step.target[k] for k in twin)
                # A place of a program that is called is not this one's to change.
                target = () if step.program else step.target
            if not isinstance(step, GripperStep):
                continue
            done = switch(cell, parts, q, step.on)
            # What is gripped lay there before, what is let go lies there afterwards.
            link = next(
                (p.link for p in (parts if step.on else done.parts) if p.name == done.part), ""
            )
            parts = done.parts
            key = self._key(target)
            if not link or not target or key in seen:
                continue
            seen.add(key)
            alike = tuple(n for n in numbers if self._key(self._taught.positions[n]) == key)
            elbow = self._arm.forward([target[k] for k in self._columns]).elbow
            # What a line does with the numbers of one of them belongs to the place as it is.
            if elbow is not None and alike and not read & set(alike):
                turns = column in cell.tree.movers[link]
                yield Place(self._named(target), alike, turns, target[self._table], elbow)

    def turned(self, table: float, places: Sequence[Place], others: Sequence[Place]) -> Way:
        """Return the choice of a table's angle; places beside the table take it over."""
        joint = self._world.cell.robot.joints[self._table]
        name = self._names[joint.name]
        found = {}
        for turn in TURNS_DEG:
            angle = table + math.radians(turn)
            if not joint.lower <= angle <= joint.upper:
                continue
            at = {name: round(angle / joint.scale, DIGITS)}
            beside = {n: at for place in others for n in place.numbers}
            for other in (False, True):
                moved = self._moved(places, math.radians(turn), other)
                # Without a turn and with the same elbow it is the program as it was written.
                if moved and (turn or other):
                    value = self._said(angle, _bend(places[0].elbow, other))
                    found[value] = beside | {n: each | at for n, each in moved.items()}
        was, mirrored = (
            self._said(table, _bend(places[0].elbow, other)) for other in (False, True)
        )
        mirrored = mirrored if mirrored in found else ""
        return Way(f"{_title(places)}: table, elbow", was, mirrored, found)

    def bent(self, places: Sequence[Place]) -> Way:
        """Return the choice of the side to which the arm is bent."""
        other = self._moved(places, 0.0, True)
        value = _bend(places[0].elbow, True).value
        if not other:
            return Way(f"{_title(places)}: elbow", places[0].elbow.value, "", {})
        return Way(f"{_title(places)}: elbow", places[0].elbow.value, value, {value: other})

    def _moved(
        self, places: Sequence[Place], turn: float, other: bool
    ) -> dict[int, dict[str, float]]:
        """Return the arm's coordinates at all positions of places; empty: it cannot go there."""
        joints, found = self._world.cell.robot.joints, {}
        for place in places:
            for number in place.numbers:
                here = [self._taught.positions[number][k] for k in self._columns]
                try:
                    x, y, z = self._arm.forward(here).position
                    # The table counts in [mm] and answers in [m].
                    x, y = self._work.table.turned((x / MM, y / MM), turn)
                    q = self._arm.inverse(x, y, z, _bend(place.elbow, other), here).chosen.q
                except ScaraControlError:
                    return {}
                found[number] = {
                    self._names[joints[k].name]: round(at / joints[k].scale, DIGITS)
                    for k, at in zip(self._columns, q)
                    if k not in self._slides
                }
        return found

    def _key(self, target: Sequence[float]) -> tuple[float, ...]:
        """Return what is the same at all positions straight above each other."""
        return tuple(round(at, DIGITS) for k, at in enumerate(target) if k not in self._slides)

    def _named(self, target: tuple[float, ...]) -> str:
        number = next(n for n, place in self._taught.positions.items() if place is target)
        lines = self._taught.flow.program.positions
        comment = next(each.comment for each in lines if each.number == number)
        return comment or f"P[{number}]"

    def _said(self, table: float, elbow: Elbow) -> str:
        scale = self._world.cell.robot.joints[self._table].scale
        return f"{table / scale:.1f} deg, {elbow.value}"


def _bend(elbow: Elbow, other: bool) -> Elbow:
    """Return how the arm is bent, or to the other side."""
    if not other:
        return elbow
    return Elbow.LEFTY if elbow is Elbow.RIGHTY else Elbow.RIGHTY


def _title(places: Sequence[Place]) -> str:
    return ", ".join(place.name for place in places)
