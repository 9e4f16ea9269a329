"""Does the monitor find what wears? One robot at a time: its first week, a healthy week, wear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from fanuc_emulator.plant.config import Plant
from scara_config import Robot

from twin_analysis.health.signs import Signs, signs_of
from twin_analysis.health.trend import Baseline, Finding, Monitor
from twin_analysis.health.virtual_cycles import (
    KINDS,
    WEEK,
    Condition,
    celsius_at,
    drawn_wear,
    grown,
    run_cycle,
)

WITHIN = 20
"""Cycles from the first trace of wear in which it has to be found."""


@dataclass(frozen=True)
class Trial:
    """What became of one robot.

    Attributes:
        seed: By which its plant was drawn.
        false_alarms: Kinds and joints that were named in a week in which nothing wore.
        found: By what wore: kind, joint, and after how many cycles; 0: not in time.
    """

    seed: int
    false_alarms: tuple[str, ...]
    found: tuple[tuple[str, str, str, str, int], ...]


def run_trial(
    robot: Robot, plant: Plant, seed: int, random: np.random.Generator, week: int = WEEK
) -> Trial:
    """Return how the monitor did on one robot.

    Args:
        robot: robot.yaml.
        plant: Of this robot.
        seed: By which the plant was drawn.
        random: Draws wear, temperatures and noise.
        week: Cycles of the first week, and of the healthy one behind it.
    """
    joints = robot.joints
    names = [joint.name for joint in joints]
    fastest = np.array([joint.velocity for joint in joints])

    def cycle(number: int, condition: Condition | None = None) -> Signs:
        now = condition or Condition(celsius_at(number, random))
        return signs_of(run_cycle(robot, plant, now, random), fastest)

    ranges = np.array([joint.upper - joint.lower for joint in joints])
    carries = [joint.screw_axis is not None for joint in joints]
    base = Baseline(names, ranges, carries, [cycle(number) for number in range(week)])
    monitor = Monitor(base)
    heard = [monitor.take(cycle(number)) for number in range(week)]
    false = tuple(sorted({f"{one.kind} {one.joint}" for one in heard if one is not None}))
    found = []
    for kind in KINDS:
        wear, monitor, first = drawn_wear(kind, names, random), Monitor(base), None
        after = 0
        for number in range(WITHIN):
            worn = Condition(celsius_at(number, random), grown(wear, number))
            first = monitor.take(cycle(number, worn))
            if first is not None:
                after = number + 1
                break
        said = first or Finding("", "", 0.0, 0.0, 0.0, "")
        found.append((kind, wear.joint, said.kind, said.joint, after))
    return Trial(seed, false, tuple(found))
