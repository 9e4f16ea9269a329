"""simulation.yaml and pid_gains.yaml: what ships loads, what is wrong is named."""

from __future__ import annotations

from pathlib import Path

import pytest
from harness.yaml_files import shipped
from scara_config import ConfigError, load_robot
from scara_simulation.config import load_gains, load_simulation

CONFIG = Path(__file__).parents[4] / "config"
ROBOT = load_robot(CONFIG)


def changed(tmp_path, name, old, new):
    """Copy a file of the package with one text replaced."""
    text = shipped(name).read_text()
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new, 1))
    return tmp_path


def test_shipped_files_load():
    """A millisecond a step, gains for each joint of the twin."""
    config = load_simulation(ROBOT, CONFIG)
    assert (config.dt, config.step_ns) == (1e-3, 1_000_000)
    assert len(load_gains(ROBOT, CONFIG)) == len(ROBOT.twin_joints)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        (
            "physics_rate_hz: 1000",
            "physics_rate_hz: 50",
            r"simulation\.yaml: physics_rate_hz = 50: .*>= 200",
        ),
        (
            "physics_rate_hz: 1000",
            "physics_rate_hz: 1500",
            "physics_rate_hz = 1500: must divide 1000000000",
        ),
        (
            "joint_states_rate_hz: 100",
            "joint_states_rate_hz: 300",
            "joint_states_rate_hz = 300: must divide physics_rate_hz",
        ),
        (
            "controller_state_rate_hz: 20",
            "controller_state_rate_hz: 30",
            "= 30: must divide joint_states_rate_hz = 100",
        ),
        (
            "max_catch_up_ms: 50.0",
            "max_catch_up_ms: 15.0",  # a node may wake each 20 ms: never all of it is skipped
            r"max_catch_up_ms = 15\.0: Expected `float` >= 30",
        ),
        ("feed_forward: true", "feed_forward: 3", "feed_forward = 3: Expected `bool`"),
        ("feed_forward: true", "feedforward: true", "feedforward"),
        (
            "feed_forward: true",
            "joint_dynamics: {joint_9: {damping: 1.0, friction: 1.0}}\nfeed_forward: true",
            r"joint_dynamics\.joint_9: no joint of the twin; it has joint_1",
        ),
    ],
)
def test_wrong_simulation_is_refused(tmp_path, old, new, why):
    """The text names file, key, value and what is allowed."""
    with pytest.raises(ConfigError, match=why):
        load_simulation(ROBOT, changed(tmp_path, "simulation.yaml", old, new))


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("p: 8285.0", "p: -1.0", r"pid_gains\.yaml: joint_1|pid_gains\.yaml: .*-1\.0"),
        ("\njoint_2:", "\njoint_4:", "joint_4: no joint of the twin"),
        ("i_clamp: 1.5", "iclamp: 1.5", "iclamp"),
    ],
)
def test_wrong_gains_are_refused(tmp_path, old, new, why):
    """Gains are exactly those of the twin's joints."""
    with pytest.raises(ConfigError, match=why):
        load_gains(ROBOT, changed(tmp_path, "pid_gains.yaml", old, new))


def test_missing_file_is_named(tmp_path):
    """A folder without the file is no configuration."""
    with pytest.raises(ConfigError, match=r"pid_gains\.yaml: cannot be read"):
        load_gains(ROBOT, tmp_path)
