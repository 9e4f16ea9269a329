"""Does a monitor find what wears? One robot at a time: its first week, a healthy week, wear."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from fanuc_emulator.plant.config import Plant
from fanuc_emulator.plant.wear import Kind, Wear
from scara_config import Robot

from twin_analysis.health.signs import Signs, signs_of
from twin_analysis.health.trend import Baseline, Monitor, facts_of
from twin_analysis.health.virtual_cycles import (
    GROWS,
    KINDS,
    STEPS,
    WEEK,
    Condition,
    Steps,
    celsius_at,
    drawn_wear,
    grown,
    run_cycle,
)

WITHIN = 20
"""Cycles from the first trace of wear in which it has to be found."""
Named = tuple[str, str]
"""What a monitor names: kind, and joint; empty: of no joint."""
Watch = Callable[[Signs], Named | None]
"""Takes in one cycle after the other, and names what has worn."""


@dataclass(frozen=True)
class WearScene:
    """What a robot goes through.

    Attributes:
        steps: Of each cycle.
        grows: Cycles from the first trace of wear to all of it.
        cases: The kinds that wear in each case; twice the same: in two joints.
        week: Cycles of the first week, and of the healthy one behind it.
        within: Cycles of each case, from the first trace of wear on.
    """

    steps: Steps = STEPS
    grows: int = GROWS
    cases: tuple[tuple[Kind, ...], ...] = tuple((kind,) for kind in KINDS)
    week: int = WEEK
    within: int = WITHIN


@dataclass(frozen=True)
class RobotRecord:
    """What the cycles of one robot said.

    Attributes:
        base: Its first week.
        first, healthy: Cycles of the first week, and of the week behind it.
        worn: By case: what wears, and the cycles from its first trace on.
    """

    base: Baseline
    first: tuple[Signs, ...]
    healthy: tuple[Signs, ...]
    worn: tuple[tuple[tuple[Wear, ...], tuple[Signs, ...]], ...]


@dataclass(frozen=True)
class CaseResult:
    """What a monitor said of one case.

    Attributes:
        worn: The truth.
        said: Each once, in the order in which it was said.
        after: Cycles until the first; 0: not in time.
    """

    worn: tuple[Named, ...]
    said: tuple[Named, ...]
    after: int

    @property
    def right(self) -> bool:
        """What was said first is true."""
        return bool(self.said) and self.said[0] in self.worn


@dataclass(frozen=True)
class Trial:
    """What became of one robot.

    Attributes:
        false_alarms: What was named in a week in which nothing wore, as often as it began to be.
        results: One of each case.
    """

    false_alarms: tuple[Named, ...]
    results: tuple[CaseResult, ...]


def run_robot(
    robot: Robot, plant: Plant, random: np.random.Generator, scene: WearScene | None = None
) -> RobotRecord:
    """Let one robot run.

    Args:
        robot: robot.yaml.
        plant: Of this robot.
        random: Draws wear, temperatures and noise.
        scene: What it goes through; None: as it is by default.
    """
    scene = scene or WearScene()
    joints = facts_of(robot)

    def cycle(number: int, wears: tuple[Wear, ...] = ()) -> Signs:
        now = Condition(celsius_at(number, random), wears)
        return signs_of(run_cycle(robot, plant, now, random, scene.steps), joints.fastest)

    first = tuple(cycle(number) for number in range(scene.week))
    healthy = tuple(cycle(number) for number in range(scene.week))
    worn = []
    for kinds in scene.cases:
        wears: tuple[Wear, ...] = ()
        for kind in kinds:
            taken = {each.joint for each in wears if each.kind == kind}
            wears += (
                drawn_wear(kind, [name for name in joints.names if name not in taken], random),
            )
        signs = [
            cycle(number, tuple(grown(wear, number, scene.grows) for wear in wears))
            for number in range(scene.within)
        ]
        worn.append((wears, tuple(signs)))
    return RobotRecord(Baseline(joints, first), first, healthy, tuple(worn))


def ours(record: RobotRecord) -> Watch:
    """Return the project's own monitor, which knows a robot's first week."""
    monitor = Monitor(record.base)

    def watch(signs: Signs) -> Named | None:
        finding = monitor.take(signs)
        return (finding.kind, finding.joint) if finding is not None else None

    return watch


def judged(record: RobotRecord, monitor: Callable[[RobotRecord], Watch] = ours) -> Trial:
    """Return how a monitor did on one robot; it begins anew with each case."""
    results = []
    for wears, signs in record.worn:
        watch = monitor(record)
        heard = [watch(each) for each in signs]
        # After how many cycles the first was named; 0: nothing was.
        after = next((number for number, each in enumerate(heard, 1) if each is not None), 0)
        said = tuple(dict.fromkeys(each for each in heard if each is not None))
        truth = tuple((wear.kind, wear.joint) for wear in wears)
        results.append(CaseResult(truth, said, after))
    watch = monitor(record)
    # An alarm stays until it goes: what comes again is another one.
    rings = itertools.groupby(watch(signs) for signs in record.healthy)
    return Trial(tuple(named for named, _ in rings if named is not None), tuple(results))
