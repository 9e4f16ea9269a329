"""Say in one sentence whether an experiment was good, and why."""

from __future__ import annotations

from twin_experiments.analysis import Result, exceeded
from twin_experiments.config import Limits


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
