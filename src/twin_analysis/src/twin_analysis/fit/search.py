"""Search the twin's numbers that bring its tool to the robot's, on one part of a recording.

Judge them on the other.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import msgspec
import numpy as np
from scipy.optimize import least_squares

from twin_analysis.fit.twin_model import (
    Choice,
    FloatArray,
    TwinModel,
    apply_vector,
    bounds_of,
)

Simulate = Callable[[TwinModel], FloatArray]
"""Return the twin's tool positions with these numbers, shape (m, 3) [m].

They are taken at the instants of the recording.
"""

PRIOR_MM = 0.01
STEP = 0.02
SCALE_M = 1e-3


class Errors(msgspec.Struct, frozen=True):
    """Distance of the two tools [mm]."""

    rms_mm: float
    max_mm: float


class FitResult(msgspec.Struct, frozen=True):
    """What came out of a search.

    Attributes:
        model: The numbers found.
        vector: The same as the vector of the search.
        evaluations: How many simulations it took.
        before, after: Errors of start and result, each on (training part, held-out part).
    """

    model: TwinModel
    vector: tuple[float, ...]
    evaluations: int
    before: tuple[Errors, Errors]
    after: tuple[Errors, Errors]


def errors(real: FloatArray, twin: FloatArray) -> Errors:
    """Return the errors of two series of tool positions (m, 3) [m]."""
    distance = np.linalg.norm(real - twin, axis=1) * 1e3
    return Errors(float(np.sqrt(np.mean(distance**2))), float(np.max(distance)))


def fit_twin(
    start: TwinModel,
    choice: Choice,
    joints: list[str],
    real: FloatArray,
    training: int,
    simulate: Simulate,
    evaluations: int,
    progress: Callable[[float], None] = lambda error: None,
) -> FitResult:
    """Minimise the distance of the tools on the first ``training`` instants.

    A weak prior keeps numbers that the recording says nothing about where they are.

    Args:
        start: Where to begin.
        choice: What is fitted.
        joints: Names of the twin's joints.
        real: Tool positions of the robot, shape (m, 3) [m].
        training: How many of the m instants are fitted; the rest is held out.
        simulate: The twin.
        evaluations: Largest number of simulations.
        progress: Told the error of each simulation, rms over the training part [mm].

    Returns:
        The best numbers found, and how good they are on both parts.
    """
    lower, upper = bounds_of(choice, joints, start)
    budget = _Budget(evaluations)

    def residuals(x: FloatArray) -> FloatArray:
        twin = simulate(apply_vector(start, choice, x))
        progress(errors(real[:training], twin[:training]).rms_mm)
        # The sum of squares is the mean square in mm^2, however long the recording is: beside it
        # the prior always weighs the same.
        deviation = (twin[:training] - real[:training]).ravel() / (SCALE_M * np.sqrt(training))
        found: FloatArray = np.concatenate([deviation, PRIOR_MM * x])
        budget.note(x, float(found @ found))
        return found

    with contextlib.suppress(_BudgetSpentError):  # the best vector so far is the result
        least_squares(
            residuals,
            np.zeros(len(lower)),
            bounds=(lower, upper),
            diff_step=STEP,
            x_scale=0.5,
            xtol=1e-4,
            ftol=1e-4,
        )
    best = apply_vector(start, choice, budget.best)
    first, last = simulate(start), simulate(best)
    return FitResult(
        best,
        tuple(float(value) for value in budget.best),
        budget.used,
        (errors(real[:training], first[:training]), errors(real[training:], first[training:])),
        (errors(real[:training], last[:training]), errors(real[training:], last[training:])),
    )


class _BudgetSpentError(Exception):
    """The search has used its simulations."""


class _Budget:
    """Counts simulations and keeps the best vector."""

    def __init__(self, most: int) -> None:
        self._most = most
        self.used = 0
        self.best: FloatArray = np.zeros(0)
        self._lowest = np.inf

    def note(self, x: FloatArray, cost: float) -> None:
        """Take one simulation in; end the search when it was the last one allowed."""
        self.used += 1
        if cost < self._lowest:
            self._lowest, self.best = cost, np.array(x)
        if self.used >= self._most:
            raise _BudgetSpentError
