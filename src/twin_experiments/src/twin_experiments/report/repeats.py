"""Repeats of one experiment in one run: mean, spread and worst of each figure."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

FIGURES = {
    "path_error_max_percent": ("path error max", "%", 1.0),
    "path_error_rms_percent": ("path error rms", "%", 1.0),
    "path_error_max_after_lag_percent": ("after lag", "%", 1.0),
    "lag_s": ("lag", "ms", 1e3),
    "positioning_error_max_percent": ("positioning max", "%", 1.0),
}
"""Figure of report.json to its heading, the unit it is shown in, and the factor to that unit."""

HEADINGS = ("experiment", "figure", "repeats", "mean", "spread", "worst")


def summarize(values: Sequence[float]) -> dict[str, float]:
    """Return the mean, the sample standard deviation and the largest amount.

    The deviation of a single value is 0; the largest value keeps its sign.

    Example:
        >>> summarize([1.0, 2.0, -3.0])["worst"]
        -3.0
    """
    mean = math.fsum(values) / len(values)
    squares = math.fsum((value - mean) ** 2 for value in values)
    spread = math.sqrt(squares / (len(values) - 1)) if len(values) > 1 else 0.0
    return {"mean": mean, "spread": spread, "worst": max(values, key=abs)}


def summarize_repeats(experiments: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Summarize those experiments of a report that were made more than once.

    Args:
        experiments: Entries of report.json.

    Returns:
        For each of them name, leader, how many there are, how many passed, and each figure that all
        of them have.
    """
    found = []
    for name in dict.fromkeys(entry["name"] for entry in experiments):
        repeats = [entry for entry in experiments if entry["name"] == name]
        if len(repeats) > 1:
            passed = sum(entry["verdict"] == "pass" for entry in repeats)
            summary: dict[str, Any] = {
                "name": name,
                "leader": repeats[0]["leader"],
                "repeats": len(repeats),
                "passed": passed,
            }
            for figure in FIGURES:
                values = [entry.get(figure) for entry in repeats]
                if all(value is not None for value in values):
                    summary[figure] = summarize(values)  # type: ignore[arg-type]
            found.append(summary)
    return found


def repeat_rows(summaries: Sequence[dict[str, Any]]) -> list[tuple[str, ...]]:
    """Return a row of text for each figure of each repeated experiment.

    The cells are those of ``HEADINGS``.
    """
    return [
        (
            summary["name"],
            heading,
            str(summary["repeats"]),
            *(f"{summary[figure][key] * factor:.3f} {unit}" for key in HEADINGS[3:]),
        )
        for summary in summaries
        for figure, (heading, unit, factor) in FIGURES.items()
        if figure in summary
    ]
