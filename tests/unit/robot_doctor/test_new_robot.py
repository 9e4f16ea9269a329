"""A new robot begins as another one under its own name, and the doctor finds it healthy."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from harness.workspace import ROOT
from robot_doctor.doctor_node import app, other_files
from robot_doctor.examine import examine
from robot_doctor.finding import Level, is_healthy
from robot_doctor.new_profile_io import make_profile, new_folder
from robot_doctor.profile_files_io import place_of, read_profile
from scara_config import ConfigError, load_robot
from scara_config.profile import CHOICE
from scara_config.readers import check_files
from scara_config.writer import Noted, write_values
from typer.testing import CliRunner


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
    if source == "articulated_six":
        monkeypatch.setattr("scara_config.robot.description_path", tmp_path.joinpath)
    robot = load_robot(config)
    assert robot.name == "mine" and check_files(config) == []
    own_urdf = tmp_path / robot.urdf
    if source == "articulated_six":
        assert robot.urdf == "mine.urdf" and '<robot name="mine"' in own_urdf.read_text()
        assert source not in (folder / "robot.yaml").read_text()
    else:
        assert not own_urdf.exists(), "one that is shared stays where it is"
        assert is_healthy(examine(read_profile(config)))


def test_a_stop_that_was_tried_on_another_robot_is_not_copied(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A new robot may come to stand at the address of the old one."""
    path = config / "robots" / "articulated_six" / "robot.yaml"
    tried = ("stopping", "tried", "hold"), ("stopping", "braking_delay_ms")
    write_values(path, {tried[0]: Noted("192.168.1.10", "[chk] seen"), tried[1]: 60})
    folder = make_profile(config, "mine", "articulated_six", tmp_path)
    monkeypatch.setenv(CHOICE, "mine")
    stopping = load_robot(config).stopping
    assert set(stopping.tried.values()) == {"127.0.0.1"} and stopping.braking_delay_ms == 100.0
    assert "192.168.1.10" not in (folder / "robot.yaml").read_text()


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


def test_each_finding_of_another_arm_names_its_file_and_the_next_command(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joint 2 moves 50 mm up, and P1 goes elsewhere: what was copied does not fit any more."""
    monkeypatch.setenv(CHOICE, "articulated_six")
    own = config / "robots" / "articulated_six"
    text = (own / "robot.yaml").read_text()
    text = text.replace("screw_axis: [0, 1, 0, -0.3, 0, 0]", "screw_axis: [0, 1, 0, -0.35, 0, 0]")
    text = text.replace("velocity_deg_s: 250.0", "velocity_deg_s: 180.0")
    (own / "robot.yaml").write_text(text.replace("P1: [0.40, 0.0, 0.24]", "P1: [0.38, 0.0, 0.26]"))
    wrong = {f.what: f.advice for f in examine(read_profile(config)) if f.level is Level.WRONG}
    told = {
        "articulated_six.urdf was written from another": "rosrun scara_description write_urdf",
        "joint_2: screw_axis": f"{own}/body.yaml: at_mm of the link that it moves",
        "ARTICLE.LS: P[1:P1] brings the tool to": f"correct {own}/programs/ARTICLE.LS: ",
    }
    for what, advice in told.items():
        (found,) = [wrong[each] for each in wrong if each.startswith(what)]
        assert advice in found
    urdf = [advice for what, advice in wrong.items() if "URDF" in what]
    assert urdf and all(
        text.endswith("rosrun scara_description write_urdf articulated_six") for text in urdf
    )


def test_a_folder_that_was_broken_off_is_gone(config: Path) -> None:
    """Whatever ended the making, a person at the keyboard too."""
    with pytest.raises(KeyboardInterrupt), new_folder(config, "other", "articulated_six"):
        raise KeyboardInterrupt
    assert not (config / "robots" / "other").exists()


def test_a_cartesian_position_may_have_a_set_positions_name(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where it is only the controller's frames say: it is not held against robot.yaml."""
    monkeypatch.setenv(CHOICE, "articulated_six")
    program = config / "robots" / "articulated_six" / "programs" / "ARTICLE.LS"
    frames = "UF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
    place = "\tX= 400 mm, Y= 0 mm, Z= 240 mm,\n\tW= 180 deg, P= 0 deg, R= 0 deg\n};"
    before, _, rest = program.read_text().partition('P[1:"P1"]{')
    program.write_text(f'{before}P[1:"P1"]{{\n   GP1:\n\t{frames}{place}{rest.partition("};")[2]}')
    assert is_healthy(examine(read_profile(config)))


def test_a_profile_without_joints_is_told_once_at_its_line(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What hangs on joints is checked once there are some."""
    monkeypatch.setenv(CHOICE, "scara_4axis")
    path = config / "robots" / "scara_4axis" / "robot.yaml"
    path.write_text(f"{path.read_text().partition('joints:')[0]}joints: []\n")
    profile = read_profile(config)
    found = list(examine(profile))
    found += other_files(config, profile, found)
    (wrong,) = [f for f in found if f.level is Level.WRONG]
    assert "joints: no joint moves the tool" in wrong.what and wrong.advice.startswith("correct")
    row = path.read_text().partition("joints:")[0].count("\n") + 1
    assert place_of(wrong, config, profile.robot) == f"{path}:{row}"


def test_a_program_that_moves_nothing_is_named(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """TWO_POINT with both places at one: it may be meant."""
    monkeypatch.setenv(CHOICE, "scara_4axis")
    program = config / "robots" / "scara_4axis" / "programs" / "TWO_POINT.LS"
    text, row = program.read_text(), r"(?s)(?<=\"){0}\"\]{{.*?}};"
    first = re.search(row.format("A"), text)
    assert first is not None
    program.write_text(re.sub(row.format("B"), first[0].replace("A", "B", 1), text))
    (told,) = [f for f in examine(read_profile(config)) if f.level is not Level.FINE]
    assert told.level is Level.NOTE
    assert told.what == "TWO_POINT.LS: P[1:A] and P[2:B] are one place: it moves nothing"


def test_a_urdf_and_lengths_at_once_are_refused(config: Path, tmp_path: Path) -> None:
    """One of them would be left out without a word."""
    urdf = ROOT / "src" / "scara_description" / "urdf" / "articulated_six.urdf"
    said = ["new", "mine", "--urdf", str(urdf), "--scara", "325", "225"]
    done = CliRunner().invoke(app, [*said, "--config-dir", str(config)])
    assert done.exit_code == 2 and "--urdf and --scara: give one of them" in done.output
    assert not (config / "robots" / "mine").exists()


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (None, "articulated_six.urdf: cannot be read: No such file or directory"),
        (b"<robot name='\xff'/>", r"articulated_six.urdf: is not in UTF-8: byte 0xff \(line 1\)"),
    ],
)
def test_a_urdf_that_cannot_be_read_is_told(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes | None, told: str
) -> None:
    """As every other file, once and with what to do."""
    monkeypatch.setenv(CHOICE, "articulated_six")
    monkeypatch.setattr("scara_config.robot.description_path", tmp_path.joinpath)
    (config / "robots" / "articulated_six" / "body.yaml").unlink()
    if content is not None:
        (tmp_path / "articulated_six.urdf").write_bytes(content)
    profile = read_profile(config)
    found = list(examine(profile))
    found += other_files(config, profile, found)
    (wrong,) = [f for f in found if f.level is Level.WRONG]
    assert re.search(told, wrong.what) and wrong.advice
    place_of(wrong, config, profile.robot)


def test_the_joint_values_that_the_doctor_gives_are_right(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever types them into the program has no finding left."""
    monkeypatch.setenv(CHOICE, "articulated_six")
    own = config / "robots" / "articulated_six"
    robot, program = own / "robot.yaml", own / "programs" / "ARTICLE.LS"
    moved = robot.read_text().replace("P2: [0.34, 0.18, 0.32]", "P2: [0.30, 0.21, 0.35]")
    robot.write_text(moved)
    (found,) = [f for f in examine(read_profile(config)) if f.level is Level.WRONG]
    values = found.advice.partition("gets there with ")[2]
    text, begin = program.read_text(), 'P[2:"P2"]{\n   GP1:\n\tUF : 0, UT : 1,\t\n'
    before, _, rest = text.partition(begin)
    program.write_text(f"{before}{begin}\t{values}\n}};{rest.partition('};')[2]}")
    assert is_healthy(examine(read_profile(config)))
