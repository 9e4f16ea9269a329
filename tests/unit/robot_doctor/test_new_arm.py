"""An arm from a URDF: the doctor finds nothing, and all that the URDF says is in its files."""

from __future__ import annotations

import itertools
import math
import re
import shutil
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from harness.running.thorough import thorough
from harness.workspace import ROOT
from robot_doctor.chain import read_description
from robot_doctor.examine import examine
from robot_doctor.finding import Level
from robot_doctor.foreign_urdf import read_foreign
from robot_doctor.new_arm import ArmFigures, arm_text
from robot_doctor.new_arm_io import make_arm
from robot_doctor.profile_files_io import read_profile
from robot_doctor.tidied_urdf import tidied
from scara_config import ConfigError, Robot, load_robot
from scara_config.profile import CHOICE
from scara_config.readers import check_files
from scara_control.keep_out.points import watched_points
from scara_control.kinematics import numeric
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_control.kinematics.tool import ScaraTool, tool_kinematics
from scara_description.inertia import rotation_from_rpy

from scara_description.urdf import link_pose, parse_robot, parse_urdf, tree_of

URDFS = ROOT / "src" / "scara_description" / "urdf"
SIX = "articulated_six"


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give a copy of the whole configuration; URDFs stand beside it."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    monkeypatch.setattr("scara_config.robot.description_path", tmp_path.joinpath)
    monkeypatch.setenv(CHOICE, "mine")
    return tmp_path / "config"


def described(folder: Path, source: str = SIX, **changed: str) -> Path:
    """Write one of our URDFs as somebody else's, each text replaced once."""
    text = (URDFS / f"{source}.urdf").read_text()
    for old, new in changed.items():
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "theirs.urdf"
    path.write_text(text)
    return path


def made(config: Path, source: Path, tool: str | None = None) -> Robot:
    """Make a robot, see that the doctor finds nothing, and return it."""
    make_arm(config, "mine", source, tool, config.parent)
    told = [f for f in examine(read_profile(config)) if f.level is not Level.FINE]
    assert (told, check_files(config)) == ([], [])
    return load_robot(config)


def described_pose(urdf: Path, tool: str, q: dict[str, float]) -> np.ndarray:
    """Return the tool's pose by the URDF's own frames, joint by joint."""
    root = parse_robot(urdf.read_text())
    model = tree_of(root, {link.get("name", ""): () for link in root.findall("link")})
    return link_pose(model, tool, q)


@pytest.mark.parametrize("source", [SIX, "epson_gx4", *thorough("scara_cell", "fanuc_sr3ia")])
def test_an_arm_from_its_urdf_is_healthy(config: Path, tmp_path: Path, source: str) -> None:
    """Limits, axes and tool are the URDF's; a SCARA is known as one."""
    urdf = described(tmp_path, source)
    robot = made(config, urdf)
    limits = {
        joint.get("name"): joint.find("limit")
        for joint in parse_robot(urdf.read_text()).findall("joint")
        if joint.get("type") != "fixed"
    }
    assert {joint.name for joint in robot.joints} == set(limits)
    for joint in robot.joints:
        for key in ("lower", "upper", "velocity", "effort"):
            theirs = float(limits[joint.name].get(key))  # type: ignore[union-attr]
            assert getattr(joint, key) == pytest.approx(theirs, rel=1e-9, abs=1e-12)
    chance = np.random.default_rng(7)
    for _ in range(200):
        q = {j.name: chance.uniform(j.lower, j.upper) for j in robot.arm_joints}
        ours = forward_kinematics(ScrewModel.from_robot(robot), list(q.values()))
        assert np.abs(ours - described_pose(urdf, robot.tool_frame, q)).max() < 1e-12
    assert isinstance(tool_kinematics(robot), ScaraTool) == (source != SIX)
    assert len(robot.keep_out) == 1 and len(watched_points(robot)) > len(robot.arm_joints)


def triangles(corners: np.ndarray) -> str:
    """Return an STL of the tetrahedra that one corner makes with each two others."""
    rows = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in (corners[0], one, other))
        + "endloop\nendfacet\n"
        for one, other in itertools.pairwise(corners[1:])
    )
    return f"solid theirs\n{rows}endsolid theirs\n"


def test_meshes_are_held_and_what_hangs_still_belongs_to_its_carrier(
    config: Path, tmp_path: Path
) -> None:
    """A mesh, a camera at the wrist, and frames without body, as real URDFs have them."""
    chance = np.random.default_rng(3)
    corners = chance.uniform((-40.0, -35.0, 0.0), (40.0, 35.0, 260.0), (60, 3))
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "arm.stl").write_text(triangles(corners))
    source = described(tmp_path)
    text = source.read_text()
    link = text.index('<link name="link_2">')
    begin, end = text.index("<visual>", link), text.index("<inertial>", link)
    mesh = '<mesh filename="package://theirs/meshes/arm.stl" scale="0.001 0.001 0.001"/>'
    body = f"<collision><geometry>{mesh}</geometry></collision>\n    "
    text = text[:begin] + body + text[end:]
    added = """
  <link name="camera"><collision><origin xyz="0 0 0.02"/><geometry><box size="0.02 0.02 0.02"/>
    </geometry></collision><inertial><origin xyz="0 0 0.02"/><mass value="0.25"/>
    <inertia ixx="2e-5" ixy="0" ixz="0" iyy="2e-5" iyz="0" izz="2e-5"/></inertial></link>
  <link name="optical_frame"/><link name="world"/>
  <joint name="a" type="fixed"><origin xyz="0 0.03 0" rpy="0.2 0 0"/><parent link="link_6"/>
    <child link="camera"/></joint>
  <joint name="b" type="fixed"><parent link="camera"/><child link="optical_frame"/></joint>
  <joint name="c" type="fixed"><parent link="world"/><child link="base_link"/></joint>
</robot>"""
    source.write_text(text.replace("</robot>", added))
    robot = made(config, source)
    model = parse_urdf((tmp_path / "mine.urdf").read_text(), seen=False)
    assert robot.base_frame == "world" and "camera" not in model.shapes
    assert len(model.shapes["link_6"]) == 2
    held = {link.get("name"): link for link in parse_robot((tmp_path / "mine.urdf").read_text())}
    mass = float(held["link_6"].find("inertial/mass").get("value"))  # type: ignore[union-attr]
    assert mass == pytest.approx(0.25 + 0.25)
    inside = np.zeros(len(corners), dtype=bool)
    for shape in model.shapes["link_2"]:
        own = (1e-3 * corners - shape.xyz) @ rotation_from_rpy(*shape.rpy)
        size = np.array(shape.size)
        if shape.kind == "box":
            inside |= (np.abs(own) <= 0.5 * size + 1e-9).all(axis=1)
        else:
            round_in = np.hypot(own[:, 0], own[:, 1]) <= size[0] + 1e-9
            inside |= round_in & (np.abs(own[:, 2]) <= 0.5 * size[1] + 1e-9)
    assert inside.all()


def test_an_acceleration_that_had_to_be_raised_says_so() -> None:
    """A joint of 6 deg/s would be at its speed with 24 deg/s^2."""
    urdf = read_description((URDFS / f"{SIX}.urdf").read_text(), "tool0")
    slow = msgspec.structs.replace(urdf.joints["joint_1"], velocity=0.10472)
    urdf = msgspec.structs.replace(urdf, joints={**urdf.joints, "joint_1": slow})
    text = arm_text("mine", "doctor new", urdf, ("base_link", "tool0"), ArmFigures(1.0, {}, {}))
    assert "s2: 100   # the least allowed; speed and efforts ask for 24\n" in text
    assert text.count("the least allowed") == 1


@pytest.mark.thorough
def test_an_arm_may_stand_on_a_rail(config: Path, tmp_path: Path) -> None:
    """A slide across its axes: its payload counts with the longest lever."""
    source = described(tmp_path)
    rail = """<link name="rail"><collision><origin xyz="0 0 -0.4"/><geometry>
    <box size="0.3 2.4 0.1"/></geometry></collision></link><joint name="rail" type="prismatic">
    <parent link="rail"/><child link="base_link"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" velocity="1" effort="3000"/></joint></robot>"""
    source.write_text(source.read_text().replace("</robot>", rail))
    robot = made(config, source)
    assert [joint.si_unit for joint in robot.arm_joints] == ["m", *["rad"] * 6]
    assert robot.keep_out[0].upper_mm[0] == math.ceil(2.0 * robot.reach_mm + 1000.0)


def test_a_gantry_reaches_as_far_as_its_slides() -> None:
    """Nothing turns but the tool about itself."""
    urdf = read_description((URDFS / "epson_gx4.urdf").read_text(), "tool0")
    slide, turn = urdf.joints["joint_3"], urdf.joints["joint_4"]
    joints = {
        f"joint_{k}": msgspec.structs.replace(
            slide, lower=-0.5 * k, upper=0.3, screw=(0.0, 0.0, 0.0, *np.eye(3)[k].tolist())
        )
        for k in range(3)
    }
    urdf = msgspec.structs.replace(urdf, joints={**joints, "joint_4": turn})
    text = arm_text("mine", "doctor new", urdf, ("base_link", "tool0"), ArmFigures(1.0, {}, {}))
    assert "\nreach_mm: 1800.0\n" in text and "geometry" not in text


def test_a_table_that_cannot_stand_at_0_stands_within_its_range(
    config: Path, tmp_path: Path
) -> None:
    """At home and in all programs, though 30 deg of the two decimals shown would be outside."""
    source = described(tmp_path, "scara_cell")
    old = r'(?s)(<joint name="table_joint".*?lower=")[^"]*'
    text, count = re.subn(old, r"\g<1>0.5236", source.read_text(), count=1)
    assert count == 1
    source.write_text(text)
    assert made(config, source).home["table_joint"] == 30.01


def test_a_file_may_have_any_name(tmp_path: Path) -> None:
    """Two hyphens would end the comment that names it."""
    foreign = read_foreign(described(tmp_path).read_text(), "their--arm.urdf")
    assert parse_robot(tidied(foreign, "mine", lambda _: np.zeros((0, 3, 3)))) is not None


@pytest.mark.thorough
def test_an_arm_that_gets_nowhere_turned_as_it_must_be_is_refused_soon(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joints 2 to 6 are parallel: beside home the tool is never turned as there."""
    source = described(tmp_path)
    text = source.read_text().replace('<axis xyz="1 0 0"/>', '<axis xyz="0 1 0"/>')
    source.write_text(text)
    descents: list[int] = []
    descend = numeric._descend

    def counted(*given: Any) -> Any:
        descents.append(1)
        return descend(*given)

    monkeypatch.setattr(numeric, "_descend", counted)
    with pytest.raises(ConfigError, match=r"urdf: 6 joints \(joint_1, .* joint_6\) find no home"):
        make_arm(config, "mine", source, None, tmp_path)
    assert len(descents) < 500


LIMIT = r'<limit lower="-1\.57.*?/>'
FAULTS = {
    "floating": (
        'name="joint_3" type="revolute"',
        'name="joint_3" type="floating"',
        r"theirs.urdf, line \d+: joint joint_3: type = floating: Expected revolute, prismatic",
    ),
    "continuous": (
        'name="joint_6" type="revolute"',
        'name="joint_6" type="continuous"',
        r"joint joint_6: type = continuous: Expected revolute, with lower and upper within",
    ),
    "mimic": (
        '<child link="link_5"/>',
        '<child link="link_5"/><mimic joint="joint_4"/>',
        'joint joint_5: mimic = joint_4: Expected a motor of its own, or type="fixed"',
    ),
    "no limit": (LIMIT, "", "joint joint_2: limit: is missing: Expected lower, upper, vel"),
    "no speed": (
        r'velocity="3\.83.*?"',
        'velocity="0"',
        r"joint joint_2: limit velocity = 0: Expected 0.08727 to 174.5 rad/s",
    ),
    "no effort": (
        r' effort="250"',
        "",
        r"joint joint_2: limit effort: is missing: Expected 1 to 5000 N m",
    ),
    "weak": (
        r' effort="250"',
        ' effort="40"',
        r"joint joint_2: limit effort = 40: the arm weighs .* N m on it: Expected more than",
    ),
    "turned round": (
        r'lower="-1\.57\d*"',
        'lower="2.5"',
        r"joint joint_2: limit lower = 2.5: Expected less than upper = 2.09\d* rad",
    ),
    "no inertia": (
        r'(?s)(<link name="link_3">.*?)<inertial>.*?</inertial>',
        r"\1",
        "link link_3: inertial: is missing: Expected origin, mass and inertia",
    ),
    "no mass": (
        r'(?s)(<link name="link_3">.*?)<mass [^>]*>',
        r"\1",
        "link link_3: inertial mass: is missing",
    ),
    "no body can": (
        r'(?s)(<link name="link_3">.*?ixx=")[^"]*',
        r"\g<1>9.0",
        r"link link_3: mass = 4 kg, moments of inertia .*, 9 kg m.2: Expected all above 0",
    ),
    "no mesh": (
        r'(?s)(<link name="link_3">.*?)<collision>.*?</collision>',
        r'\1<collision><geometry><mesh filename="package://x/a.stl"/></geometry></collision>',
        r"link link_3: collision: mesh package://x/a.stl: is missing: looked for x/a.stl in all",
    ),
    "another mesh": (
        r'(?s)(<link name="link_3">.*?)<collision>.*?</collision>',
        r'\1<collision><geometry><mesh filename="theirs.urdf"/></geometry></collision>',
        r"link link_3: collision: .*theirs.urdf: a mesh of kind .urdf: Expected .stl or .obj",
    ),
    "a mesh of a kind that is not read": (
        r'(?s)(<link name="link_3">.*?)<collision>.*?</collision>',
        r'\1<collision><geometry><mesh filename="theirs.dae"/></geometry></collision>',
        r"theirs.dae: a mesh of kind .dae: .*export it as one of these, with MeshLab or Blender",
    ),
    "no body": (
        r'(?s)(<link name="link_3">).*?(<inertial>)',
        r"\1\2",
        "no <collision> of what joint_3 moves",
    ),
    "no tool": ('<link name="tool0">', '<link name="other">', r"unknown links \['tool0'\]"),
    "name": ('name="joint_3"', 'name="joint-3"', "joint joint-3: name: Expected letters, digits"),
    "colour": ('rgba="0.22 ', 'rgba="x ', "link .*: material color: 'x .*' is no vector"),
    "no number": (
        r'(?s)(<link name="link_3">.*?ixy=")[^"]*',
        r"\g<1>inf",
        "link link_3: inertial: cannot be read: mass and moments have to be finite",
    ),
    "no place": (
        r'(?s)(<link name="link_3">.*?<inertial>\s*<origin xyz=")[^"]*',
        r"\g<1>1 2",
        "link link_3: inertial: cannot be read: '1 2' is no vector of three numbers",
    ),
    "twice": (
        '<link name="link_4">',
        '<link name="link_3">',
        "link link_3: Expected a name of its",
    ),
    "no XML": ("</robot>", "", "the robot description is no XML"),
}
"""What is wrong: a pattern of the URDF, what stands in its place, and what is said of it."""


@pytest.mark.parametrize("name", FAULTS)
def test_what_cannot_be_used_is_told_in_one_line(config: Path, tmp_path: Path, name: str) -> None:
    """File, line, joint or link, key, value, what is expected; and nothing is left behind."""
    old, new, told = FAULTS[name]
    source = described(tmp_path)
    text, count = re.subn(old, new, source.read_text(), count=1)
    assert count == 1
    source.write_text(text)
    (tmp_path / "theirs.dae").write_text("<COLLADA/>")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(ConfigError, match=told) as error:
        make_arm(config, "mine", source, None, tmp_path)
    assert "\n" not in str(error.value) and re.search("theirs|mine.urdf", str(error.value))
    assert sorted(tmp_path.rglob("*")) == before
