"""emulator.yaml and the programs.

The shipped ones load, wrong ones are refused with file, place, value and range.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fanuc_emulator.config import EmulatorConfig, load_emulator, load_programs, on_a_desk
from fanuc_emulator.plant.config import axis_parameters
from harness.yaml_files import REMOVED, changed_yaml, shipped
from msgspec.structs import replace
from scara_config import ConfigError, Robot
from scara_config.programs.lines import MoveStep

CONFIG = Path(__file__).resolve().parents[3] / "config"
ARTICLE = shipped("programs/article.yaml")


def test_article_positions_give_the_articles_coordinates(robot: Robot) -> None:
    """Forward kinematics of the program's P1, P2, P3 hits the article's points within 1 um."""
    l1, l2, h = (getattr(robot.geometry, name) / 1000 for name in ("l1_mm", "l2_mm", "h_mm"))
    p1, p2, p3 = (0.65, 0.0, 0.0), (0.51, 0.16, 0.10), (0.51, -0.16, 0.16)
    moves = [step for step in load_programs(robot, CONFIG)[2].steps if isinstance(step, MoveStep)]
    for step, point in zip(moves, (p1, p2, p3, p1, p2, p3, p1), strict=True):
        q1, q2, q3 = step.target[:3]
        x, y = l1 * np.cos(q1) + l2 * np.cos(q1 + q2), l1 * np.sin(q1) + l2 * np.sin(q1 + q2)
        assert np.abs(np.array([x, y, h + q3]) - point).max() < 1e-6


def test_shipped_programs_have_their_own_rsr_and_two_point_goes_there_and_back(
    robot: Robot,
) -> None:
    """RSR2 is the article's experiment, RSR3 its scenario: two positions, a speed for each way."""
    programs = load_programs(robot, CONFIG)
    assert {number: program.name for number, program in programs.items()} == {
        2: "ARTICLE",
        3: "TWO_POINT",
        4: "PALLETISE",
    }
    moves = [step for step in programs[3].steps if isinstance(step, MoveStep)]
    assert len({step.target for step in moves}) == 2
    assert {step.speed_percent for step in moves if step.target == moves[1].target} == {30.0}
    assert {step.speed_percent for step in moves[1:] if step.target == moves[0].target} == {60.0}


def test_drives_can_do_more_than_the_twin_asks_for(config: EmulatorConfig, robot: Robot) -> None:
    """What the twin's limits allow is never clipped by the command, nor that by the motor."""
    for joint in robot.joints:
        parameters = axis_parameters(config.plant, joint)
        assert joint.acceleration < parameters.command_acceleration < parameters.servo_acceleration
        assert parameters.program_acceleration < parameters.command_acceleration


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (["port"], 0, r"emulator.yaml: port = 0: Expected `int` >= 1"),
        (
            ["start_position", "joint_3_mm"],
            5.0,
            r"start_position.joint_3_mm = 5.0: outside \[-210.0, 0.0\] mm",
        ),
        (["start_position", "joint_1_deg"], REMOVED, r"start_position.joint_1_deg: is missing"),
        (["stream_program"], "lower case", r"stream_program"),
    ],
)
def test_a_wrong_emulator_yaml_is_refused(
    tmp_path: Path, robot: Robot, path: list[str | int], value: Any, text: str
) -> None:
    """The text names file, key, value and what is allowed."""
    folder = changed_yaml(shipped("emulator.yaml"), tmp_path, path, value)
    with pytest.raises(ConfigError, match=text):
        load_emulator(robot, folder)


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (
            ["positions", "P3", "joint_3_mm"],
            1.0,
            r"positions.P3.joint_3_mm = 1.0: outside \[-210.0, 0.0\] mm",
        ),
        (
            ["positions", "P1", "joint_7_deg"],
            1.0,
            r"positions.P1.joint_7_deg = 1.0: unknown, allowed are joint_1_deg",
        ),
        (["positions", "P1", "joint_4_deg"], REMOVED, r"positions.P1.joint_4_deg: is missing"),
        (["positions", "P1"], REMOVED, r"line 1: position 'P1' is unknown, there are P2, P3"),
        (["name"], "A_NAME_OF_17_CHAR", r"name = 'A_NAME_OF_17_CHAR'"),
        (["rsr"], 1, r"rsr = 1: Expected `int` >= 2"),
        (["lines", 0, "speed_percent"], 101, r"speed_percent = 101: Expected `float` <= 100"),
        (["lines", 0, "do"], "jump", r"Invalid value 'jump'"),
        (["lines"], [], r"lines = \[\]"),
    ],
)
def test_a_wrong_program_is_refused(
    tmp_path: Path, robot: Robot, path: list[str | int], value: Any, text: str
) -> None:
    """A position outside the range names file, line, joint, value and range."""
    (tmp_path / "programs").mkdir()
    changed_yaml(ARTICLE, tmp_path / "programs", path, value)
    with pytest.raises(ConfigError, match=text):
        load_programs(robot, tmp_path)


def test_a_position_out_of_range_names_the_line_of_the_file(tmp_path: Path, robot: Robot) -> None:
    """File, line, joint, value and range: nobody has to search."""
    (tmp_path / "programs").mkdir()
    text = ARTICLE.read_text().replace("joint_1_deg: -14.321759156", "joint_1_deg: 150.0")
    line = next(number for number, row in enumerate(text.splitlines(), 1) if "150.0" in row)
    (tmp_path / "programs" / "bad.yaml").write_text(text)
    with pytest.raises(
        ConfigError,
        match=(
            rf"bad.yaml, line {line}: positions.P2.joint_1_deg = 150.0: outside \[-148.0, "
            r"148.0\] deg"
        ),
    ):
        load_programs(robot, tmp_path)


def test_two_programs_may_not_share_a_number(tmp_path: Path, robot: Robot) -> None:
    """RSR2 starts one program only."""
    (tmp_path / "programs").mkdir()
    shutil.copy(ARTICLE, tmp_path / "programs" / "a.yaml")
    shutil.copy(ARTICLE, tmp_path / "programs" / "b.yaml")
    said = r"/b.yaml: name ARTICLE, rsr 2: a.yaml has name ARTICLE, rsr 2; change one of the two"
    with pytest.raises(ConfigError, match=said):
        load_programs(robot, tmp_path)


def test_a_stand_in_on_a_desk_waits_longer_for_its_client(robot: Robot) -> None:
    """Its client shares the machine; longer times of the file stay, and nothing else changes."""
    config = load_emulator(robot, CONFIG)
    desk = on_a_desk(config)
    assert config.heartbeat_timeout_ms == 120 < desk.heartbeat_timeout_ms
    assert replace(desk, heartbeat_timeout_ms=120) == config
    patient = replace(config, heartbeat_timeout_ms=5000)
    assert on_a_desk(patient) == patient
    plain = replace(config, desk_heartbeat_timeout_ms=None)
    assert on_a_desk(plain) == plain


def test_settings_of_one_run_go_before_the_file(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As text by SCARA_SETTINGS, or given; what is not named stays as filed."""
    monkeypatch.setenv("SCARA_SETTINGS", "uop: simple, cstopi_for_abort: false")
    config = load_emulator(robot, CONFIG).settings
    assert (config.uop, config.cstopi_for_abort, config.imstp_assigned) == ("simple", False, True)
    assert load_emulator(robot, CONFIG, settings={"uop": "none"}).settings.uop == "none"
    assert load_emulator(robot, CONFIG, settings="").settings.cstopi_for_abort


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("uop: half", r"settings: Invalid enum value 'half' - at `\$.uop`"),
        ("cstopi: true", "settings: cstopi: unknown, allowed are cstopi_for_abort, imstp_assigned"),
        ("shortest_pulse_ms: 5000", r"settings: Expected `int` <= 1000"),
        ("uop: [", "settings 'uop: \\[': are no YAML"),
    ],
)
def test_a_wrong_setting_is_refused(robot: Robot, text: str, message: str) -> None:
    """With its name and what is allowed."""
    with pytest.raises(ConfigError, match=message):
        load_emulator(robot, CONFIG, settings=text)
