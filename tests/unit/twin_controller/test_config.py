"""The shipped twin_controller.yaml loads, a wrong one is refused with key, value and range."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from fanuc_emulator.config import load_emulator
from harness.workspace import ROOT
from harness.yaml_files import REMOVED, changed_yaml
from msgspec.structs import replace
from scara_config import ConfigError, load_robot
from scara_config.modbus_map import load_modbus_map
from scara_ros.gate.settings import load_gate
from scara_ros.page.persons_io import load_persons
from twin_controller.config import load_twin_controller
from twin_controller.reporting.snapshots import recorded_choices
from twin_controller.view import links_text

SHIPPED = ROOT / "config"
ROBOT = load_robot(SHIPPED)
NAMES = [joint.name for joint in ROBOT.twin_joints]


def test_the_shipped_file_loads() -> None:
    """The article's 80 % and two decimals are in it."""
    config = load_twin_controller(ROBOT, SHIPPED)
    assert config.limit.speed_percent == 80.0
    assert config.change.decimals == 2


def test_nothing_of_a_stand_in_is_read(tmp_path: Path) -> None:
    """How a robot behaves is measured: no file of a plant or of the stand-in is known here."""
    folder = tmp_path / "config"
    shutil.copytree(SHIPPED, folder)
    for name in [*folder.rglob("plants/*.yaml"), *folder.rglob("emulator.yaml")]:
        name.write_text("no: [yaml")
    load_twin_controller(load_robot(folder), folder)
    for load in (load_modbus_map, load_persons, load_gate):
        load(folder)
    with pytest.raises(ConfigError, match=r"emulator\.yaml"):
        load_emulator(load_robot(folder), folder)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (["limit", "speed_percent"], 100),
        (["divergence", "pause"], False),
        (["change", "confirm"], 3),
        (["response", "first_ms"], 400.0),
        (["response", "measured"], {name: {"delay_ms": 0} for name in NAMES}),
        (["home", "speed_percent"], 100.0),
        (["real", "port"], 502),
    ],
)
def test_other_values_are_accepted(tmp_path: Path, path: list[str | int], value: Any) -> None:
    """Up to the limits of their range."""
    load_twin_controller(
        ROBOT, changed_yaml(SHIPPED / "twin_controller.yaml", tmp_path, path, value)
    )


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (["limit", "speed_percent"], 101, r"limit\.speed_percent = 101: Expected `float` <= 100"),
        (["limit"], REMOVED, r"missing required field `limit`"),
        (["real", "stale_ms"], "soon", r"real\.stale_ms = 'soon': Expected `float`"),
        (["real", "colour"], "yellow", r"unknown field `colour`"),
        (["change", "hysteresis"], 0.0, r"change\.hysteresis = 0\.0: Expected `float` >= 0\.001"),
        (["change", "confirm"], 4, r"change\.confirm = 4: Expected at most change\.window = 3"),
        (
            ["divergence", "confirm"],
            16,
            r"divergence\.confirm = 16: Expected at most divergence\.window = 15",
        ),
        (
            ["response", "first_ms"],
            401,
            r"response\.first_ms = 401: Expected at most response\.longest_ms = 400",
        ),
        (
            ["response", "measured"],
            {"joint_1": {"delay_ms": 20}},
            r"response\.measured has joint_1: Expected joint_1, joint_2, joint_3, table_joint",
        ),
        (
            ["response", "measured"],
            {name: {"delay_ms": 100 * k + 110} for k, name in enumerate(NAMES)},
            r"response\.measured\.table_joint\.delay_ms = 410: Expected at most response",
        ),
        (["separation", "sensors"], ["my scanner"], r"separation\.sensors\[0\] = .my scanner"),
    ],
)
def test_a_wrong_file_is_refused(
    tmp_path: Path, path: list[str | int], value: Any, text: str
) -> None:
    """File, key, value and what is allowed."""
    with pytest.raises(ConfigError, match=rf"twin_controller\.yaml: .*{text}"):
        load_twin_controller(
            ROBOT, changed_yaml(SHIPPED / "twin_controller.yaml", tmp_path, path, value)
        )


def test_a_robot_whose_body_is_another_ones_is_refused(tmp_path: Path) -> None:
    """Nothing of it would be where it is watched; the preflight reads this file with the robot."""
    tool = [list(row) for row in ROBOT.home_pose]
    tool[0][3] = 0.497
    with pytest.raises(ConfigError, match=r"robot\.yaml: home_pose: the tool at \(497\.0, "):
        load_twin_controller(replace(ROBOT, home_pose=tool), SHIPPED)


def test_watching_people_with_no_sensor_named_is_refused(tmp_path: Path) -> None:
    """Nobody could be seen, and the pair would never align."""
    folder = changed_yaml(
        SHIPPED / "twin_controller.yaml", tmp_path, ["separation", "enabled"], True
    )
    changed_yaml(folder / "twin_controller.yaml", tmp_path, ["separation", "sensors"], [])
    with pytest.raises(ConfigError, match=r"separation\.sensors = \[\]: Expected at least one"):
        load_twin_controller(ROBOT, folder)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    """It is named."""
    with pytest.raises(ConfigError, match=r"twin_controller\.yaml: cannot be read"):
        load_twin_controller(ROBOT, tmp_path)


def test_links_are_strict_unless_somebody_says_that_the_cell_is_a_desk() -> None:
    """A real robot that is silent for a tenth of a second is lost."""
    config = load_twin_controller(ROBOT, SHIPPED)
    assert config.links == "strict"
    assert (config.real.timeout_ms, config.real.stale_ms, config.twin.stale_ms) == (70, 100, 220)
    assert config == load_twin_controller(ROBOT, SHIPPED, "strict")


def test_a_desk_is_more_patient_with_its_links_and_with_nothing_else() -> None:
    """Its processes share one machine; all other limits stay."""
    strict, desk = (load_twin_controller(ROBOT, SHIPPED, links) for links in ("strict", "desk"))
    assert desk.real.timeout_ms > strict.real.timeout_ms
    assert desk.real.stale_ms > strict.real.stale_ms
    assert desk.twin.stale_ms > strict.twin.stale_ms
    patient = ("timeout_ms", "stale_ms", "clock_jump_ms", "clock_conflicts")
    for side in (desk.real, desk.twin):
        assert side.clock_jump_ms > 100.0 and side.clock_conflicts > 50
    real = replace(desk.real, **{name: getattr(strict.real, name) for name in patient})
    twin = replace(desk.twin, **{name: getattr(strict.twin, name) for name in patient[1:]})
    assert replace(desk, real=real, twin=twin, links="strict") == strict


def test_a_desk_is_never_stricter_than_the_file(tmp_path: Path) -> None:
    """Who has made a limit longer keeps it."""
    folder = changed_yaml(SHIPPED / "twin_controller.yaml", tmp_path, ["real", "stale_ms"], 900.0)
    assert load_twin_controller(ROBOT, folder, "desk").real.stale_ms == 900.0


def test_what_is_recorded_is_loaded_with_the_links_that_were_in_force(tmp_path: Path) -> None:
    """A replay needs no parameter of the node that has run."""
    desk = load_twin_controller(ROBOT, SHIPPED, "desk")
    text = (SHIPPED / "twin_controller.yaml").read_text()
    for name, recorded in (
        ("line", recorded_choices(text, desk)),
        ("none", recorded_choices(text.replace("links: strict", "# links: strict"), desk)),
    ):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "twin_controller.yaml").write_text(recorded)
        assert load_twin_controller(ROBOT, folder) == desk
    assert recorded_choices(text, load_twin_controller(ROBOT, SHIPPED)) == text


def test_the_log_says_which_links_are_in_force() -> None:
    """With each limit."""
    said = links_text(load_twin_controller(ROBOT, SHIPPED))
    assert said == "link limits: strict; robot: answer 70 ms, data 100 ms; twin: data 220 ms"


@pytest.mark.parametrize("links", ["loose", "Desk"])
def test_an_unknown_choice_of_links_is_refused(links: str) -> None:
    """What is allowed is said."""
    with pytest.raises(ConfigError, match=f"links = '{links}': Expected strict, or desk"):
        load_twin_controller(ROBOT, SHIPPED, links)
