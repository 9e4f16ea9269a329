"""Each of 40 planted errors is named with its file, line and remedy, alone and all in one round."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import NamedTuple

import pytest
from harness.workspace import ROOT
from robot_doctor.doctor_node import other_files
from robot_doctor.examine import examine
from robot_doctor.finding import Finding, Level
from robot_doctor.profile_files_io import place_of, read_profile
from scara_config.profile import CHOICE

BIG, SMALL = "fanuc_sr6ia", "fanuc_sr3ia"
"""One whose URDF a person writes, and one with a body.yaml."""


class Planted(NamedTuple):
    """An error: in the robot's ``file`` the first ``old`` becomes ``new``."""

    robot: str
    file: str
    old: str
    new: str
    # What the doctor says of it, and what to do.
    what: str
    remedy: str
    # Where it is told, if not at the first changed line: file and text.
    there: tuple[str, str] = ("", "")


def robot(old: str, new: str, what: str, remedy: str, there: str = "", name: str = BIG) -> Planted:
    """Return an error of robot.yaml."""
    return Planted(
        name, "robot.yaml", old, new, what, remedy, ("robot.yaml" if there else "", there)
    )


def register(old: str, new: str, what: str, remedy: str, there: str = "") -> Planted:
    """Return an error of modbus_map.yaml."""
    place = ("modbus_map.yaml" if there else "", there)
    return Planted(BIG, "modbus_map.yaml", old, new, what, remedy, place)


J1, J2, J3 = (f"  - name: joint_{number}\n" for number in (1, 2, 3))
TABLE = "  - name: table_joint\n"
GEOMETRY = "geometry:                  #"
ARTICLE = "programs/ARTICLE.LS"
PROGRAM = (ARTICLE, 'P[3:"P3"]{')
FORTY = {
    "l1": robot(
        "l1_mm: 350.0", "l1_mm: 340.0", r"geometry.l1_mm = 340: .* has 350", "`l1_mm: 350`"
    ),
    "l2": robot(
        "l2_mm: 300.0", "l2_mm: 325.0", r"geometry.l2_mm = 325: .* has 300", "`l2_mm: 300`"
    ),
    "h": robot("h_mm: 160.0", "h_mm: 150.0", r"geometry.h_mm = 150: .* has 160", "`h_mm: 160`"),
    "reach": robot(GEOMETRY, f"reach_mm: 700.0\n{GEOMETRY}", "reach_mm = 700: Expected", "correct"),
    "home pose": robot(
        GEOMETRY,
        f"home_pose: [[0, -1, 0, 0.55], [-1, 0, 0, 0], [0, 0, -1, 0.16], [0, 0, 0, 1]]\n{GEOMETRY}",
        r"home_pose: 200 mm from the axis before: Expected geometry.l2_mm = 300",
        "correct",
    ),
    "axis": robot(
        J2,
        f"{J2}    screw_axis: [0, 0, 1, 0, -0.33, 0]\n",
        r"joints.joint_2.screw_axis: 330 mm from the axis before: Expected geometry.l1_mm",
        "correct",
        "screw_axis: [0, 0, 1, 0, -0.33",
    ),
    "no unit vector": robot(
        J1,
        f"{J1}    screw_axis: [0, 0, 10, 0, 0, 0]\n",
        "Expected a unit omega",
        "correct",
        "[0, 0, 10",
    ),
    "sign of joint 3": robot(
        J3,
        f"{J3}    screw_axis: [0, 0, 0, 0, 0, -1]\n",
        "joint_3: the sign of its axis is the opposite of the URDF's",
        "jog the real joint by a positive value",
        "0, -1]",
    ),
    "sign of joint 1": robot(
        J1,
        f"{J1}    screw_axis: [0, 0, -1, 0, 0, 0]\n",
        "joint_1: the sign of its axis is the opposite of the URDF's",
        "jog the real joint by a positive value",
        "[0, 0, -1, 0, 0, 0]",
    ),
    "inertia": robot(
        J1, f"{J1}    inertia: 1.15\n", "unknown field `inertia`", "delete it from", "inertia: 1.15"
    ),
    "points": robot(
        "keep_out:",
        "watched_points: []\nkeep_out:",
        "unknown field `watched_points`",
        "delete it from",
    ),
    "P2 out of reach": robot(
        "P2: [0.51, 0.16,", "P2: [0.61, 0.36,", r"positions_m\.P2: .*outside the reach", "move the"
    ),
    "P3 elsewhere": Planted(
        BIG,
        "robot.yaml",
        "P3: [0.51, -0.16,",
        "P3: [0.49, -0.16,",
        r"ARTICLE.LS: P\[3:P3\] brings the tool to .* 20.0 mm from positions_m.P3",
        r"with J1= .* deg, J2= .* deg, J3= .* mm",
        PROGRAM,
    ),
    "program beyond": Planted(
        BIG,
        ARTICLE,
        "J1= -49.15770074",
        "J1= 190.0",
        r"ARTICLE.LS: P\[3\]\.J1 = 190 deg: outside",
        "deg for a turning joint",
        PROGRAM,
    ),
    "program elsewhere": Planted(
        BIG,
        ARTICLE,
        "J1= -49.15770074",
        "J1= -39.15770074",
        r"ARTICLE.LS: P\[3:P3\] brings the tool to",
        "with J1= ",
        PROGRAM,
    ),
    "no line": Planted(BIG, ARTICLE, "  ENDFOR", "  ENDLESS", "line 10 of the program", "correct"),
    "home beyond": robot(
        "joint_3: -160.0, table",
        "joint_3: 160.0, table",
        "home.joint_3 = 160: Expected",
        "correct",
    ),
    "home missing": robot("{joint_1: 0.0, ", "{", "home.joint_1: is missing", "correct"),
    "zone": robot(
        "lower_mm: [250.0,",
        "lower_mm: [950.0,",
        "keep_out.below_table: lower_mm is not below",
        "correct",
    ),
    "upper": robot(
        "upper_deg: 148.0", "upper_deg: 170.0", "joint_1: upper 170 .* 148", "`upper_deg: 148`"
    ),
    "lower": robot(
        "lower_deg: -150.0", "lower_deg: -120.0", "joint_2: lower -120 .* -150", "`lower_deg: -150`"
    ),
    "stroke": robot(
        "lower_mm: -210.0", "lower_mm: -310.0", "joint_3: lower -310 .* -210", "`lower_mm: -210`"
    ),
    "turned round": robot(
        "upper_deg: 148.0",
        "upper_deg: -149.0",
        "joints.joint_1: lower limit is not below",
        "correct",
        J1,
    ),
    "radians": robot(
        "lower_deg: -148.0      # [asm]\n    upper_deg: 148.0       # [asm]\n"
        "    velocity_deg_s: 440.0",
        "lower_deg: -2.58\n    upper_deg: 2.58\n    velocity_deg_s: 7.68",
        r"joint_1: limits \[-2.58, 2.58\] deg at 7.68 deg/s look like rad",
        "lower_deg: -147.8",
    ),
    "speed": robot(
        "velocity_deg_s: 700.0",
        "velocity_deg_s: 900.0",
        "joint_2: velocity 900",
        "`velocity_deg_s: 700`",
    ),
    "effort": robot("effort: 120.0", "effort: 100.0", "joint_2: effort 100", "`effort: 120`"),
    "axis number": robot(
        "axis_number: 5",
        "axis_number: 4",
        "axis_number 4 occurs more",
        "correct",
        "axis_number: 4         # ext",
    ),
    "name": robot("name: fanuc_sr6ia", "name: fanuc_sr6", "says name: fanuc_sr6", "the same text"),
    "table not moved": robot(
        f"{TABLE}    type: revolute\n"
        "    axis_number: 5         # extended axis of the real controller [asm]\n    twin: true",
        f"{TABLE}    type: revolute\n    axis_number: 5\n    twin: false",
        "table_joint: the URDF moves and the twin does not",
        "so that both move the same joints",
        "    twin: false\n    screw_axis: null",
    ),
    "table's limit": robot(
        "upper_deg: 180.0", "upper_deg: 170.0", "table_joint: upper 170 .* 180", "`upper_deg: 180`"
    ),
    "stopping": robot(
        "uop: full", "uop: simple", "stopping.tried.imstp: uop is simple", "correct", "imstp: 127"
    ),
    "overlap": register(
        "velocity:          {address: 11022,",
        "velocity:          {address: 11015,",
        "velocity.address = 11015: overlaps position",
        "correct address, type or count",
        "velocity:          {address: 11015,",
    ),
    "hidden address": register(
        "override:          {address: 11101,",
        "override:          {address: 9999,",
        "slot 1 of a",
        "move it",
    ),
    "no heartbeat": register(
        "  heartbeat:  ",
        "  heart_beat: ",
        "heartbeat: is missing",
        "add a counter",
        "holding_registers:",
    ),
    "unit": register(
        'count: 9, unit: axis, variable: "POS',
        'count: 9, unit: rad, variable: "POS',
        "position has unit 'rad'",
        "`unit: axis`",
    ),
    "written state": register(
        "position:          {address: 11001,",
        "position:          {write: true, address: 11001,",
        "position has write: true",
        "remove `write`",
    ),
    "speed not written": register(
        "stream_speed:      {address: 11071, type: int16, unit: percent, write: true,",
        "stream_speed:      {address: 11071, type: int16, unit: percent,",
        "stream_speed: must be a holding register with write: true",
        "correct the entry",
    ),
    "clock in seconds": register(
        'type: int32, unit: ms, variable: "R[21]"',
        'type: int32, unit: s, variable: "R[21]"',
        "clock_ms has unit 's'",
        "`unit: ms`",
    ),
    "no sysrdy": register(
        "  sysrdy: ",
        "  sysready: ",
        "discrete_inputs.sysrdy: is missing",
        "find where the robot has it",
        "discrete_inputs:",
    ),
    "no gains": Planted(
        BIG,
        "pid_gains.yaml",
        "joint_3:",
        "joint_9:",
        "pid_gains.yaml: joint_3 is missing",
        "propose_gains --robot",
        ("pid_gains.yaml", "joint_1:"),
    ),
    "stale": Planted(
        SMALL,
        "robot.yaml",
        "velocity_deg_s: 720.0",
        "velocity_deg_s: 700.0",
        "fanuc_sr3ia.urdf was written from another",
        "write_urdf fanuc_sr3ia",
        ("fanuc_sr3ia.urdf", "<robot"),
    ),
    "body elsewhere": Planted(
        SMALL,
        "body.yaml",
        "at_mm: [200, 0, 175]",
        "at_mm: [190, 0, 175]",
        r"geometry.l1_mm = 200: the arm of .*body.yaml has 190",
        "or correct .*body.yaml; then: rosrun",
        ("robot.yaml", "l1_mm: 200.0"),
    ),
    "table without joint": Planted(
        SMALL,
        "body.yaml",
        "    joint: table_joint\n",
        "",
        "links: joints .*: Expected each of",
        "correct",
        ("body.yaml", "links:"),
    ),
    "start": Planted(
        SMALL,
        "emulator.yaml",
        "joint_3_mm: -150.0",
        "joint_3_mm: 150.0",
        "start_position.joint_3_mm = 150",
        "correct",
    ),
}
"""By what is wrong: lengths, points, reach, inertia, signs, limits, table, signals."""
ALONE = {
    "l2",
    "home pose",
    "axis",
    "sign of joint 1",
    "P3 elsewhere",
    "program elsewhere",
    "no line",
    "turned round",
    "radians",
    "home missing",
    "table's limit",
    "no unit vector",
    "axis number",
    "table without joint",
}
"""What another one of the same robot hides, or stands in its place."""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """Give a copy of the whole configuration."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    return tmp_path / "config"


def plant(config: Path, error: Planted) -> None:
    """Make the error."""
    file = config / "robots" / error.robot / error.file
    text = file.read_text()
    assert error.old in text, error
    file.write_text(text.replace(error.old, error.new, 1))


def told(config: Path) -> list[tuple[Finding, str]]:
    """Return what one round of the doctor finds wrong, and where."""
    profile = read_profile(config)
    found = list(examine(profile))
    found += other_files(config, profile, found)
    wrong = [finding for finding in found if finding.level is Level.WRONG]
    return [(finding, place_of(finding, config, profile.robot)) for finding in wrong]


def test_there_are_forty() -> None:
    """As many as were asked for."""
    assert len(FORTY) >= 40


@pytest.mark.parametrize("name", FORTY)
def test_a_planted_error_is_named_with_file_line_and_remedy(
    config: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once, at the line that was changed or where it is to be written."""
    error = FORTY[name]
    monkeypatch.setenv(CHOICE, error.robot)
    plant(config, error)
    found = told(config)
    named = [each for each in found if re.search(error.what, each[0].what)]
    assert len(named) == 1, [(f.what, at) for f, at in found]
    finding, at = named[0]
    assert re.search(error.remedy, finding.advice), finding.advice
    file, text = error.there if error.there[0] else (error.file, error.new)
    path = config / "robots" / error.robot / file
    if file.endswith(".urdf"):
        path = ROOT / "src" / "scara_description" / "urdf" / file
    whole = path.read_text()
    line = whole[: whole.index(text)].count("\n") + 1
    assert at == f"{path}:{line}"
    assert len({finding.what for finding, _ in found}) == len(found), "each is told once"


@pytest.mark.parametrize("robot", [BIG, SMALL])
def test_all_of_them_are_named_in_one_round(
    config: Path, robot: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """None waits for another one to be mended."""
    monkeypatch.setenv(CHOICE, robot)
    names = [name for name, e in FORTY.items() if e.robot == robot and name not in ALONE]
    for name in names:
        plant(config, FORTY[name])
    found = told(config)
    missed = [
        name for name in names if not any(re.search(FORTY[name].what, f.what) for f, _ in found)
    ]
    assert not missed, [finding.what for finding, _ in found]


def test_all_values_that_are_given_have_one_elbow(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Shorter, the arm does not reach P1; from P2 to P3 it would have to turn over otherwise."""
    monkeypatch.setenv(CHOICE, BIG)
    plant(config, robot("l1_mm: 350.0", "l1_mm: 325.0", "", ""))
    found = {f.what[:19]: f.advice for f, _ in told(config) if f.what.startswith("ARTICLE.LS")}
    turned = [
        float(re.search(r"J2= (\S+) deg", found[f"ARTICLE.LS: P[{k}:P{k}]"])[1]) for k in (2, 3)
    ]
    assert turned == pytest.approx([62.48873, 62.48873], abs=1e-5)


def test_half_the_inertia_in_a_typed_urdf_is_found(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command that computes it is named; a tenth more is somebody's better knowledge."""
    monkeypatch.setenv(CHOICE, BIG)
    urdf = tmp_path / "scara_cell.urdf"
    before = (ROOT / "src" / "scara_description" / "urdf" / urdf.name).read_text()
    monkeypatch.setattr("scara_config.robot.description_path", tmp_path.joinpath)
    link = before.index('<link name="link_2">')
    begin = before.index("<inertia ", link)
    end = before.index("/>", begin)
    typed = {key: float(x) for key, x in re.findall(r'(\w+)="(.*?)"', before[begin:end])}
    for factor, count in ((0.5, 1), (1.1, 0)):
        terms = " ".join(f'{key}="{factor * value}"' for key, value in typed.items())
        urdf.write_text(f"{before[:begin]}<inertia {terms}{before[end:]}")
        found = told(config)
        assert len(found) == count, found
        for finding, at in found:
            assert finding.what.startswith("link link_2: the inertia of ")
            assert finding.advice == f"rosrun scara_description write_inertia {urdf}"
            assert at == f"{urdf}:{before[:link].count(chr(10)) + 1}"
