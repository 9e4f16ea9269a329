"""Say of a whole run in one sentence whether it was good, from the figures of report.json."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from twin_experiments.config import Limits

PATH, POSITIONING = "path_error_max_percent", "positioning_error_max_percent"


def run_verdict(document: Mapping[str, Any], limits: Limits) -> str:
    """Return one sentence: good or bad, by the worst figures of all experiments.

    Args:
        document: What report.json holds.
        limits: Of the verdict.

    Returns:
        For example "Good: all 2 experiments passed. While moving, the tools were at most 0.32 % of
        reach apart (limit 5 %), at rest 0.010 % (limit 2 %)."
    """
    experiments = document["experiments"]
    failed = [one["name"] for one in experiments if one["verdict"] != "pass"]
    if not experiments:
        return "Nothing to judge: the run has no experiment."
    if failed:
        head = f"Bad: {len(failed)} of {len(experiments)} experiments failed ({', '.join(failed)})."
    else:
        count = "the experiment" if len(experiments) == 1 else f"all {len(experiments)} experiments"
        head = f"Good: {count} passed."
    return f"{head}{_figures(experiments, limits)}"


def _figures(experiments: list[Mapping[str, Any]], limits: Limits) -> str:
    """Return the worst figures beside their limits; empty if nothing could be compared."""
    paths = [one[PATH] for one in experiments if one[PATH] is not None]
    if not paths:
        return ""
    text = (
        f" While moving, the tools were at most {max(paths):.2f} % of reach apart "
        f"(limit {limits.path_error_percent:g} %)"
    )
    rests = [one[POSITIONING] for one in experiments if one[POSITIONING] is not None]
    if rests:
        text += f", at rest {max(rests):.3f} % (limit {limits.positioning_error_percent:g} %)"
    return f"{text}."
