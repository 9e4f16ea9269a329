"""Labelled runs of robots that wear: what ``./cell dataset health`` writes, as plain values."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from fanuc_emulator.plant.config import load_plant
from fanuc_emulator.plant.wear import Wear
from scara_config import Robot, load_robot

from twin_analysis.health.signs import Array, CycleSignals
from twin_analysis.health.virtual_cycles import (
    A_DAY,
    KINDS,
    Condition,
    celsius_at,
    drawn_wear,
    run_cycle,
)

HEALTHY = "healthy"
LABELS = (HEALTHY, *KINDS)
PARTS = ("first", "now")
"""Of a run: a cycle of the robot's first week, and one of now."""
DIGITS, TORQUE_DIGITS = 7, 3
"""Places that are kept: machines differ behind them, in the last bits."""


@dataclass(frozen=True)
class LabelledRun:
    """One run: a robot of its own in its first week, and now.

    Attributes:
        number: From 1 on.
        label: What has worn; ``healthy``: nothing.
        wear: The truth; None of a healthy robot.
        celsius: Of the gears, by part.
        cycles: What was read, by part.
    """

    number: int
    label: str
    wear: Wear | None
    celsius: tuple[float, float]
    cycles: tuple[CycleSignals, CycleSignals]


def labelled_run(number: int, folder: Path, random: np.random.Generator) -> LabelledRun:
    """Return one run.

    Args:
        number: Of the run; labels take turns, and each run has a robot of its own.
        folder: Of the robot's profile.
        random: Of this run alone: it hangs on no run before it.
    """
    robot = _robot(folder)
    plant = load_plant(robot, folder, f"field:{number}")
    label = LABELS[number % len(LABELS)]
    kinds = [kind for kind in KINDS if kind == label]
    names = [joint.name for joint in robot.joints]
    wear = drawn_wear(kinds[0], names, random) if kinds else None
    celsius = [celsius_at(int(random.integers(A_DAY)), random) for _ in PARTS]
    first = run_cycle(robot, plant, Condition(celsius[0]), random)
    worn = (wear,) if wear is not None else ()
    now = run_cycle(robot, plant, Condition(celsius[1], worn), random)
    return LabelledRun(number, label, wear, (celsius[0], celsius[1]), (first, now))


def signal_columns(run: LabelledRun, names: list[str]) -> dict[str, Array]:
    """Return the rows of a run's signals by column; joint values in SI, torques in percent."""
    columns: dict[str, list[Array]] = {}
    for part, cycle in enumerate(run.cycles):
        rows = len(cycle.times)
        found = {
            "run": np.full(rows, run.number),
            "now": np.full(rows, part),
            "time_s": np.round(cycle.times, DIGITS),
        }
        for k, name in enumerate(names):
            found[f"{name}_wanted"] = np.round(cycle.wanted[:, k], DIGITS)
            found[f"{name}_measured"] = np.round(cycle.measured[:, k], DIGITS)
            found[f"{name}_torque_percent"] = np.round(cycle.torques[:, k], TORQUE_DIGITS)
        for column, values in found.items():
            columns.setdefault(column, []).append(values)
    return {column: np.concatenate(values) for column, values in columns.items()}


@lru_cache(maxsize=1)
def _robot(folder: Path) -> Robot:
    return load_robot(folder)
