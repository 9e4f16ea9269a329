"""The same plan gives the same jobs, on any machine and in any order."""

from __future__ import annotations

from random import Random

import pytest
from farm.lab.plan import MOST_JOBS, LabPlanError, Plan, jobs_of, summary

POINT = "0.51,0.16,0.10"


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
    for count in (1, MOST_JOBS):
        assert len(jobs_of(Plan("judge", (POINT,), (), count, 0.0, None, 0), Random)) == count


def test_a_point_is_varied_by_what_the_plan_says_and_by_nothing_else() -> None:
    """Without a spread, all variations of a point are that point; a yaw is never varied."""
    jobs = jobs_of(Plan("judge", ("0.4,0,0.1,90",), (), 3, 0.0, None, 0), Random)
    assert jobs[1].words == jobs[2].words == ("0.40000,0.00000,0.10000,90.00000",)
    moved = jobs_of(Plan("judge", ("0.4,0,0.1,90",), (), 2, 5.0, None, 0), Random)[1].words[0]
    kept = [float(x) == y for x, y in zip(moved.split(","), (0.4, 0.0, 0.1, 90.0))]
    assert kept == [False, False, False, True]


def test_one_target_does_not_change_the_jobs_of_another() -> None:
    """Each variation has a chance of its own."""
    both = jobs_of(Plan("judge", (POINT, "0.4,0,0.1"), (), 5, 5.0, None, 0), Random)
    alone = jobs_of(Plan("judge", ("0.4,0,0.1",), (), 5, 5.0, None, 0), Random)
    assert [job.words for job in both[5:]] == [job.words for job in alone]


@pytest.mark.parametrize(
    ("plan", "text"),
    [
        (
            Plan("dance", ("x",), (), 1, 0.0, None, 0),
            "allowed are judge, improve, replay, report, fit",
        ),
        (Plan("judge", (), (), 1, 0.0, None, 0), "nothing to do"),
        (Plan("judge", (POINT,) * 2, (), MOST_JOBS // 2 + 1, 0.0, None, 0), "allowed are 1 to"),
        (Plan("judge", (POINT,), (), 0, 0.0, None, 0), "0 variations: allowed are 1 to"),
        (Plan("replay", ("a.bag",), (), 2, 0.0, None, 0), "a recording is what it is"),
        (
            Plan("report", ("a/1.bag", "b/1.bag", "b/2.bag"), (), 1, 0.0, None, 0),
            "^b: 2 recordings lie here",
        ),
        (Plan("judge", ("ARTICLE",), (), 2, 0.0, None, 0), "a program is what it is"),
    ],
)
def test_what_cannot_be_planned_is_refused(plan: Plan, text: str) -> None:
    """Before anything runs."""
    with pytest.raises(LabPlanError, match=text):
        jobs_of(plan, Random)


def test_recordings_that_lie_apart_are_reported_on() -> None:
    """Each beside itself."""
    jobs = jobs_of(Plan("report", ("a/1.bag", "b/1.bag"), (), 1, 0.0, None, 0), Random)
    assert [job.kind for job in jobs] == ["report", "report"]


def test_a_summary_counts_exit_codes() -> None:
    """Those of the jobs, whatever they mean to them."""
    assert summary([0, 1, 1]) == "3 jobs: 1 ended with 0, 2 with 1"
