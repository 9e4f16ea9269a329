"""The same plan gives the same jobs, on any machine and in any order."""

from __future__ import annotations

from random import Random

import pytest
from farm.lab.plan import MOST_JOBS, LabPlanError, Plan, jobs_of, summary

POINT = "0.51,0.16,0.10"


def plan_of(
    kind: str, *targets: str, variations: int = 1, spread_mm: float = 0.0, seed: int = 0
) -> Plan:
    """Return a plan without words and speeds."""
    return Plan(kind, targets, (), variations, spread_mm, None, seed)


def test_a_plan_gives_the_same_jobs_again() -> None:
    """Another seed gives others; the first of each target is the target itself."""
    plan = Plan("judge", (POINT, "0.5,0,0.1,90"), ("--json",), 20, 5.0, (20.0, 80.0), 7)
    jobs = jobs_of(plan, Random)
    assert jobs == jobs_of(plan, Random) and len({job.name for job in jobs}) == 40
    assert jobs[0].words == (POINT, "--json")
    other = jobs_of(Plan("judge", plan.targets, ("--json",), 20, 5.0, (20.0, 80.0), 8), Random)
    assert all(a.words != b.words for a, b in zip(jobs, other) if not a.name.endswith("_0000"))
    moved, option, speed, _ = jobs[1].words
    assert option == "--speed" and 20.0 <= float(speed) <= 80.0
    assert abs(float(moved.split(",")[0]) - 0.51) < 0.03


def test_a_plan_may_be_one_job() -> None:
    """And as many as are allowed."""
    assert len(jobs_of(plan_of("judge", POINT), Random)) == 1
    assert len(jobs_of(plan_of("judge", POINT, variations=MOST_JOBS), Random)) == MOST_JOBS


def test_a_point_is_varied_by_what_the_plan_says_and_by_nothing_else() -> None:
    """Without a spread, all variations of a point are that point."""
    jobs = jobs_of(plan_of("judge", "0.4,0,0.1", variations=3), Random)
    assert {float(x) for job in jobs for x in job.words[0].split(",")} == {0.4, 0.0, 0.1}


def test_one_target_does_not_change_the_jobs_of_another() -> None:
    """Each variation has a chance of its own."""
    both = jobs_of(plan_of("judge", POINT, "0.4,0,0.1", variations=5, spread_mm=5.0), Random)
    alone = jobs_of(plan_of("judge", "0.4,0,0.1", variations=5, spread_mm=5.0), Random)
    assert [job.words for job in both[5:]] == [job.words for job in alone]


@pytest.mark.parametrize(
    ("plan", "text"),
    [
        (plan_of("dance", "x"), "allowed are judge, replay, report, fit"),
        (plan_of("judge"), "nothing to do"),
        (plan_of("judge", POINT, variations=MOST_JOBS + 1), "allowed are 1 to"),
        (plan_of("replay", "a.bag", variations=2), "a recording is what it is"),
        (plan_of("judge", "ARTICLE", variations=2), "a program is what it is"),
    ],
)
def test_what_cannot_be_planned_is_refused(plan: Plan, text: str) -> None:
    """Before anything runs."""
    with pytest.raises(LabPlanError, match=text):
        jobs_of(plan, Random)


def test_a_summary_counts_exit_codes() -> None:
    """Those of the jobs, whatever they mean to them."""
    assert summary([0, 1, 1]) == "3 jobs: 1 ended with 0, 2 with 1"
