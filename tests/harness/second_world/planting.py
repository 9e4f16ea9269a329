"""Random programs: free ones, and ones into which a harm was planted; MuJoCo says which is which.

A free program keeps off everything by more than is asked for, with things that stand beside its
way. A planted one has an instant at which the oracle finds an overlap, or a joint beyond the
URDF's range, or a part that is let go too far above everything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from scara_config import KeepOut
from scara_config.programs.files import ProgramSteps
from scara_config.programs.steps import GripperStep, MoveStep, WaitStep
from what_if.cell_files_io import find_program
from what_if.world import Obstacle, World

from harness.second_world.truth import Thing, Truth, Vector

CLEAR = 0.002
"""A free program stays so far [m] from everything; the judge asks for nearer_mm, 1 mm."""
OFF_ZONES = 0.008
"""Likewise from keep-out zones; the judge asks for keep_out_clearance_mm, 5 mm."""
DEEP = 0.0002
"""A planted harm overlaps by at least so much [m]."""
Case = tuple[World, ProgramSteps]


@dataclass
class Bench:
    """A world, the truth about it, a source of chance and the folder of the YAML files."""

    world: World
    truth: Truth
    rng: np.random.Generator
    config: Path

    def random(self) -> Vector:
        """Return joint positions all over the ranges."""
        low, high = self.truth.ranges.T
        return tuple(self.rng.uniform(low, high).tolist())

    def free(self, truth: Truth | None = None, start: Vector = (), count: int = 0) -> list[Vector]:
        """Return the targets of moves that are free from the beginning to the end.

        Args:
            truth: The cell with what else stands in it.
            start: Where the joints are first; default: where those of the world are.
            count: So many moves; default: two to four.
        """
        truth, here = truth or self.truth, start or self.world.q
        found: list[Vector] = []
        wanted = count or int(self.rng.integers(2, 5))
        while len(found) < wanted:
            there = self.random()
            if is_free(truth, here, there):
                found.append(there)
                here = there
        return found

    def a_place(self, targets: Sequence[Vector]) -> None:
        """Put the oracle's joints somewhere on the way of a program."""
        rows = [self.world.q, *targets]
        k, part = int(self.rng.integers(len(rows) - 1)), float(self.rng.uniform(0.2, 1.0))
        a, b = np.array(rows[k]), np.array(rows[k + 1])
        self.truth.pose(a + part * (b - a))

    def now(self) -> Vector:
        """Return where the oracle's joints are."""
        return tuple(self.truth.joints().tolist())


def is_free(truth: Truth, start: Vector, end: Vector) -> bool:
    """Return whether a move keeps off everything."""
    solid = [*truth.bodies, *truth.own, *truth.table]
    # The end decides most: it is asked first.
    if truth.at(end, solid) < CLEAR or truth.at(end, truth.zones) < OFF_ZONES:
        return False
    return truth.keeps_off(start, end, solid, CLEAR) and truth.keeps_off(
        start, end, truth.zones, OFF_ZONES
    )


def moves(targets: Sequence[Vector], world: World, first: int = 1) -> list[MoveStep]:
    """Return targets as lines of a program; what the twin does not move stays at 0."""
    robot = world.cell.robot
    names = [joint.name for joint in robot.twin_joints]
    rows = [dict(zip(names, target)) for target in targets]
    return [
        MoveStep(k, tuple(row.get(joint.name, 0.0) for joint in robot.joints), 50.0, True)
        for k, row in enumerate(rows, first)
    ]


def program(*lines: MoveStep | WaitStep | GripperStep) -> ProgramSteps:
    """Return lines as a program."""
    return ProgramSteps("RANDOM", lines)


def free_case(bench: Bench) -> Case:
    """Return a free program, half of them with posts, a person or a zone beside the way."""
    targets = bench.free()
    for _ in range(int(bench.rng.integers(0, 4))):
        world = _with_thing(bench)
        truth = Truth(world)
        ways = [bench.world.q, *targets]
        if all(is_free(truth, a, b) for a, b in pairwise(ways)):
            return world, program(*moves(targets, world))
    return bench.world, program(*moves(targets, bench.world))


def _with_thing(bench: Bench) -> World:
    """Return the world with a post, a person or a zone somewhere."""
    rng = bench.rng
    x, y = rng.uniform(-0.7, 0.9, 2).tolist()
    kind = int(rng.integers(3))
    if kind == 0:
        size = (float(rng.uniform(1e-4, 2e-2)), float(rng.uniform(0.05, 0.6)))
        place = (x, y, float(rng.uniform(-0.1, 0.3)))
        return replace(bench.world, obstacles=(Obstacle("post", "cylinder", size, place),))
    if kind == 1:
        return replace(bench.world, people=((1.6 * x, 1.6 * y, 0.0),))
    low = 1e3 * np.array((x, y, float(rng.uniform(-0.1, 0.3))))
    return _zoned(bench.world, low, low + rng.uniform(5.0, 80.0, 3))


def _zoned(world: World, low: Sequence[float], high: Sequence[float]) -> World:
    a, b = ((float(v[0]), float(v[1]), float(v[2])) for v in (low, high))
    return replace(world, zones=(*world.zones, KeepOut("planted", a, b)))


def held_case(bench: Bench) -> Case:
    """Return PALLETISE's first part on a free detour between its stand and the pallet."""
    task = Task.of(bench)
    held = task.truth(bench)
    lifted, above = task.place(task.grip + 1), task.place(task.release - 2)
    while True:
        (detour,) = bench.free(held, lifted, 1)
        if is_free(held, detour, above):
            break
    lines = (*task.lines[: task.grip + 2], *moves([detour], bench.world, 90))
    return bench.world, program(*lines, *task.lines[task.release - 2 : task.release + 2])


@dataclass(frozen=True)
class Task:
    """PALLETISE until its first part is placed.

    Attributes:
        lines: All its lines.
        grip: The first line that grips; the one before it picks, the one after it lifts.
        release: The first that lets go.
        columns: Of the twin's joints among the robot's.
    """

    lines: tuple[MoveStep | WaitStep | GripperStep, ...]
    grip: int
    release: int
    columns: tuple[int, ...]

    @staticmethod
    def of(bench: Bench) -> Task:
        """Read the program."""
        cell = bench.world.cell
        lines = find_program(cell, "PALLETISE", bench.config).steps
        kept = tuple(line for line in lines if not isinstance(line, WaitStep))
        grip, release = [k for k, line in enumerate(kept) if isinstance(line, GripperStep)][:2]
        columns = tuple(k for k, joint in enumerate(cell.robot.joints) if joint.twin)
        return Task(kept, grip, release, columns)

    def place(self, number: int) -> Vector:
        """Return where a move's line leads, joints of the twin."""
        line = self.lines[number]
        assert isinstance(line, MoveStep)
        return tuple(line.target[k] for k in self.columns)

    def truth(self, bench: Bench) -> Truth:
        """Return the oracle with the part in hand, as it hangs after the pick."""
        world, tool = bench.world, bench.world.cell.robot.tool_frame
        bench.truth.pose(self.place(self.grip - 1))
        at = bench.truth.link(tool)[:3, 3]
        near = [np.linalg.norm(bench.truth.link(part.name)[:3, 3] - at) for part in world.parts]
        part = world.parts[int(np.argmin(near))]
        pose = np.linalg.inv(bench.truth.link(tool)) @ bench.truth.link(part.name)
        assert world.cell.work is not None
        kind = world.cell.work.parts
        held = Thing(part.name, tool, pose, "cylinder", (kind.radius, kind.height))
        left = tuple(other for other in world.parts if other is not part)
        return Truth(replace(world, parts=left), held)


def _planted(tries: Iterator[Case | None]) -> Case:
    return next(case for case in tries if case is not None)


def into(*links: str) -> Callable[[Bench], Case]:
    """Return what plants the end of a program inside one of these links."""

    def plant(bench: Bench) -> Case:
        work, pairs = bench.world.cell.work, bench.truth.against(*links)
        # A nozzle may stand on a part as deep as its bellows give.
        deep = DEEP if work is None or "pallet" in links else work.give + DEEP
        end = bench.random()
        while bench.truth.at(end, pairs) > -deep:
            end = bench.random()
        return bench.world, program(*moves([*bench.free()[:2], end], bench.world))

    return plant


def own_case(bench: Bench) -> Case:
    """Return a program that ends with two links of the arm in each other."""
    end = bench.random()
    while bench.truth.at(end, bench.truth.own) > -DEEP:
        end = bench.random()
    return bench.world, program(*moves([*bench.free()[:1], end], bench.world))


def swept(links: Sequence[str], make: Callable[[Bench, Vector], World]) -> Callable[[Bench], Case]:
    """Return what plants a thing into the way of these links."""

    def tries(bench: Bench) -> Iterator[Case | None]:
        while True:
            targets = bench.free()
            bench.a_place(targets)
            at = bench.now()
            world = make(bench, bench.truth.inside(links, bench.rng))
            truth = Truth(world)
            found = min(truth.at(at, p) for p in (truth.bodies, truth.zones, truth.table))
            yield (world, program(*moves(targets, world))) if found < -DEEP else None

    return lambda bench: _planted(tries(bench))


OUTER = ("link_2", "link_3", "flange", "tool0")


def _post(bench: Bench, place: Vector) -> World:
    x, y, z = place
    size = (float(bench.rng.uniform(1e-4, 5e-3)), float(bench.rng.uniform(0.002, 0.05)))
    return replace(bench.world, obstacles=(Obstacle("post", "cylinder", size, (x, y, z)),))


def _person(bench: Bench, place: Vector) -> World:
    return replace(bench.world, people=((place[0], place[1], 0.0),))


def _zone(bench: Bench, place: Vector) -> World:
    middle, half = 1e3 * np.array(place), bench.rng.uniform(1.0, 30.0, 3)
    return _zoned(bench.world, middle - half, middle + half)


def limit_case(bench: Bench) -> Case:
    """Return a program that ends with a joint beyond the range of the URDF."""
    targets = bench.free()
    k, last = int(bench.rng.integers(len(bench.world.q))), list(targets[-1])
    beyond = float(bench.rng.uniform(0.001, 0.1))
    low, high = bench.truth.ranges[k].tolist()
    last[k] = high + beyond if bench.rng.random() < 0.5 else low - beyond
    return bench.world, program(*moves([*targets, tuple(last)], bench.world))


def drop_case(bench: Bench) -> Case:
    """Return PALLETISE's first part let go too high above everything on which it may lie."""
    task, work = Task.of(bench), bench.world.cell.work
    assert work is not None
    held, rests = task.truth(bench), ("pallet", *work.table.stands_mm)
    under = [p for p in held.against(*rests) if held.held and held.names[p[0]] == held.held.name]
    while True:
        high = list(task.place(task.release - 1))
        high[2] += float(bench.rng.uniform(0.002, 0.06))
        if held.at(high, under) > work.watch.drop_mm * 1e-3 + DEEP:
            break
    lines = (*task.lines[: task.release - 2], *moves([tuple(high)], bench.world, 91))
    return bench.world, program(*lines, task.lines[task.release])


def in_hand_case(bench: Bench) -> Case:
    """Return PALLETISE's first part pressed into the pallet; the nozzle alone stays above."""
    task = Task.of(bench)
    held, lay = task.truth(bench), bench.world.cell.config.lay_mm * 1e-3
    while True:
        low = list(task.place(task.release - 1))
        low[2] -= float(bench.rng.uniform(0.0, 0.02))
        if held.at(low, held.against("pallet")) < -lay - 1e-3 - DEEP:
            break
    lines = (*task.lines[: task.release - 1], *moves([tuple(low)], bench.world, 92))
    return bench.world, program(*lines)


# The disc of the table is lower than the tool, or a part in hand, can get: what turns with it is
# driven into a post.
HARMS: dict[str, Callable[[Bench], Case]] = {
    "part": into(*(f"part_{k}" for k in range(1, 10))),
    "stand": into("stand_1", "stand_2", "stand_3"),
    "pallet": into("pallet"),
    "part in hand": in_hand_case,
    "thin post": swept(OUTER, _post),
    "table into a post": swept(("stand_1", "stand_2", "stand_3", "part_1", "part_5"), _post),
    "person": swept(OUTER, _person),
    "zone": swept(OUTER, _zone),
    "limit": limit_case,
    "drop": drop_case,
    "self": own_case,
}
