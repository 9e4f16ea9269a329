"""Say in one sentence whether a run, or an experiment of it, was good, and why.

Another one says what of its recording could not be read.
"""

from __future__ import annotations

from collections.abc import Sequence

from twin_experiments.config import Limits
from twin_experiments.report.analysis import Result, exceeded

_NAMED = 3  # our choice: one line; the log of the report names more


def verdict_sentence(results: Sequence[Result], reach_mm: float, limits: Limits) -> str:
    """Return the one sentence that stands above everything: is the whole run good, and why.

    Args:
        results: All experiments of the run, at least one.
        reach_mm: 100 percent of an error.
        limits: Of the verdict.
    """
    bad = [result for result in results if not result.passed]
    if bad:
        first = "; ".join(_missed(bad[0], reach_mm, limits))
        which = (
            "the experiment" if len(results) == 1 else f"{len(bad)} of {len(results)} experiments"
        )
        return f"Not good: {which} missed what is asked, first {bad[0].span.label}: {first}."
    count = {1: "the experiment", 2: "both experiments"}.get(
        len(results), f"all {len(results)} experiments"
    )
    text = f"Good: real robot and twin moved as one in {count}"
    compared = [result.comparison for result in results if result.comparison is not None]
    if not compared:
        return f"{text}."
    worst = max(one.path.max_percent for one in compared)
    return (
        f"{text}; moving, the tools were at most {worst:.2f} % of reach "
        f"({worst * reach_mm / 100.0:.1f} mm) apart, allowed are {limits.path_error_percent:g} %."
    )


def sentence(result: Result, reach_mm: float, limits: Limits) -> str:
    """Return one plain sentence: good or bad, which limit decided, and by how much.

    Args:
        result: One experiment.
        reach_mm: 100 percent of an error.
        limits: Of the verdict.
    """
    name = result.span.label
    if result.passed:
        return f"{name} is good: {_kept(result, reach_mm, limits)}."
    return f"{name} is bad: {'; '.join(_missed(result, reach_mm, limits))}."


def missing_sentence(missing: Sequence[str]) -> str:
    """Return one line that names what of a damaged bag could not be read; empty: all was."""
    if not missing:
        return ""
    more = len(missing) - _NAMED
    text = "; ".join(missing[:_NAMED]) + (f"; and {more} more" if more > 0 else "")
    return f"The recording is damaged. Not read: {text}."


def _missed(result: Result, reach_mm: float, limits: Limits) -> list[str]:
    """Return what speaks against an experiment, limits in plain words."""
    if result.comparison is None:
        return list(result.reasons)
    plain = {
        one.text: f"the {one.what} is {one.percent:.3f} % of reach, {one.percent - one.limit:.3f} "
        f"more than the limit of {one.limit:g} %"
        for one in exceeded(result.comparison, reach_mm, limits)
    }
    return [plain.get(reason, reason) for reason in result.reasons]


def _kept(result: Result, reach_mm: float, limits: Limits) -> str:
    """Return how near to each limit a good experiment came."""
    comparison = result.comparison
    if comparison is None:
        return "nothing speaks against it"
    text = (
        f"while moving, the tools were at most {comparison.path.max_percent:.3f} % of reach apart "
        f"(limit {limits.path_error_percent:g} %)"
    )
    if comparison.positioning_max_mm is None:
        return text
    percent = 100.0 * comparison.positioning_max_mm / reach_mm
    return (
        f"{text}, and at rest the error was at most {percent:.3f} % "
        f"(limit {limits.positioning_error_percent:g} %)"
    )
