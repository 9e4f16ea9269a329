"""Random programs in the second world: how many planted harms are missed, how many free refused.

What is true is found without the code under test: MuJoCo's forward kinematics and distances on the
same URDF, and for thin things the place of a point of the arm, from the same source.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from harness.faults.rows import Row
from rich.console import Console
from scara_config import KeepOut
from scara_config.profile import CHOICE
from scara_config.programs.files import ProgramSteps
from scara_config.programs.lines import GripperStep, MoveStep
from what_if.io.cell_files import find_program, resting_cell
from what_if.io.second_world import SecondWorld
from what_if.judging import judge
from what_if.motions import JointTarget, ProgramRun
from what_if.verdict import Outcome
from what_if.world import Obstacle, World

CONFIG = Path(__file__).resolve().parents[1] / "config"
ARM = ("link_1", "link_2", "link_3", "flange", "tool0")
CLEAR = 0.004
"""A free program stays so far [m] from everything at all samples of its way."""
DEEP = 0.002
"""A planted harm overlaps by at least so much [m]."""
SAMPLE = 0.004
Vector = tuple[float, ...]


class Truth:
    """The cell in MuJoCo: the URDF's text with parts as fixed links of it."""

    def __init__(self, world: World) -> None:
        robot, work = world.cell.robot, world.cell.work
        text = robot.description.read_text(encoding="utf-8")
        more = ""
        if work is not None:
            size = f'radius="{work.parts.radius}" length="{work.parts.height}"'
            for part in world.parts:
                more += _link(part.name, part.link, part.pose[:3, 3].tolist(), size)
        more += '<mujoco><compiler fusestatic="false" discardvisual="true"/></mujoco>'
        self.model = mujoco.MjModel.from_xml_string(text.replace("</robot>", more + "</robot>"))
        self.data = mujoco.MjData(self.model)
        self._at = [self.model.joint(joint.name).qposadr[0] for joint in robot.twin_joints]
        names = [self.model.body(int(k)).name for k in self.model.geom_bodyid]
        chain = [joint.child for joint in world.cell.description.chain(robot.tool_frame)]
        moving = chain[next(k for k, n in enumerate(chain) if n == "link_1") :]
        self.arm = [k for k, name in enumerate(names) if name in moving]
        root = world.cell.tree.links[0]
        self.pairs = [
            (k, other)
            for k in self.arm
            for other, name in enumerate(names)
            if name not in moving and not (names[k] == "link_1" and name in ("world", root))
        ]
        rank = {name: len(world.cell.tree.movers[name]) for name in moving}
        self.own = [
            (k, other)
            for k in self.arm
            for other in self.arm
            if rank[names[other]] - rank[names[k]] > 1
        ]
        self._names = names

    def pose(self, q: Sequence[float]) -> None:
        """Put the joints there."""
        self.data.qpos[self._at] = q
        mujoco.mj_kinematics(self.model, self.data)

    def clearance(self, pairs: Sequence[tuple[int, int]], far: float = 0.02) -> float:
        """Return the smallest distance of these pairs [m], at most ``far``."""
        ask, model, data = mujoco.mj_geomDistance, self.model, self.data
        rows = np.array(pairs)
        if not rows.size:
            return far
        # MuJoCo's own spheres around the shapes leave few pairs to be asked for.
        apart = np.linalg.norm(data.geom_xpos[rows[:, 0]] - data.geom_xpos[rows[:, 1]], axis=1)
        apart -= model.geom_rbound[rows].sum(axis=1)
        near = rows[apart < far].tolist()
        return min((ask(model, data, one, other, far, None) for one, other in near), default=far)

    def against(self, *links: str) -> list[tuple[int, int]]:
        """Return the pairs of the arm with these links."""
        return [pair for pair in self.pairs if self._names[pair[1]] in links]

    def inside(self, rng: np.random.Generator) -> Vector:
        """Return a point inside a random shape of the outer arm [m]."""
        outer = [k for k in self.arm if self._names[k] in ("link_2", "link_3", "flange")]
        x, y, z = self.data.geom_xpos[int(rng.choice(outer))].tolist()
        return x, y, z


def _link(name: str, parent: str, xyz: Sequence[float], cylinder: str) -> str:
    place = " ".join(map(repr, xyz))
    return (
        f'<link name="{name}"><collision><geometry><cylinder {cylinder}/></geometry></collision>'
        f'</link><joint name="{name}_joint" type="fixed"><origin xyz="{place}" rpy="0 0 0"/>'
        f'<parent link="{parent}"/><child link="{name}"/></joint>\n'
    )


@dataclass
class Bench:
    """A world, the truth about it and a source of chance."""

    world: World
    truth: Truth
    rng: np.random.Generator

    def random(self) -> Vector:
        """Return joint positions, most of them where the tool is above the table."""
        low, high = np.array([(j.lower, j.upper) for j in self.world.cell.robot.twin_joints]).T
        return tuple(self.rng.uniform(low, high).tolist())

    def free(self) -> list[Vector]:
        """Return the targets of a program that is free from home to end, by a dense look."""
        here: Vector = self.world.q
        found: list[Vector] = []
        wanted = int(self.rng.integers(2, 5))
        while len(found) < wanted:
            there = self.random()
            if self._is_free(here, there):
                found.append(there)
                here = there
        return found

    def _is_free(self, start: Vector, end: Vector) -> bool:
        a, b = np.array(start), np.array(end)
        reach = 0.7 if self.world.cell.robot.geometry else 1.0
        count = max(2, int(reach * float(np.abs(b - a).sum()) / SAMPLE))
        margin = self.world.cell.limits.cell.keep_out_clearance_mm * 1e-3 + 1e-3
        for part in np.linspace(1.0, 0.0, count):
            self.truth.pose(a + part * (b - a))
            tool = self.truth.data.body(self.world.cell.robot.tool_frame).xpos
            lowest = min(float(self.truth.data.geom_xpos[k][2]) for k in self.truth.arm)
            zone = self.world.zones[0]
            if min(tool[2], lowest) * 1e3 < zone.upper_mm[2] + 10.0 + margin * 1e3:
                return False
            if self.truth.clearance(self.truth.pairs + self.truth.own) < CLEAR:
                return False
        return True

    def on_the_way(self, targets: Sequence[Vector]) -> Vector:
        """Return a point that the arm sweeps over [m], in the middle of a random move."""
        rows = [self.world.q, *targets]
        k = int(self.rng.integers(len(rows) - 1))
        part = float(self.rng.uniform(0.3, 0.9))
        a, b = np.array(rows[k]), np.array(rows[k + 1])
        self.truth.pose(a + part * (b - a))
        return self.truth.inside(self.rng)

    def below(self, *links: str) -> list[Vector]:
        """Return a free program that ends inside one of these links."""
        pairs = self.truth.against(*links)
        while True:
            end = self.random()
            self.truth.pose(end)
            if self.truth.clearance(pairs) < -DEEP:
                return [*self.free()[:2], end]


def program(targets: Sequence[Vector], world: World) -> ProgramRun:
    """Return targets as a program; what the twin does not move stays at 0."""
    robot = world.cell.robot
    names = [joint.name for joint in robot.twin_joints]
    rows = [dict(zip(names, target)) for target in targets]
    lines = [
        MoveStep(k, tuple(row.get(joint.name, 0.0) for joint in robot.joints), 50.0, True)
        for k, row in enumerate(rows, 1)
    ]
    return ProgramRun(ProgramSteps("RANDOM", 8, tuple(lines)))


Case = tuple[World, ProgramRun]


def _free(bench: Bench) -> Case:
    return bench.world, program(bench.free(), bench.world)


def _into(*links: str) -> Callable[[Bench], Case]:
    return lambda bench: (bench.world, program(bench.below(*links), bench.world))


def _own(bench: Bench) -> Case:
    while True:
        end = bench.random()
        bench.truth.pose(end)
        if bench.truth.clearance(bench.truth.own) < -DEEP:
            return bench.world, program([*bench.free()[:1], end], bench.world)


def _post(bench: Bench) -> Case:
    targets = bench.free()
    x, y, z = bench.on_the_way(targets)
    size = (float(bench.rng.uniform(1e-4, 5e-3)), 0.01)
    thing = Obstacle("post", "cylinder", size, (x, y, z))
    return replace(bench.world, obstacles=(thing,)), program(targets, bench.world)


def _person(bench: Bench) -> Case:
    targets = bench.free()
    x, y, _ = bench.on_the_way(targets)
    return replace(bench.world, people=((x, y, 0.0),)), program(targets, bench.world)


def _zone(bench: Bench) -> Case:
    targets = bench.free()
    middle = 1e3 * np.array(bench.on_the_way(targets))
    half = bench.rng.uniform(1.0, 30.0, 3)
    low, high = (middle - half).tolist(), (middle + half).tolist()
    zone = KeepOut("planted", (low[0], low[1], low[2]), (high[0], high[1], high[2]))
    return replace(bench.world, zones=(*bench.world.zones, zone)), program(targets, bench.world)


def _limit(bench: Bench) -> Case:
    targets, joints = bench.free(), bench.world.cell.robot.twin_joints
    k = int(bench.rng.integers(len(joints)))
    last = list(targets[-1])
    last[k] = joints[k].upper + float(bench.rng.uniform(0.001, 0.1))
    return bench.world, program([*targets, tuple(last)], bench.world)


def _palletise(bench: Bench) -> tuple[list[MoveStep | GripperStep], int]:
    """Return the lines of PALLETISE until a part is in hand and lifted, and over the pallet."""
    found = find_program(bench.world.cell, "PALLETISE", CONFIG)
    lines = [line for line in found.steps if isinstance(line, MoveStep | GripperStep)]
    switch = [k for k, line in enumerate(lines) if isinstance(line, GripperStep)]
    return lines, switch[1]


def _drop(bench: Bench) -> Case:
    lines, release = _palletise(bench)
    place = lines[release - 1]
    assert isinstance(place, MoveStep)
    up = list(place.target)
    up[2] += float(bench.rng.uniform(0.008, 0.06))
    high = MoveStep(place.line, tuple(up), 20.0, True)
    kept = (*lines[: release - 2], high, lines[release])
    return bench.world, ProgramRun(ProgramSteps("DROP", 8, kept))


def _in_hand(bench: Bench) -> Case:
    """Press the part in hand into the pallet; the nozzle alone would stay above."""
    lines, release = _palletise(bench)
    place = lines[release - 1]
    assert isinstance(place, MoveStep)
    deep = list(place.target)
    deep[2] -= float(bench.rng.uniform(0.004, 0.018))
    low = MoveStep(place.line, tuple(deep), 20.0, True)
    kept = (*lines[: release - 1], low)
    return bench.world, ProgramRun(ProgramSteps("PRESS", 8, kept))


# The disc of the table is lower than the tool, or a part in hand, can get.
HARMS: dict[str, Callable[[Bench], Case]] = {
    "part": _into(*(f"part_{k}" for k in range(1, 10))),
    "stand": _into("stand_1", "stand_2", "stand_3"),
    "pallet": _into("pallet"),
    "part in hand": _in_hand,
    "thin post": _post,
    "person": _person,
    "zone": _zone,
    "limit": _limit,
    "drop": _drop,
    "self": _own,
}


def run(count: int, folder: Path, console: Console) -> list[Row]:
    """Judge ``count`` random programs, half of them with a planted harm.

    Args:
        count: How many.
        folder: Gets the programs that were judged wrongly, as text.
        console: For progress.
    """
    wrong: list[str] = []
    missed = dict.fromkeys(HARMS, 0)
    refused, times = 0, []
    with ExitStack() as stack:
        benches = {}
        for robot in ("fanuc_sr6ia", "articulated_six"):
            os.environ[CHOICE] = robot
            world = stack.enter_context(resting_cell(CONFIG))[0]
            benches[robot] = Bench(world, Truth(world), np.random.default_rng(29))
        os.environ.pop(CHOICE)
        scara = benches["fanuc_sr6ia"]
        for k in range(count):
            harm = list(HARMS)[k // 2 % len(HARMS)] if k % 2 else ""
            bench = benches["articulated_six"] if harm == "self" else scara
            world, motion = HARMS[harm](bench) if harm else _free(bench)
            begin = time.perf_counter()
            verdict = judge(world, motion)
            times.append(time.perf_counter() - begin)
            if (verdict.outcome is Outcome.REFUSED) != bool(harm):
                wrong.append(f"{harm or 'free'}: {verdict.sentence}: {motion}")
                if harm:
                    missed[harm] += 1
                else:
                    refused += 1
            if k % 100 == 99:
                console.print(f"{k + 1} programs, {sum(missed.values())} missed, {refused} refused")
        durations = [*_times(scara), *_physics(scara)]
    (folder / "what_if_wrong.txt").write_text("\n".join(wrong) + "\n", encoding="utf-8")
    free = (count + 1) // 2
    rows = [Row(f"planted: {name}", "missed", 0.0, n, always=True) for name, n in missed.items()]
    return [
        *rows,
        Row(f"{free} free programs", "refused wrongly [%]", 1.0, 100.0 * refused / free),
        Row("random programs", "verdict, median [ms]", 500.0, 1e3 * float(np.median(times))),
        *durations,
    ]


def _times(bench: Bench) -> list[Row]:
    """Return how long verdicts of a move and of ARTICLE take."""
    article = ProgramRun(find_program(bench.world.cell, "ARTICLE", CONFIG))
    moves = [JointTarget(bench.random()) for _ in range(50)]
    found = []
    for name, limit, motions in (("a move", 50.0, moves), ("ARTICLE", 500.0, [article] * 9)):
        taken = []
        for motion in motions:
            begin = time.perf_counter()
            judge(bench.world, motion)  # type: ignore[arg-type]
            taken.append(time.perf_counter() - begin)
        found.append(Row(name, "verdict, median [ms]", limit, 1e3 * float(np.median(taken))))
    return found


def _physics(bench: Bench) -> list[Row]:
    """Return how much slower than the goal of 25 times real time the simulated world is."""
    found = []
    with SecondWorld(bench.world, CONFIG) as second:
        for name in ("ARTICLE", "PALLETISE"):
            motion = ProgramRun(find_program(bench.world.cell, name, CONFIG))
            shares = [100.0 / second.run(bench.world, motion).times_real for _ in range(5)]
            text = "physics, processor time, median [% of real time]"
            found.append(Row(name, text, 4.0, float(np.median(shares))))
    return found
