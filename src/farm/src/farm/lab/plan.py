"""What the lab runs: jobs from targets, variations and a seed; pure.

A job is a program of the workspace with its words. Everything about it is in the plan, so that the
same plan gives the same jobs, on any machine and in any order.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import PurePath
from typing import Protocol

import msgspec

PROGRAMS = {
    "judge": ("what_if", "judge"),
    "improve": ("what_if", "improve"),
    "replay": ("twin_analysis", "replay_decisions"),
    "report": ("twin_experiments", "report"),
    "fit": ("twin_analysis", "fit_twin"),
}
"""Kinds of jobs: package and program, as rosrun finds it."""
OF_BAGS = ("replay", "report", "fit")
"""Kinds whose targets are recordings."""
LATER_PART = re.compile(r"\.part[0-9]+(?=\.bag\Z)")
"""What the name of a later part of a recording has more than that of the first one."""
MOST_JOBS = 10_000
"""Our choice: a plan beyond it is a mistake in a word."""
DIGITS = 5
"""Our choice: points are varied in steps of 0.01 mm."""


class Chance(Protocol):
    """A generator of random numbers, as :class:`random.Random`."""

    def gauss(self, mu: float, sigma: float) -> float:
        """Return a number of a normal distribution."""

    def uniform(self, a: float, b: float) -> float:
        """Return a number between two."""


ChanceOf = Callable[[str], Chance]
"""Makes a generator from a seed; the same from the same."""


class LabPlanError(ValueError):
    """A plan that cannot be made; the text says why and what is allowed."""


class Job(msgspec.Struct, frozen=True):
    """One job.

    Attributes:
        name: Unlike all others of its plan; its files are named by it.
        kind: Of :data:`PROGRAMS`.
        words: Of its command line.
    """

    name: str
    kind: str
    words: tuple[str, ...]


class Plan(msgspec.Struct, frozen=True):
    """What was asked for, from which all jobs follow.

    Attributes:
        kind: Of :data:`PROGRAMS`.
        targets: Bags, programs' names, or points x,y,z in m.
        words: For each job's command line.
        variations: So many of each target.
        spread_mm: Of a point: standard deviation of each coordinate.
        speeds: Of a point: range of the speed in percent, from which each variation takes one.
        seed: Of everything that is chosen at random.
    """

    kind: str
    targets: tuple[str, ...]
    words: tuple[str, ...]
    variations: int
    spread_mm: float
    speeds: tuple[float, float] | None
    seed: int


def jobs_of(plan: Plan, chance_of: ChanceOf) -> list[Job]:
    """Return the jobs of a plan; the first variation of each target is the target itself.

    Args:
        plan: What is asked for.
        chance_of: Makes a generator for each job.

    Raises:
        LabPlanError: It has no targets, too many jobs, varies what cannot be varied, or would write
            several reports into one folder.
    """
    if plan.kind not in PROGRAMS:
        raise LabPlanError(f"{plan.kind}: allowed are {', '.join(PROGRAMS)}")
    if not plan.targets:
        raise LabPlanError("nothing to do: name bags, programs or points")
    if not 1 <= plan.variations * len(plan.targets) <= MOST_JOBS:
        raise LabPlanError(
            f"{plan.variations} variations: allowed are 1 to {MOST_JOBS} jobs in all"
        )
    folder, count = Counter(PurePath(target).parent for target in plan.targets).most_common(1)[0]
    # They are named alike, and the pictures of one would be shown on the page of another.
    if plan.kind == "report" and count > 1:
        raise LabPlanError(
            f"{folder}: {count} recordings lie here, and a report is written beside its recording: "
            "move each into a folder of its own"
        )
    return [
        Job(
            f"{place:04d}_{number:04d}",
            plan.kind,
            (*_varied(plan, target, number, chance_of), *plan.words),
        )
        for place, target in enumerate(plan.targets)
        for number in range(plan.variations)
    ]


def _varied(plan: Plan, target: str, number: int, chance_of: ChanceOf) -> tuple[str, ...]:
    """Return the words of one variation of a target."""
    if number == 0:
        return (target,)
    if plan.kind in OF_BAGS:
        raise LabPlanError(f"{plan.kind}: a recording is what it is; --variations are for points")
    try:
        point = [float(part) for part in target.split(",")]
    except ValueError:
        raise LabPlanError(
            f"{target}: a program is what it is; --variations are for points"
        ) from None
    # Of its own for each job: one that is left out changes no other.
    chance = chance_of(f"{plan.seed} {target} {number}")
    moved = [value + 1e-3 * chance.gauss(0.0, plan.spread_mm) for value in point[:3]]
    text = ",".join(f"{value:.{DIGITS}f}" for value in (*moved, *point[3:]))
    if plan.speeds is None:
        return (text,)
    return (text, "--speed", f"{chance.uniform(*plan.speeds):.1f}")


def first_part(bag: PurePath) -> PurePath:
    """Return the file that a recording begins with, from any of its parts.

    Example:
        >>> first_part(PurePath("run.part0002.bag")).name, first_part(PurePath("run.bag")).name
        ('run.bag', 'run.bag')
    """
    return bag.with_name(LATER_PART.sub("", bag.name))


def summary(codes: Sequence[int]) -> str:
    """Return how many jobs ended with which exit code.

    Example:
        >>> summary([0, 2, 0])
        '3 jobs: 2 ended with 0, 1 with 2'
    """
    counted = [f"{codes.count(code)} {{}}with {code}" for code in sorted(set(codes))]
    return f"{len(codes)} jobs: " + ", ".join(counted).replace("{}", "ended ", 1).replace("{}", "")
