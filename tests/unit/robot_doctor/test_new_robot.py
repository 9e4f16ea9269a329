"""A new robot begins as another one under its own name, and the doctor finds it healthy."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from harness.workspace import ROOT
from robot_doctor.examine import examine
from robot_doctor.finding import is_healthy
from robot_doctor.io.new_profile import make_profile
from robot_doctor.io.profile_files import read_profile
from scara_config import ConfigError, load_robot
from scara_config.profile import CHOICE
from scara_config.readers import check_files


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """Give a copy of the whole configuration."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    return tmp_path / "config"


@pytest.mark.parametrize("source", ["articulated_six", "fanuc_sr6ia"])
def test_a_new_robot_is_healthy_under_its_own_name(
    config: Path, tmp_path: Path, source: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever changes it from there sees at each step what the last change broke."""
    folder = make_profile(config, "mine", source, tmp_path)
    assert folder == config / "robots" / "mine"
    monkeypatch.setenv(CHOICE, "mine")
    robot = load_robot(config)
    assert robot.name == "mine" and check_files(config) == []
    own_urdf = tmp_path / robot.urdf
    if source == "articulated_six":
        assert robot.urdf == "mine.urdf" and '<robot name="mine"' in own_urdf.read_text()
        assert source not in (folder / "robot.yaml").read_text()
    else:
        assert not own_urdf.exists(), "one that is shared stays where it is"
        assert is_healthy(examine(read_profile(config)))


@pytest.mark.parametrize(
    ("name", "source", "text"),
    [
        ("fanuc_sr3ia", "articulated_six", "is there already"),
        ("My Robot", "articulated_six", "'My Robot' is no name for a robot"),
        ("../mine", "articulated_six", "is no name for a robot"),
        ("mine", "articulated_sx", "has articulated_six, .*did you mean articulated_six"),
    ],
)
def test_a_name_that_cannot_be_is_refused(
    config: Path, tmp_path: Path, name: str, source: str, text: str
) -> None:
    """And nothing is made."""
    before = sorted(config.rglob("*"))
    with pytest.raises(ConfigError, match=text):
        make_profile(config, name, source, tmp_path)
    assert sorted(config.rglob("*")) == before


def test_half_a_robot_is_not_left_behind(config: Path, tmp_path: Path) -> None:
    """Its source has a fault: the text says which, and the folder is gone again."""
    (config / "robots" / "articulated_six" / "robot.yaml").write_text("name: 5\n")
    with pytest.raises(ConfigError, match=r"mine was not made: .*robot\.yaml"):
        make_profile(config, "mine", "articulated_six", tmp_path)
    assert not (config / "robots" / "mine").exists()
