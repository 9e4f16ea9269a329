"""operator_panel.yaml, and what is read of the other rooms' files."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.workspace import ROOT
from harness.yaml_files import changed_yaml
from operator_panel.config import load_panel, load_surroundings
from scara_config import ConfigError, load_robot

CONFIG = ROOT / "config"
ROBOT = load_robot(CONFIG)


def test_dead_man_is_longer_than_two_signs_and_within_the_jog_controllers_patience() -> None:
    """One lost packet does not stutter.

    The panel gives up no later than joint_vel_controller does.
    """
    jog = load_panel(CONFIG).jog
    assert 2.0 / jog.rate_hz < jog.dead_man_ms * 1e-3 <= 0.25


def test_page_asks_for_no_faster_jog_than_is_accepted() -> None:
    """The slider opens within its range."""
    assert (
        load_panel(CONFIG).jog.speed_percent <= load_surroundings(ROBOT, CONFIG).jog_limit_percent
    )


def test_programs_positions_and_the_robots_address_come_from_the_other_rooms_files() -> None:
    """Nothing is written down twice."""
    around = load_surroundings(ROBOT, CONFIG)
    assert [program.name for program in around.programs] == sorted(
        program.name for program in around.programs
    )
    assert "ARTICLE" in [program.name for program in around.programs]
    assert around.positions["P1"] == (0.65, 0.0, 0.0)
    assert around.real.port == 5020
    assert around.keep_s == 5.0


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (["port"], 0, r"port = 0"),
        (["update_rate_hz"], 100, r"update_rate_hz = 100"),
        (["jog", "dead_man_ms"], 5000, r"dead_man_ms = 5000"),
        (["preview", "step_deg"], -1.0, r"step_deg"),
        (["api_origins"], ["null"], r"api_origins\[0\] = .null"),
    ],
)
def test_value_out_of_range_is_refused(
    tmp_path: Path, path: list[str | int], value: object, text: str
) -> None:
    """File, key and value are in the text."""
    changed_yaml(CONFIG / "operator_panel.yaml", tmp_path, path, value)
    with pytest.raises(ConfigError, match=rf"operator_panel\.yaml: .*{text}"):
        load_panel(tmp_path)
