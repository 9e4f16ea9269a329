"""Which files of a run may be seen, and how a run is listed."""

from __future__ import annotations

import pytest
from operator_panel.runs import length_text, may_be_shown, size_text, verdict


@pytest.mark.parametrize("file", ["report.html", "report.json", "paths.png", "a.svg", "run.bag"])
def test_report_pictures_and_bag_may_be_shown(file: str) -> None:
    """What a report links to."""
    assert may_be_shown("2026-01-01_12-00-00", file)


@pytest.mark.parametrize(
    ("run", "file"),
    [
        *[("a", name) for name in ("operator_token", "ros_home/operator_token", ".html")],
        *[("a", name) for name in ("../b.html", "x.log", "x.html\n", "..html.html..")],
        *[(name, "report.html") for name in ("..", "", "a/ros_home", "latest")],
        ("course", "results.json"),
        ("health", "cell.json"),
        *[(name, "run.bag") for name in ("farm", "lab", "configuration", "bench", "storm")],
    ],
)
def test_nothing_else_leaves_the_machine(run: str, file: str) -> None:
    """Least of all the operator's token, which lies in the ROS folder of a run."""
    assert not may_be_shown(run, file)


@pytest.mark.parametrize(
    ("size", "text"),
    [(0, "0 B"), (999, "999 B"), (1000, "1 kB"), (12_345_678, "12 MB"), (2_500_000_000, "2.5 GB")],
)
def test_size_is_in_the_unit_that_reads_best(size: int, text: str) -> None:
    """Decimal units."""
    assert size_text(size) == text


def test_verdict_names_each_experiment_with_its_error() -> None:
    """As report.json has it."""
    report = {
        "experiments": [
            {"name": "real_leads", "verdict": "passed", "path_error_max_percent": 0.283}
        ]
    }
    assert verdict(report) == "real_leads: passed, path error 0.28 % of reach"


def test_verdict_of_a_report_without_figures_is_no_crash() -> None:
    """An older or broken report is still listed."""
    assert verdict({}) == ""
    assert verdict({"experiments": [{}]}) == "?: ?, no path error"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(4.26, "4.3 s"), (59.4, "59.4 s"), (125.0, "2 min 5 s"), (3725.0, "1 h 2 min")],
)
def test_length_is_in_the_units_that_read_best(seconds: float, text: str) -> None:
    """Nobody counts 3725 s."""
    assert length_text(seconds) == text
