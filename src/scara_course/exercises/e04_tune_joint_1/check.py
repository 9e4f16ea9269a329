"""Exercise 4: gains of joint_1's position loop, judged by a step up and a step back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scara_config import Robot
from scara_course.marking import ExerciseMark, Table
from twin_analysis.step.response import StepFigures

JOINT, SIZE, SECONDS = "joint_1", 2.0, 1.5
"""The joint, its step [deg], and how long each step is recorded [s]."""
SETTLED_S, OVERSHOOT_PERCENT, REST_DEG, EFFORT_NM = 0.15, 2.0, 0.01, 180.0
"""Our choice: as quick and as still as the shipped loop, with less than 60 % of its effort, so that
nobody passes with the shipped gains."""
SLUGGISH = {"gains": {"p": 2000.0, "i": 0.0, "d": 20.0, "i_clamp": 1.5}}


def draw(generator: np.random.Generator) -> Table:
    """Return where everybody begins: gains that swing."""
    del generator
    return {row: dict(values) for row, values in SLUGGISH.items()}


def solve(given: Table, robot: Robot) -> Table:
    """Return what is asked for: four gains. Many are right, so this holds no solution."""
    del robot
    return given


def mark(answers: Table, figures: Sequence[StepFigures], robot: Robot) -> ExerciseMark:
    """Judge the steps: up, then down."""
    del answers
    told = []
    for way, step in zip(("up", "down"), figures, strict=True):
        rest = abs(step.steady_state_error) / robot.joint(JOINT).scale
        settled = step.settling_time
        within = "never settled" if settled is None else f"settled after {settled * 1e3:.0f} ms"
        told.append(
            f"{way}: {within}, overshoot {step.overshoot_percent:.2f} %, {rest:.4f} deg off at "
            f"rest, {step.peak_effort:.1f} N m"
        )
        # What is most wrong comes first: a loop that swings for ever has no other figure.
        faults = (
            (
                settled is None,
                "it never stays within 2 % of the step: it swings, or does not arrive",
            ),
            (
                not step.peak_effort <= EFFORT_NM,
                f"the effort exceeds {EFFORT_NM:g} N m: p is too large for this step",
            ),
            (
                not step.overshoot_percent < OVERSHOOT_PERCENT,
                f"the overshoot is not below {OVERSHOOT_PERCENT:g} %: more d, or a smaller i_clamp",
            ),
            (
                settled is not None and not settled <= SETTLED_S,
                f"it needs more than {SETTLED_S * 1e3:.0f} ms: more p, or less d",
            ),
            (
                not rest < REST_DEG,
                f"it rests {REST_DEG:g} deg or more off: friction holds it, i takes that away",
            ),
        )
        for is_fault, text in faults:
            if is_fault:
                return ExerciseMark(False, f"{text} ({told[-1]})")
    return ExerciseMark(True, "; ".join(told))
