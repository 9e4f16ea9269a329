"""An error in a profile that the doctor made is told once, at its line, with what to do."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest
from harness.workspace import ROOT
from robot_doctor.doctor_node import other_files
from robot_doctor.examine import examine
from robot_doctor.finding import Level
from robot_doctor.new_arm_io import make_arm
from robot_doctor.new_profile_io import make_scara
from robot_doctor.new_scara import ScaraSize
from robot_doctor.profile_files_io import place_of, read_profile
from scara_config.profile import CHOICE

SIX = ROOT / "src" / "scara_description" / "urdf" / "articulated_six.urdf"
MADE: dict[str, Callable[[Path], object]] = {
    "scara": lambda to: make_scara(
        to / "config", "mine", ScaraSize(325.0, 225.0, 150.0, 4, False), to
    ),
    "arm": lambda to: make_arm(to / "config", "mine", SIX, None, to),
}


class Error(NamedTuple):
    """In ``file`` of the robot the pattern ``old`` becomes ``new``; it is told in ``at``."""

    made: str
    file: str
    old: str
    new: str
    what: str
    remedy: str
    # The text on whose line it is told, if not ``new``.
    at: str = ""


def of_robot(made: str, old: str, new: str, what: str, remedy: str = "correct") -> Error:
    """Return an error of robot.yaml."""
    return Error(made, "robot.yaml", old, new, what, remedy)


URDF = "../../../mine.urdf"
ERRORS = {
    "reach": of_robot("scara", "geometry:", "reach_mm: 700\ngeometry:", "reach_mm = 700: Expected"),
    "axes": Error(
        "scara",
        "robot.yaml",
        "axis_number: 4",
        "axis_number: 3",
        "axis_number 3 occurs more",
        "correct",
        "axis_number: 3\n    twin: true\n    lower_deg",
    ),
    "uop": Error(
        "scara", "robot.yaml", "uop: full", "uop: simple", "uop is simple", "correct", "imstp:"
    ),
    "home": of_robot(
        "scara", "joint_3: -112.5", "joint_3: 112.5", "home.joint_3 = 112.5: Expected"
    ),
    "zone": of_robot(
        "scara", r"lower_mm: \[220", "lower_mm: [920", "keep_out.below_tool: lower_mm is"
    ),
    "body": Error(
        "scara",
        "body.yaml",
        "joint: joint_4",
        "joint: joint_5",
        r"links\[4\].joint = joint_5: no joint of the twin",
        "correct",
    ),
    "field plant": Error(
        "scara",
        "plants/field.yaml",
        "  joint_4:",
        "  joint_7:",
        "axes.joint_4: is missing",
        "correct",
        "axes:",
    ),
    "program": Error(
        "scara",
        "programs/ARTICLE.LS",
        r"J1= -10.\d+ deg",
        "J1= 190.0 deg",
        r"P\[2\].J1 = 190 deg: outside",
        "deg for a turning joint",
        'P[2:"P2"]{',
    ),
    "limit": of_robot(
        "arm",
        "upper_deg: 170",
        "upper_deg: 175",
        "joint_1: upper 175 deg is beyond",
        "`upper_deg: 170`",
    ),
    "effort": of_robot("arm", "effort: 250", "effort: 260", "joint_2: effort 260", "`effort: 250`"),
    "frame": of_robot(
        "arm",
        "base_frame: base_link",
        "base_frame: base",
        "base_frame = base: the URDF begins with base_link",
        "`base_frame: base_link`",
    ),
    "tool": of_robot(
        "arm", "tool_frame: tool0", "tool_frame: tool", "it has no link tool", "name a link of it"
    ),
    "far too short": of_robot("arm", r"reach_mm: \d+", "reach_mm: 1", "reach_mm = 1.999: Expected"),
    "inertia": Error(
        "arm",
        URDF,
        r'(?s)(<link name="link_3">.*?ixx=")[^"]*',
        r"\g<1>0.9",
        "link link_3: the inertia of",
        "write_inertia",
        '<link name="link_3">',
    ),
    "no number": Error(
        "arm",
        URDF,
        r'(?s)(<link name="link_3">.*?ixx=")[^"]*',
        r"\g<1>0,05",
        "link link_3: its inertial or a collision shape cannot be read: .*'0,05'",
        "correct .*mine.urdf",
        '<link name="link_3">',
    ),
    "no length": Error(
        "arm",
        URDF,
        r'(?s)(<link name="link_3">.*?<collision>.*?radius=")[^"]*',
        r"\g<1>0,05",
        "link link_3: <cylinder> has radius = '0,05': expected 1 finite number",
        "correct .*mine.urdf",
        '<link name="link_3">',
    ),
    "mass": Error(
        "arm",
        URDF,
        r'(?s)(<link name="link_3">.*?)<mass [^>]*>',
        r"\1",
        "link link_3 has no mass",
        "give it an inertial",
        '<link name="link_3">',
    ),
    "no body": Error(
        "arm",
        URDF,
        r'(?s)(<link name="link_3">).*?(<inertial>)',
        r"\1\2",
        "no <collision> of what joint_3 moves",
        "correct",
        '<joint name="joint_3"',
    ),
    "start": Error(
        "arm",
        "emulator.yaml",
        "joint_6_deg",
        "joint_7_deg",
        "start_position.joint_7_deg = .*: unknown",
        "correct",
    ),
    "load": Error(
        "arm", "payloads.yaml", r"rated_kg: [0-9.]+", "rated_kg: -1", "rated_kg = -1", "correct"
    ),
}
"""By what is wrong."""


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Make a profile of each kind in a copy of the configuration; its URDF stands beside it."""
    found = {}
    for kind, make in MADE.items():
        found[kind] = tmp_path_factory.mktemp(kind)
        shutil.copytree(ROOT / "config", found[kind] / "config")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("scara_config.robot.description_path", found[kind].joinpath)
            patch.setenv(CHOICE, "mine")
            make(found[kind])
    return found


@pytest.mark.parametrize("name", ERRORS)
def test_an_error_is_told_once_at_its_line(
    folders: dict[str, Path], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing else is told: what follows from it, or is said of it elsewhere, is left out."""
    error = ERRORS[name]
    monkeypatch.setattr("scara_config.robot.description_path", folders[error.made].joinpath)
    monkeypatch.setenv(CHOICE, "mine")
    config = folders[error.made] / "config"
    path = config / "robots" / "mine" / error.file
    before = path.read_text()
    text, count = re.subn(error.old, error.new, before, count=1)
    assert count == 1
    path.write_text(text)
    try:
        profile = read_profile(config)
        found = list(examine(profile))
        found += other_files(config, profile, found)
        told = [f for f in found if f.level is Level.WRONG]
        assert len(told) == 1, told
        assert re.search(error.what, told[0].what), told[0].what
        assert re.search(error.remedy, told[0].advice), told[0].advice
        at = place_of(told[0], config, profile.robot)
    finally:
        path.write_text(before)
    row = text[: text.index(error.at or error.new)].count("\n") + 1
    assert at == f"{path.resolve()}:{row}"
