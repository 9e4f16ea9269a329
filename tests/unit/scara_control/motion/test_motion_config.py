"""motion.yaml: the shipped file loads and agrees with its neighbours.

A wrong one is refused by key and value.
"""

from __future__ import annotations

import pytest
from ruamel.yaml import YAML
from scara_config import ConfigError, config_directory, load_robot
from scara_control.config import in_si, load_motion


def changed(folder, section, key, value):
    """Write a copy of motion.yaml with one value changed (None: left out)."""
    tree = YAML(typ="safe").load((config_directory() / "motion.yaml").read_text())
    place = tree[section] if section else tree
    place.pop(key, None)
    if value is not None:
        place[key] = value
    with (folder / "motion.yaml").open("w") as stream:
        YAML().dump(tree, stream)
    return folder


def test_the_shipped_file_loads():
    """The defaults of the cell are allowed values."""
    assert load_motion().rate_hz == 100.0


def test_the_stream_is_extrapolated_as_the_simulator_does_it():
    """A stop after a broken stream begins where the simulator's joints are."""
    simulation = YAML(typ="safe").load((config_directory() / "simulation.yaml").read_text())
    assert load_motion().follow.extrapolation == pytest.approx(
        simulation["extrapolation_limit_ms"] * 1e-3
    )


@pytest.mark.parametrize(
    ("section", "key", "value", "text"),
    [
        (
            "move",
            "default_speed_percent",
            0.5,
            r"motion\.yaml: move\.default_speed_percent = 0\.5: Expected .*>= 1\.0",
        ),
        (
            "move",
            "horizon",
            0.015,
            r"motion\.yaml: move\.horizon = 0\.015: is below two periods, 0\.02 s",
        ),
        ("move", "announce", None, r"missing required field `announce`"),
        ("follow", "timeout", 0.0, r"follow\.timeout = 0\.0: Expected .*>= 0\.02"),
        ("jog", "speed", 10.0, r"unknown field `speed`"),
        ("", "rate_hz", "fast", r"rate_hz = 'fast': Expected `float`, got `str`"),
    ],
)
def test_a_wrong_value_is_named(tmp_path, section, key, value, text):
    """File, key, value, allowed."""
    with pytest.raises(ConfigError, match=text):
        load_motion(changed(tmp_path, section, key, value))


def test_a_tolerance_is_taken_in_the_joints_own_unit():
    """Degrees for joints that turn, millimetres for those that slide."""
    robot = load_robot()
    assert in_si(robot.joint("joint_1"), 180.0, 5.0) == pytest.approx(3.14159265)
    assert in_si(robot.joint("joint_3"), 180.0, 5.0) == pytest.approx(0.005)
