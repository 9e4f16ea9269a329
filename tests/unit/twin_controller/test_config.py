"""twin_controller.yaml: the shipped file loads, a wrong one is refused with file, key, value and what is allowed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from harness.workspace import ROOT
from harness.yaml_files import REMOVED, changed_yaml
from msgspec.structs import replace
from scara_config import ConfigError, load_robot
from twin_controller.config import load_twin_controller

SHIPPED = ROOT / "config"
ROBOT = load_robot(SHIPPED)


def test_the_shipped_file_loads() -> None:
    """The article's 80 % and two decimals are in it."""
    config = load_twin_controller(ROBOT, SHIPPED)
    assert config.limit.speed_percent == 80.0
    assert config.change.decimals == 2


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (["limit", "speed_percent"], 100),
        (["divergence", "pause"], False),
        (["change", "confirm"], 3),
        (["real", "follow_lag_ms"], 0.0),
        (["real", "follow_lag_range_ms"], [0, 600]),
        (["home", "speed_percent"], 100.0),
        (["real", "port"], 502),
    ],
)
def test_other_values_are_accepted(tmp_path: Path, path: list[str | int], value: Any) -> None:
    """Up to the limits of their range."""
    load_twin_controller(ROBOT, changed_yaml(SHIPPED / "twin_controller.yaml", tmp_path, path, value))


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (["limit", "speed_percent"], 0, r"limit\.speed_percent = 0: Expected `float` >= 1"),
        (["limit", "speed_percent"], 101, r"limit\.speed_percent = 101: Expected `float` <= 100"),
        (["limit", "step_margin"], 0.9, r"limit\.step_margin = 0\.9: Expected `float` >= 1"),
        (["limit"], REMOVED, r"missing required field `limit`"),
        (["real", "port"], 70000, r"real\.port = 70000: Expected `int` <= 65535"),
        (["real", "stale_ms"], 0, r"real\.stale_ms = 0: Expected `float` > 0"),
        (["real", "stale_ms"], "soon", r"real\.stale_ms = 'soon': Expected `float`"),
        (["real", "colour"], "yellow", r"unknown field `colour`"),
        (["change", "hysteresis"], 0.0, r"change\.hysteresis = 0\.0: Expected `float` > 0"),
        (["change", "confirm"], 4, r"change\.confirm = 4: Expected at most change\.window = 3"),
        (["divergence", "confirm"], 16, r"divergence\.confirm = 16: Expected at most divergence\.window = 15"),
        (["divergence", "release_ratio"], 1.0, r"divergence\.release_ratio = 1\.0: Expected `float` < 1"),
        (["real", "follow_lag_ms"], 151, r"real\.follow_lag_ms = 151: Expected 0 to 150"),
        (["stream", "period_ms"], 9.0, r"stream\.period_ms = 9: Expected a multiple of real\.sample_period_ms = 2, or null"),
        (["stream", "period_ms"], 0.000001, r"stream\.period_ms = 1e-06: Expected a multiple of real\.sample_period_ms = 2"),
        (["home", "speed_percent"], 0.0, r"home\.speed_percent = 0\.0: Expected `float` >= 1"),
        (["state_rate_hz"], 0.5, r"state_rate_hz = 0\.5: Expected `float` >= 1"),
        (["decision_history"], 5, r"decision_history = 5: Expected `int` >= 10"),
    ],
)
def test_a_wrong_file_is_refused(tmp_path: Path, path: list[str | int], value: Any, text: str) -> None:
    """File, key, value and what is allowed."""
    with pytest.raises(ConfigError, match=rf"twin_controller\.yaml: .*{text}"):
        load_twin_controller(ROBOT, changed_yaml(SHIPPED / "twin_controller.yaml", tmp_path, path, value))


@pytest.mark.parametrize(("path", "value"), [(["separation", "enabled"], True), (["cell", "cartesian_speed_mm_s"], 250.0)])
def test_watching_a_robot_without_watched_points_is_refused(tmp_path: Path, path: list[str | int], value: Any) -> None:
    """Nothing would be too fast or too close."""
    folder = changed_yaml(SHIPPED / "twin_controller.yaml", tmp_path, path, value)
    load_twin_controller(ROBOT, folder)
    with pytest.raises(ConfigError, match=r"need watched_points in robot\.yaml: Expected at least one"):
        load_twin_controller(replace(ROBOT, watched_points=[]), folder)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    """It is named."""
    with pytest.raises(ConfigError, match=r"twin_controller\.yaml: cannot be read"):
        load_twin_controller(ROBOT, tmp_path)
