"""Repeats: mean, spread and worst, and how they appear in the report."""

from __future__ import annotations

import statistics
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from twin_experiments.report.record import find_spans
from twin_experiments.report.repeats import repeat_rows, summarize, summarize_repeats


@given(st.lists(st.floats(-100.0, 100.0), min_size=2, max_size=20))
def test_mean_and_spread_are_those_of_the_statistics_module(values: list[float]) -> None:
    """The worst is the largest in amount and keeps its sign."""
    found = summarize(values)
    assert found["mean"] == pytest.approx(statistics.mean(values), abs=1e-9)
    assert found["spread"] == pytest.approx(statistics.stdev(values), abs=1e-6)
    assert abs(found["worst"]) == max(map(abs, values)) and found["worst"] in values


def test_a_single_value_has_no_spread() -> None:
    """Nothing is divided by zero."""
    assert summarize([2.0]) == {"mean": 2.0, "spread": 0.0, "worst": 2.0}


def entry(name: str, error: float | None, verdict: str = "pass") -> dict[str, Any]:
    """Return an experiment of report.json with one figure."""
    return {
        "name": name,
        "leader": "real",
        "verdict": verdict,
        "path_error_max_percent": error,
        "lag_s": 0.001,
    }


def test_only_what_was_repeated_is_summarized() -> None:
    """By name; how many passed is counted; a figure that one lacks is left out."""
    once, twice = entry("a", 1.0), [entry("b", 1.0), entry("b", 3.0, "fail")]
    (summary,) = summarize_repeats([twice[0], once, twice[1]])
    assert (summary["name"], summary["repeats"], summary["passed"]) == ("b", 2, 1)
    assert summary["path_error_max_percent"] == {
        "mean": 2.0,
        "spread": pytest.approx(2**0.5),
        "worst": 3.0,
    }
    rows = repeat_rows([summary])
    assert ("b", "lag", "2", "1.000 ms", "0.000 ms", "1.000 ms") in rows
    (partly,) = summarize_repeats([entry("b", 1.0), entry("b", None)])
    assert "path_error_max_percent" not in partly
    assert summarize_repeats([once]) == []


def test_repeats_are_numbered_by_name() -> None:
    """The second one of a name is called so."""
    markers = [
        (float(k), text)
        for k, text in enumerate(["start a", "end a", "start b", "end b", "start a", "end a"])
    ]
    assert [span.label for span in find_spans(markers, 9.0)] == ["a", "b", "a #2"]
