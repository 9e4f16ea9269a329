"""The doctor finds what is wrong with a profile, says where, and what to do."""

from __future__ import annotations

import math
import re
import shutil
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from harness.workspace import ROOT
from harness.yaml_files import REMOVED, changed_yaml, copy_configuration
from robot_doctor.examine import examine, next_command
from robot_doctor.finding import Finding, Group, Level
from robot_doctor.link_checks import Answer, Nudge, check_answers, check_nudge
from robot_doctor.profile_files_io import read_profile
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map
from twin_controller.config import load_twin_controller

CONFIG = ROOT / "config"
ROBOT = load_robot(CONFIG)
LAYOUT = load_modbus_map(CONFIG)
CONTROLLER = load_twin_controller(ROBOT, CONFIG)
PROFILE, MAP = "robot.yaml", "modbus_map.yaml"
ROBOTS, REGISTERS, SIMULATION = Group.ROBOT, Group.REGISTERS, Group.SIMULATION
SWAPPED = msgspec.structs.replace(LAYOUT, word_order="high_first")


def wrongs(findings: Any) -> list[Finding]:
    """Return what is wrong."""
    return [finding for finding in findings if finding.level is Level.WRONG]


@pytest.mark.parametrize(
    ("file", "path", "value", "group", "text"),
    [
        (PROFILE, "geometry.h_mm", 0.0, SIMULATION, r"geometry.h_mm = 0: the arm of .* has 160"),
        (PROFILE, "joints.4.axis_number", 4, ROBOTS, "axis_number 4 occurs more than once"),
        (MAP, "holding_registers.velocity.address", 11015, REGISTERS, "overlaps"),
        (MAP, "holding_registers.position.type", "string", REGISTERS, "position is a text"),
        ("pid_gains.yaml", "joint_3", REMOVED, SIMULATION, "pid_gains.yaml: joint_3 is missing"),
    ],
)
def test_a_planted_error_stands_in_its_group(
    tmp_path: Path, file: str, path: str, value: Any, group: Group, text: str
) -> None:
    """What is told of each, and where, is judged by test_forty_errors."""
    folder = copy_configuration(tmp_path)
    keys: list[str | int] = [int(key) if key.isdigit() else key for key in path.split(".")]
    changed_yaml(folder / file, (folder / file).parent, keys, value)
    found = wrongs(examine(read_profile(folder)))
    assert all(finding.advice for finding in found)
    assert any(finding.group is group and re.search(text, finding.what) for finding in found), found


@pytest.mark.parametrize("file", ["robot.yaml", "modbus_map.yaml", "pid_gains.yaml"])
def test_a_missing_file_is_to_be_written_where_the_robot_has_its_own(
    tmp_path: Path, file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A new robot's folder lacks files at first; nothing is there yet that could be corrected."""
    shutil.copytree(CONFIG, tmp_path / "config")
    own = tmp_path / "config" / "robots" / ROBOT.name / file
    own.unlink()
    (finding,) = wrongs(
        item for item in examine(read_profile(tmp_path / "config")) if file in item.advice
    )
    assert str(own) in finding.what
    assert finding.advice.startswith(f"write {own}:")


def float_words(values: list[float]) -> list[int]:
    """Return float32 words, low word first."""
    return list(struct.unpack(f"<{2 * len(values)}H", struct.pack(f"<{len(values)}f", *values)))


SIGNALS = (True, True) + (False,) * (max(b.address for b in LAYOUT.discrete_inputs.values()) - 6002)
"""CMDENBL and SYSRDY, and all others off."""


def answers(rate: float = 1.0, **changed: Any) -> list[Answer]:
    """Return two seconds of answers of a robot at home whose clock runs at ``rate``."""
    found = []
    for k in range(200):
        now = 50.0 + 0.01 * k
        clock = 1_000_000 + round(10.0 * k * rate)
        # The motor torques stand in front.
        words = float_words([0.0] * 9)
        words += float_words(changed.get("position", [0.0, 0.0, -160.0, 0.0, 0.0, 0, 0, 0, 0]))
        words += [1, clock & 0xFFFF, clock >> 16]
        words += float_words([0.0] * 9) + [0, 0, 0, 0, 100, 0, 0, 1, 1]
        found.append(Answer(now, now + changed.get("trip", 0.0005), tuple(words), SIGNALS))
    return found


@pytest.mark.parametrize("absent", [0.0, 1e-30, math.nan])
def test_answers_of_a_healthy_robot_are_fine(absent: float) -> None:
    """Round trip, rate, clock and renewal; an axis that is not there may read anything small."""
    given = answers(position=[0.0, 0.0, -160.0, 0.0, 0.0, absent, 0, 0, 0])
    found = list(check_answers(ROBOT, LAYOUT, given, CONTROLLER))
    assert [finding.level for finding in found] == [Level.FINE] * 3
    assert "100 answers a second" in found[0].what and "rate 1.0" in found[1].what


@pytest.mark.parametrize("late", [0, 66, 199], ids=["the first", "one between", "the last"])
def test_one_late_answer_does_not_make_a_clock_wrong(late: int) -> None:
    """A machine that stops for a moment is no fault of the robot."""
    given = answers()
    sent, received = given[late].sent, given[late].received + 0.1
    given[late] = msgspec.structs.replace(given[late], sent=sent, received=received)
    found = list(check_answers(ROBOT, LAYOUT, given, CONTROLLER))
    assert [finding.level for finding in found] == [Level.FINE] * 3, found
    assert "rate 1.00000" in found[1].what


@pytest.mark.parametrize(
    ("change", "text", "advice"),
    [
        (lambda: (SWAPPED, answers()), "with low_first it runs", "word_order: low"),
        (lambda: (LAYOUT, answers(rate=0.001)), "clock runs 0.000", "in ms"),
        (lambda: (LAYOUT, answers(rate=0.0)), "clock does not run", "in ms"),
        (
            lambda: (LAYOUT, answers(position=[0.0, 0.0, 160.0] + [0.0] * 6)),
            "joint_3 = 160.0 mm is outside",
            "correct scale",
        ),
        (
            lambda: (LAYOUT, answers(position=[0.0, 0.0, -160.0, 0.0, 0.0, -98.26, 0, 0, 0])),
            "axis 6 reads -98.26 and robot.yaml has no joint of it",
            "twin: false",
        ),
        (lambda: (LAYOUT, answers(trip=0.2)), "round trip 200.00 ms", "real.timeout_ms = 70"),
    ],
    ids=["word order", "clock in s", "clock stands", "wrong sign", "an axis", "slow network"],
)
def test_a_wrong_link_is_found(change: Callable[[], Any], text: str, advice: str) -> None:
    """What only the robot's answers show."""
    layout, given = change()
    found = wrongs(check_answers(ROBOT, layout, given, CONTROLLER))
    assert any(text in finding.what and advice in finding.advice for finding in found), found


@pytest.mark.parametrize(
    ("moved", "speed", "text"),
    [
        ({"joint_1": 0.0087}, 0.02, ""),
        ({"joint_1": -0.0087}, -0.02, "opposite signs"),
        ({"joint_1": 0.0}, 0.0, "does not follow"),
        ({"joint_1": 0.5}, 1.0, "different units"),
        ({"joint_1": 0.0, "joint_2": 0.0087}, 0.0, "axis_number"),
        ({"joint_1": 0.0087}, -0.02, "sign of velocity"),
    ],
)
def test_a_joint_that_goes_elsewhere_is_found(
    moved: dict[str, float], speed: float, text: str
) -> None:
    """Sign, unit, axis and speed of a hair's way."""
    still = dict.fromkeys([joint.name for joint in ROBOT.twin_joints], 0.0)
    finding = check_nudge(Nudge("joint_1", 0.00873, {**still, **moved}, speed), ROBOT.twin_joints)
    assert (finding.level is Level.FINE) == (text == "") and text in finding.advice


@pytest.mark.parametrize(
    ("real", "options", "words"),
    [
        ("127.0.0.1", {}, "./cell demo --robot mine"),
        ("localhost", {"offline": True}, "./cell demo --robot mine"),
        ("192.0.2.9", {}, "./cell up --robot mine --without emulator"),
        ("192.0.2.9", {"host": "127.0.0.1"}, "./cell up --robot mine --without emulator"),
        ("127.0.0.1", {"host": "192.0.2.9"}, "./cell up --robot mine --without emulator"),
    ],
)
def test_a_real_robot_is_followed_by_no_demo(
    real: str, options: dict[str, Any], words: str
) -> None:
    """It begins with the stand-in's pendant, and would lead the real robot by it."""
    assert next_command("mine", True, real, **options) == words


def test_what_was_wrong_is_asked_again_of_the_same_robot() -> None:
    """With the address that was given."""
    again = next_command("mine", False, "", host="192.0.2.9", port=502)
    assert again.endswith("doctor --robot mine --host 192.0.2.9 --port 502")
    assert next_command("mine", False, "", offline=True).endswith("--robot mine --offline")
