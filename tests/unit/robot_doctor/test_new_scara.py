"""A SCARA from three numbers: the doctor finds nothing, and what follows from them is right."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from fanuc_emulator.config import load_emulator, load_programs
from harness.any_scara import any_size
from harness.running.thorough import thorough
from harness.workspace import ROOT
from robot_doctor.examine import examine
from robot_doctor.finding import Level
from robot_doctor.new_profile_io import make_scara
from robot_doctor.new_scara import ScaraSize
from robot_doctor.profile_files_io import read_profile
from scara_config import ConfigError, load_robot
from scara_config.profile import CHOICE
from scara_config.readers import check_files
from scara_control.keep_out.points import watched_points
from scara_control.kinematics.tool import tool_kinematics


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give a copy of the whole configuration; URDFs stand beside it."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    monkeypatch.setattr("scara_config.robot.description_path", tmp_path.joinpath)
    monkeypatch.setenv(CHOICE, "mine")
    return tmp_path / "config"


@pytest.mark.parametrize("seed", [*range(3), *thorough(*range(3, 20))])
def test_a_scara_of_any_lengths_is_healthy(config: Path, tmp_path: Path, seed: int) -> None:
    """Three or four axes, with or without table, joint 3 up or down: nothing to correct."""
    size = any_size(seed)
    make_scara(config, "mine", size, tmp_path)
    told = [f for f in examine(read_profile(config)) if f.level is not Level.FINE]
    assert (told, check_files(config)) == ([], []), size
    robot = load_robot(config)
    assert robot.reach_mm == size.l1_mm + size.l2_mm
    assert [joint.name for joint in robot.twin_joints] == size.joints
    assert len(load_emulator(robot, config).plant.axes) == len(size.joints)
    tool = tool_kinematics(robot)
    up, low = (0.0, size.stroke_mm) if size.down else (0.0, -size.stroke_mm)
    q = [0.3, -0.7, up * 1e-3, 0.4][: size.axes]
    high = np.array(tool.position(q))
    q[2] = low * 1e-3
    assert high - np.array(tool.position(q)) == pytest.approx([0.0, 0.0, size.stroke_mm * 1e-3])
    assert watched_points(robot)[1].name == "elbow"
    fall = 0.5 * robot.twin_joints[2].velocity * robot.stopping.braking_delay_ms * 1e-3
    p1, (zone,) = robot.positions_m["P1"], robot.keep_out
    assert p1[2] - 1e-3 * zone.upper_mm[2] >= fall - 1e-9, "a stop at half speed ends above it"


def test_one_with_two_tables_turns_both(config: Path, tmp_path: Path) -> None:
    """The second is another axis of plants, gains, start and programs, and stands beside."""
    make_scara(config, "mine", ScaraSize(325.0, 225.0, 150.0, 4, 2), tmp_path)
    told = [f for f in examine(read_profile(config)) if f.level is not Level.FINE]
    assert (told, check_files(config)) == ([], [])
    robot = load_robot(config)
    assert [joint.name for joint in robot.joints][4:] == ["table_joint", "table_2_joint"]
    text = (config / "robots" / "mine" / "programs" / "TWO_POINT.LS").read_text()
    assert len(re.findall(r"E[12]= +60.000 deg", text)) == 2
    axes = load_emulator(robot, config, "field").plant.axes
    assert axes["table_joint"] == axes["table_2_joint"]


def test_its_programs_turn_the_elbow_one_way(config: Path, tmp_path: Path) -> None:
    """From P2 to P3 the arm does not turn over, and the tool gets to all of them."""
    make_scara(config, "mine", ScaraSize(325.0, 225.0, 150.0, 4, False), tmp_path)
    robot = load_robot(config)
    steps = {program.name: program for program in load_programs(robot, config).values()}
    assert {"ARTICLE", "TWO_POINT"} <= set(steps)
    text = (config / "robots" / "mine" / "programs" / "ARTICLE.LS").read_text()
    assert "J2= 72.349144964 deg" in text and "J2=-" not in text and "E1" not in text


@pytest.mark.parametrize(
    ("name", "size", "text"),
    [
        ("mine", ScaraSize(500.0, 40.0, 150.0), "mine was not made: .* outside the reach"),
        ("mine", ScaraSize(5.0, 200.0, 150.0), "mine was not made: .*l1_mm = 5: Expected"),
        ("fanuc_sr3ia", ScaraSize(325.0, 225.0, 150.0), "is there already"),
        ("My", ScaraSize(325.0, 225.0, 150.0), "is no name for a robot"),
    ],
)
def test_one_that_cannot_be_is_not_made(
    config: Path, tmp_path: Path, name: str, size: ScaraSize, text: str
) -> None:
    """The text says why, and nothing is left behind."""
    before = sorted(config.rglob("*"))
    with pytest.raises(ConfigError, match=text):
        make_scara(config, name, size, tmp_path)
    assert sorted(config.rglob("*")) == before


def test_a_urdf_that_is_there_is_kept_and_a_new_one_goes_with_its_robot(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whichever of them is in the way, or fails: nothing is made."""
    size, urdf = ScaraSize(325.0, 225.0, 150.0), tmp_path / "mine.urdf"
    urdf.write_text("somebody's")
    with pytest.raises(ConfigError, match=r"mine\.urdf is there already"):
        make_scara(config, "mine", size, tmp_path)
    assert urdf.read_text() == "somebody's"
    urdf.unlink()
    monkeypatch.setattr("robot_doctor.new_profile_io.print_program", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        make_scara(config, "mine", size, tmp_path)
    assert not urdf.exists() and not (config / "robots" / "mine").exists()
