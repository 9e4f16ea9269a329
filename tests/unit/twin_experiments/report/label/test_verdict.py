"""The last line of a demo: good or bad, by the worst figures."""

from __future__ import annotations

from typing import Any

import pytest
from twin_experiments.config import Limits
from twin_experiments.report.label.verdict import run_verdict

LIMITS = Limits(path_error_percent=5.0, positioning_error_percent=2.0, excluded_percent=5.0)


def entry(name: str, verdict: str, path: float | None, rest: float | None) -> dict[str, Any]:
    """Return what report.json holds of an experiment, as far as it matters here."""
    return {
        "name": name,
        "verdict": verdict,
        "path_error_max_percent": path,
        "positioning_error_max_percent": rest,
    }


@pytest.mark.parametrize(
    ("entries", "sentence"),
    [
        (
            [entry("a", "pass", 0.161, 0.001), entry("b", "pass", 0.32, 0.0104)],
            "Good: all 2 experiments passed. While moving, the tools were at most 0.32 % of reach "
            "apart (limit 5 %), at rest 0.010 % (limit 2 %).",
        ),
        (
            [entry("a", "pass", 0.1, None)],
            "Good: the experiment passed. While moving, the tools were at most 0.10 % of reach "
            "apart (limit 5 %).",
        ),
        (
            [entry("a", "pass", 0.1, 0.1), entry("b", "fail", 6.25, 0.2)],
            "Bad: 1 of 2 experiments failed (b). While moving, the tools were at most 6.25 % of "
            "reach apart (limit 5 %), at rest 0.200 % (limit 2 %).",
        ),
        ([entry("a", "fail", None, None)], "Bad: 1 of 1 experiments failed (a)."),
        ([], "Nothing to judge: the run has no experiment."),
    ],
)
def test_one_sentence_says_whether_a_run_was_good(
    entries: list[dict[str, Any]], sentence: str
) -> None:
    """What could not be compared has no figure, and a failed experiment is named."""
    assert run_verdict({"experiments": entries}, LIMITS) == sentence
