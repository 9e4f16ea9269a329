"""emulator.yaml and the programs.

The shipped ones load, wrong ones are refused with file, place, value and range.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fanuc_emulator.config import (
    EmulatorConfig,
    EmulatorFile,
    load_emulator,
    load_library,
    load_programs,
    on_a_desk,
)
from fanuc_emulator.plant.config import axis_parameters
from fanuc_emulator.settings import ControllerSettings
from harness.programs import steps_of
from harness.yaml_files import REMOVED, changed_yaml, copy_configuration, shipped
from msgspec import ValidationError, convert
from msgspec.structs import replace
from scara_config import ConfigError, Robot
from scara_config.programs.steps import MoveStep

CONFIG = Path(__file__).resolve().parents[3] / "config"
ARTICLE = shipped("programs/ARTICLE.LS")


def test_article_positions_give_the_articles_coordinates(robot: Robot) -> None:
    """Forward kinematics of the program's P1, P2, P3 hits the article's points within 1 um."""
    l1, l2, h = (getattr(robot.geometry, name) / 1000 for name in ("l1_mm", "l2_mm", "h_mm"))
    p1, p2, p3 = (0.65, 0.0, 0.0), (0.51, 0.16, 0.10), (0.51, -0.16, 0.16)
    moves = [
        step for step in steps_of(load_programs(robot, CONFIG)[2]) if isinstance(step, MoveStep)
    ]
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
        5: "VEHICLE",
    }
    assert [program.name for program in load_emulator(robot, CONFIG).background] == ["DOCKWTCH"]
    moves = [step for step in steps_of(programs[3]) if isinstance(step, MoveStep)]
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
        (["rsr_programs", 1], "lower case", r"rsr_programs\[1\] = 'lower case'"),
        (["rsr_programs"], [], r"rsr_programs = \[\]: Expected `array` of length >= 1"),
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
    ("old", "new", "text"),
    [
        ("J3=      .000  mm", "J3= 1.0 mm", r"line 53: P\[3\]\.J3 = 1 mm: outside \[-210.0, 0.0\]"),
        ("J3=      .000  mm", "J3= 0.0 deg", r"P\[3\]\.J3 = 0 deg: joint_3 is in mm"),
        ("J1= -49.15770074", "J7= 5", r"P\[3\]\.J7: unknown, allowed are J1, J2, J3, J4, E1"),
        ("   GP1:", "   GP2:", r"line 37: P\[1\]\.GP2: the robot has motion group 1 alone"),
        ("P3] 50% FINE", "P3] 9% FINE Offset,PR[GP2:5]", r"line 6 of ARTICLE: .*: GP2: the robot"),
        ("11:  !", "11:  R[1]=PR[GP3:5,1] ;\n  12:  !", r"line 11 of ARTICLE: .*: GP3: the robot"),
        ("J1= -49.15770074 deg,", "", r"line 50: P\[3\]\.J1: is missing"),
        ("J1= -49.15770074", "J1= ********", r"line 53: P\[3\]\.J1: is missing"),
        ("J1= -49.15770074", "J1= 150.5", r"P\[3\]\.J1 = 150.5 deg: outside \[-148.0, 148.0\]"),
        ("P[3:P3] 50%", "P[4] 50%", r"line 6 of ARTICLE: .*P\[4\] is not taught, there are P\[1\]"),
        ("P[3:P3] 50%", "P[3] 101%", r"line 6 of ARTICLE: .*: a speed of 101 % is outside"),
        ("J P[3:P3] 50%", "L P[3] 50%", r"line 6 of ARTICLE: .*: the tool has no speed in %"),
        ("J P[3:P3]", "K P[3]", r"line 27: line 6 of the program: .*no instruction begins so"),
        ("PROG  ARTICLE", "PROG  OTHER", r"/PROG OTHER: a file has the name of its program"),
        ("10:  ENDFOR", "10:  END", r"ARTICLE.LS: line 3 of ARTICLE: FOR .*: has no end"),
        (
            "11:  !",
            "11:  JMP LBL[1] ;\n  12:  !",
            r"line 11 of ARTICLE: JMP LBL\[1\]: there is no LBL",
        ),
    ],
)
def test_a_wrong_program_is_refused(
    tmp_path: Path, robot: Robot, old: str, new: str, text: str
) -> None:
    """A position outside the range names file, line, joint, value and range."""
    folder = copy_configuration(tmp_path)
    article = ARTICLE.read_text()
    assert old in article
    (folder / "programs" / "ARTICLE.LS").write_text(article.replace(old, new))
    with pytest.raises(ConfigError, match=text):
        load_programs(robot, folder)


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["STREAM", "ARTICLE", "ARTICLE"], r"rsr_programs\[2\] = 'ARTICLE': is there twice"),
        (
            ["STREAM", "OTHER"],
            r"rsr_programs\[1\] = 'OTHER': unknown, allowed are ARTICLE, DOCKWTCH",
        ),
    ],
)
def test_a_number_starts_one_program_that_is_there(
    tmp_path: Path, robot: Robot, names: list[str], text: str
) -> None:
    """RSR2 starts one program only."""
    folder = copy_configuration(tmp_path)
    changed_yaml(folder / "emulator.yaml", folder, ["rsr_programs"], names)
    with pytest.raises(ConfigError, match=text):
        load_programs(robot, folder)


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["DOCKWTCH", "DOCKWTCH"], r"background_programs\[1\] = 'DOCKWTCH': is there twice"),
        (["ARTICLE"], r"background_programs\[0\] = 'ARTICLE': .* has a number in rsr_programs"),
        (["OTHER"], r"background_programs\[0\] = 'OTHER': unknown, allowed are ARTICLE, DOCKW"),
        (["MOVES"], r"background_programs\[0\] = 'MOVES': line 1 of MOVES: .*: background logic"),
    ],
)
def test_background_logic_is_one_program_that_is_there_and_can_run_so(
    tmp_path: Path, robot: Robot, names: list[str], text: str
) -> None:
    """Nothing starts it, so it has no number."""
    folder = copy_configuration(tmp_path)
    changed_yaml(folder / "emulator.yaml", folder, ["background_programs"], names)
    (folder / "programs" / "MOVES.LS").write_text("/PROG MOVES\n/MN\n 1: WAIT 1(sec) ;\n/END\n")
    with pytest.raises(ConfigError, match=text):
        load_emulator(robot, folder)


def test_a_program_without_a_number_is_read_all_the_same(tmp_path: Path, robot: Robot) -> None:
    """To be called, as the stream and background logic are not; small letters make no other one."""
    folder = copy_configuration(tmp_path)
    other = folder / "programs" / "other.LS"
    other.write_text(ARTICLE.read_text().replace("PROG  ARTICLE", "PROG  OTHER"))
    stream = ARTICLE.read_text().replace("PROG  ARTICLE", "PROG  RSR0101")
    (folder / "programs" / "RSR0101.LS").write_text(stream)
    numbered, library = load_library(robot, folder)
    assert set(numbered) == {2, 3, 4, 5}
    assert set(library) == {each.name for each in numbered.values()} | {"OTHER"}
    shutil.copy(ARTICLE, folder / "programs" / "article.LS")
    with pytest.raises(ConfigError, match=r"article\.LS: ARTICLE\.LS is there too; rename one"):
        load_programs(robot, folder)


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


@pytest.mark.parametrize(
    ("kind", "key", "low", "high"),
    [
        (EmulatorFile, "cold_start_override_percent", 1, 100),
        (EmulatorFile, "safety_speed_percent", 1, 100),
        (EmulatorFile, "heartbeat_timeout_ms", 10, 10_000),
        (EmulatorFile, "desk_heartbeat_timeout_ms", 10, 10_000),
        (EmulatorFile, "gripper_timeout_ms", 10, 10_000),
        (EmulatorFile, "start_wait_ms", 0, 10_000),
        (EmulatorFile, "rsr_programs", ["A"], ["A", "B"] * 4),
        (EmulatorFile, "rsr_programs", ["A"], ["ABCDEFGHIJKLMNOP"]),
        (EmulatorFile, "background_programs", ["A"], ["A"] * 7),
        (ControllerSettings, "shortest_pulse_ms", 0, 1000),
        (ControllerSettings, "num_modbus", 0, 16),
        (ControllerSettings, "rmt_master", 0, 3),
        (ControllerSettings, "job_base", 0, 9999),
        (ControllerSettings, "rsr", (101,) * 8, (101,) * 8),
    ],
)
def test_the_least_and_the_largest_are_taken_and_nothing_beyond(
    config: EmulatorConfig, kind: type, key: str, low: Any, high: Any
) -> None:
    """Of numbers, lists and names; one key more is refused too."""
    filed = config.settings if kind is ControllerSettings else config
    fields = {name: getattr(filed, name) for name in kind.__struct_fields__}
    for value in (low, high):
        assert getattr(convert({**fields, key: value}, kind), key) == value
    beyond = [low - 1, high + 1] if isinstance(low, int) else [low[1:], (*high, *high)]
    if key == "rsr_programs" and len(high) == 1:
        beyond = [[""], ["1A"], ["a"], ["_A"], ["A-B"], [high[0] + "Q"], ["A\n"]]
    if key == "background_programs":
        beyond = beyond[1:]
    for value in beyond:
        with pytest.raises(ValidationError, match=key):
            convert({**fields, key: value}, kind)
    with pytest.raises(ValidationError, match="strange"):
        convert({**fields, "strange": 1}, kind)
