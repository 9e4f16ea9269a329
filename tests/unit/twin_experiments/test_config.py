"""experiments.yaml: accepted as shipped, refused with the key, the value and what is allowed."""

from __future__ import annotations

from pathlib import Path

import pytest
from ruamel.yaml import YAML
from scara_config import ConfigError, load_robot
from twin_experiments.config import RealLeads, TwinLeads, load_experiments, metrics_settings

SHIPPED = Path(__file__).resolve().parents[3] / "config"
ROBOT = load_robot(SHIPPED)


def test_the_shipped_file_holds_the_two_experiments_of_the_article() -> None:
    """Real leads by its program, the twin leads by move_to, both P1 P2 P3 P1 twice."""
    config = load_experiments(ROBOT, SHIPPED)
    real, twin = config.experiments["real_leads"], config.experiments["twin_leads"]
    assert isinstance(real, RealLeads) and isinstance(twin, TwinLeads)
    assert real.visits == twin.visits == ["P1", "P2", "P3", "P1", "P2", "P3", "P1"]
    assert ROBOT.positions_m == {
        "P1": (0.65, 0.0, 0.0),
        "P2": (0.51, 0.16, 0.10),
        "P3": (0.51, -0.16, 0.16),
    }
    assert (config.paper.path_error_percent, config.paper.positioning_error_percent) == (5.0, 2.0)


def test_the_dwell_is_long_enough_to_measure_a_position() -> None:
    """A twin that leaves before the rest is measured would fail every run."""
    config = load_experiments(ROBOT, SHIPPED)
    twin = config.experiments["twin_leads"]
    assert isinstance(twin, TwinLeads)
    assert twin.dwell_s > config.metrics.rest_s + config.metrics.rest_margin_s


def test_a_joint_moves_from_its_share_of_the_largest_speed() -> None:
    """Thresholds are in SI, one for each joint that moves the tool."""
    config = load_experiments(ROBOT, SHIPPED)
    found = metrics_settings(config.metrics, ROBOT)
    share = config.metrics.moving_speed_percent / 100.0
    assert found.moving_speeds.tolist() == [joint.velocity * share for joint in ROBOT.arm_joints]
    assert (found.reach_mm, found.rest_s) == (650.0, 0.5)


@pytest.mark.parametrize(
    ("section", "key", "value", "text"),
    [
        ("limits", "path_error_percent", None, "limits.*missing .* field `path_error_percent`"),
        ("limits", "path_error_percent", 0.0, "path_error_percent = 0.0: Expected `float` > 0.0"),
        ("metrics", "rate_hz", 10.0, "metrics.rate_hz = 10.0: Expected `float` >= 100.0"),
        ("experiments.real_leads", "leader", "operator", "experiments.*Invalid value 'operator'"),
        ("experiments.twin_leads", "speed_percent", 101.0, "101.0: Expected `float` <= 100.0"),
        ("experiments.twin_leads", "visits", ["P1", "P9"], "twin_leads.visits = P9: .*P1, P2, P3"),
        ("limits", "colour", "red", "unknown field `colour`"),
        ("deadlines_s", "move", 0.0, "deadlines_s.move = 0.0: Expected `float` > 0.0"),
    ],
)
def test_a_wrong_value_is_refused_with_its_key(
    tmp_path: Path, section: str, key: str, value: object, text: str
) -> None:
    """File, key, value and what is allowed are in the error; None: the key is missing."""
    tree = place = YAML(typ="safe").load((SHIPPED / "experiments.yaml").read_text())
    for name in section.split("."):
        place = place[name]
    place[key] = value
    if value is None:
        del place[key]
    with (tmp_path / "experiments.yaml").open("w") as stream:
        YAML().dump(tree, stream)
    with pytest.raises(ConfigError, match=text):
        load_experiments(ROBOT, tmp_path)


def test_an_unknown_experiment_is_refused_with_those_that_exist() -> None:
    """A typing error on the command line starts nothing."""
    config = load_experiments(ROBOT, SHIPPED)
    with pytest.raises(
        ConfigError,
        match=r"unknown experiment 'real_leds': experiments.yaml has real_leads, twin_leads",
    ):
        config.select(["real_leds"])
    assert list(config.select(["twin_leads"])) == ["twin_leads"]
    assert list(config.select([])) == ["real_leads", "twin_leads"]
