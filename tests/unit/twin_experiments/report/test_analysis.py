"""What is found in bags that imitate a run, held against closed forms."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from cell_recorder.reading.bag_reader_io import BagError
from harness.running.thorough import thorough
from scara_config import ConfigError
from twin_experiments.report.document import report_document
from twin_experiments.report.record import RecordError
from twin_experiments.report.report_io import analyse_bag

CONFIG = Path(__file__).resolve().parents[4] / "config"
MakeBag = Callable[..., Path]
FIRST = ("real_leads",)


def analyse(bag: Path) -> dict[str, Any]:
    """Return what report.json would hold."""
    _, chosen, results = analyse_bag(bag, CONFIG)
    return report_document(results, chosen.robot.reach_mm, chosen.experiments.paper)


@pytest.mark.parametrize("lag_s", [0.007, *thorough(0.0, 0.03)])
def test_the_lag_of_the_follower_is_found_whoever_leads(make_bag: MakeBag, lag_s: float) -> None:
    """Sub-millisecond, with sides sampled at 250 and 200 Hz and a micrometre of noise."""
    document = analyse(make_bag(lag_s=lag_s, noise=1e-6))
    assert [e["lag_s"] for e in document["experiments"]] == pytest.approx([lag_s, lag_s], abs=2e-4)


def test_the_path_error_is_lag_times_speed_and_vanishes_without_the_lag(
    make_bag: MakeBag, largest_tool_speed: float
) -> None:
    """For a short lag the largest distance is the largest tool speed times the lag."""
    first = analyse(make_bag(experiments=FIRST, lag_s=0.001))["experiments"][0]
    assert first["path_error_max_mm"] == pytest.approx(1e3 * largest_tool_speed * 0.001, rel=1e-2)
    assert first["path_error_max_after_lag_mm"] < 0.01


def test_an_offset_of_the_follower_is_its_positioning_error(make_bag: MakeBag) -> None:
    """0.5 mm up at the follower are 0.5 mm between the sides and against the set position.

    The leader has 0.
    """
    first = analyse(make_bag(experiments=FIRST, offset=(0.0, 0.0, 0.0005, 0.0)))["experiments"][0]
    assert first["positioning_error_max_mm"] == pytest.approx(0.5, abs=1e-3)
    assert first["positioning_error_max_percent"] == pytest.approx(100.0 * 0.5 / 650.0, abs=1e-3)
    for rest in first["positions"]:
        assert rest["real_set_mm"] < 0.01 < rest["twin_set_mm"]


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"lag_s": 0.1}, r"path error \d+\.\d+ % of reach, limit 2 %"),
        ({"offset": (0.0, 0.0, 0.002, 0.0)}, r"positioning error 0.308 % of reach, limit 0.2 %"),
        ({"offset": (0.0, 0.0, -0.05, 0.0)}, r"positioning error 7.692 % of reach"),
        (
            {"hole": ("twin/joint_states", 1.0, 1.5)},
            r"5\.\d % of the time has no samples, limit 1 %",
        ),
        ({"frozen_after": 3.0}, r"both stood still at P1 P2 P3, expected P1 P2 P3 P1 P2 P3 P1"),
    ],
)
def test_a_limit_that_is_missed_is_the_reason_to_fail(
    make_bag: MakeBag, options: dict[str, Any], reason: str
) -> None:
    """The verdict says by how much."""
    document = analyse(make_bag(experiments=FIRST, **options))
    for experiment in document["experiments"]:
        assert experiment["verdict"] == "fail"
        assert any(re.search(reason, text) for text in experiment["reasons"])


@pytest.mark.parametrize(
    ("old", "new", "error", "text"),
    [
        ("urdf: sc", r"reach_mm: -1.0\nurdf: sc", ConfigError, "in the bag: reach_mm = -1"),
        ("urdf: sc", "a: [", ConfigError, "robot.yaml in the bag: is no valid YAML"),
        ("{", "[", BagError, "configuration is no JSON"),
        ("  twin_leads:", "  both_lead:", RecordError, "unknown experiment twin_leads: exp.*both_"),
    ],
)
def test_a_wrong_configuration_in_the_bag_is_named(
    make_bag: MakeBag,
    recorded_configuration: str,
    old: str,
    new: str,
    error: type[Exception],
    text: str,
) -> None:
    """It is no excuse to take another one; the text lists what is known."""
    with pytest.raises(error, match=text):
        configuration = recorded_configuration.replace(old, new, 1)
        analyse(make_bag(experiments=("twin_leads",), configuration=configuration))


@pytest.mark.parametrize(
    ("options", "error"),
    [
        ({"plant": "{"}, "real/plant: Input data was truncated"),
        ({"plant": '{"name": "soft"}'}, "real/plant: .* required field `description`"),
        (
            {"plant": '{"name": "soft", "description": "", "payload_kg": "1"}'},
            r"real/plant: Expected `float`, got `str` - at `\$.payload_kg`",
        ),
        ({"without": ("real/ground_truth",)}, "no message of real/ground_truth; the bag holds"),
        ({"without": ("twin/joint_states",)}, "no message of twin/joint_states; the bag holds"),
    ],
)
def test_what_a_bag_lacks_or_has_wrong_is_named(
    make_bag: MakeBag, options: dict[str, Any], error: str
) -> None:
    """No figure is made up, and a figure without its label is no figure."""
    with pytest.raises(BagError, match=f"run.bag: {error}"):
        analyse(make_bag(experiments=FIRST, **options))


def test_a_side_without_samples_fails_the_experiment_with_its_name(make_bag: MakeBag) -> None:
    """The others are reported all the same."""
    document = analyse(make_bag(silent=("twin/joint_states", "twin_leads")))
    first, second = document["experiments"]
    assert first["verdict"] == "pass"
    assert (second["verdict"], second["samples"], second["lag_s"]) == ("fail", 0, None)
    assert "twin: " in second["reasons"][0] and "samples between" in second["reasons"][0]
