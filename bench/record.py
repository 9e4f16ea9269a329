"""What a row of the benchmark says: both sides, their ratio, the goal, and whether it holds."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal

Rounds = list[list[float]]
"""Samples of each round."""


def or_infinite(figure: float | None) -> float:
    """Return a figure; infinite for one that there is not: it keeps no limit."""
    return math.inf if figure is None else figure


@dataclass(frozen=True)
class Goal:
    """A limit of the ratio ours / baseline, or of our own value."""

    of: Literal["ratio", "ours"]
    limit: float
    at_least: bool = False

    @property
    def text(self) -> str:
        """Say it as the table does."""
        return f"{self.of} {'>=' if self.at_least else '<='} {self.limit:g}"

    def holds(self, ours: float | None, ratio: float | None) -> bool:
        """Whether it is kept; what was not measured keeps nothing."""
        value = ratio if self.of == "ratio" else ours
        if value is None or not math.isfinite(value):
            return False
        return value >= self.limit if self.at_least else value <= self.limit


@dataclass(frozen=True)
class Beside:
    """A further figure of a row: another baseline, another reading of the same thing.

    With or without a goal.
    """

    what: str
    value: float | None
    unit: str
    goal: str = ""
    holds: bool | None = None


@dataclass(frozen=True)
class Record:
    """One row.

    Attributes:
        id: Name of the row.
        ours: Our figure, None if it could not be measured.
        baseline: The other side's, None if there is none.
        unit: Of both.
        goals: What has to be kept.
        measured: What was done on our side.
        against: The other side, with its settings.
        statistic: Which figure of the samples counts.
        ours_p99: 99th percentile of our samples.
        baseline_p99: Same of the other side.
        spread_percent: Largest minus smallest round, percent of ours: how far the rounds lie apart.
        baseline_spread_percent: Same of the other side.
        rounds: How often both sides took turns.
        beside: Further figures.
        note: Why something is missing, or how to read it.
        seconds: How long the row took.
    """

    id: str
    ours: float | None
    baseline: float | None
    unit: str
    goals: tuple[Goal, ...] = ()
    measured: str = ""
    against: str = ""
    statistic: str = "median"
    ours_p99: float | None = None
    baseline_p99: float | None = None
    spread_percent: float | None = None
    baseline_spread_percent: float | None = None
    rounds: int = 1
    beside: tuple[Beside, ...] = ()
    note: str = ""
    seconds: float = 0.0

    @property
    def ratio(self) -> float | None:
        """Ours divided by the baseline."""
        if self.ours is None or not self.baseline:
            return None
        return self.ours / self.baseline

    @property
    def holds(self) -> bool:
        """Whether every goal of the row is kept, also those of the figures beside."""
        kept = all(goal.holds(self.ours, self.ratio) for goal in self.goals)
        return (
            self.ours is not None
            and kept
            and all(figure.holds is not False for figure in self.beside)
        )

    @property
    def goal(self) -> str:
        """All goals in words."""
        return "; ".join(goal.text for goal in self.goals)

    def document(self) -> dict[str, Any]:
        """Return it for a JSON file."""
        fields = asdict(self)
        del fields["goals"]
        return _finite({**fields, "ratio": self.ratio, "goal": self.goal, "holds": self.holds})


def failed(name: str, why: str) -> Record:
    """Return the row of something that could not be measured; it does not hold."""
    return Record(name, None, None, "", note=f"not measured: {why}")


def interleaved(rounds: int, *sides: Callable[[], list[float]]) -> list[Rounds]:
    """Let the sides take turns, each round beginning with another one.

    Return the samples of each side.
    """
    samples: list[Rounds] = [[] for _ in sides]
    for number in range(rounds):
        order = [*range(number % len(sides), len(sides)), *range(number % len(sides))]
        for index in order:
            samples[index].append(sides[index]())
    return samples


def median(rounds: Rounds) -> float:
    """Return the median of the rounds' medians."""
    return statistics.median(statistics.median(samples) for samples in rounds)


def quantile(samples: Sequence[float], part: float) -> float:
    """Return the smallest sample that ``part`` of all do not exceed."""
    ordered = sorted(samples)
    return ordered[min(len(ordered) - 1, max(0, math.ceil(part * len(ordered)) - 1))]


def p99(rounds: Rounds) -> float:
    """Return the 99th percentile of all samples."""
    return quantile([value for samples in rounds for value in samples], 0.99)


def spread_percent(rounds: Rounds, statistic: Callable[[Rounds], float] = median) -> float:
    """Return how far the rounds lie apart, in percent of their middle."""
    values = [statistic([samples]) for samples in rounds]
    middle = statistics.median(values)
    return 100.0 * (max(values) - min(values)) / middle if middle else 0.0


def of_rounds(
    rounds: Rounds, statistic: Callable[[Rounds], float], scale: float
) -> tuple[float, float, float]:
    """Return figure, 99th percentile and spread [percent] of one side.

    ``scale`` converts its samples to the row's unit.
    """
    return statistic(rounds) * scale, p99(rounds) * scale, spread_percent(rounds, statistic)


def _finite(value: Any) -> Any:
    """Replace what JSON has no number for."""
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
