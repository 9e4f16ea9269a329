"""The robot profile.

Units change at the border, and a profile that contradicts itself is refused.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from harness.workspace import ROOT
from harness.yaml_files import REMOVED, changed_yaml, shipped
from scara_config import ConfigError, PrismaticJoint, load_robot
from scara_config.elbow import elbow_of

SHIPPED = ROOT / "config"
ROBOT = load_robot(SHIPPED)


def test_limits_and_speeds_of_turning_joints_are_radians() -> None:
    """joint_1 turns +-148 deg at 440 deg/s at most (facts: SR-6iA)."""
    joint = ROBOT.joint("joint_1")
    assert np.degrees([joint.lower, joint.upper, joint.velocity]) == pytest.approx(
        [-148.0, 148.0, 440.0]
    )
    assert math.degrees(joint.acceleration) == pytest.approx(2500.0)
    assert math.degrees(joint.jerk) == pytest.approx(40000.0)


def test_limits_and_speeds_of_sliding_joints_are_metres() -> None:
    """joint_3 slides from -210 mm to 0, up positive, at 2 m/s at most."""
    joint = ROBOT.joint("joint_3")
    assert isinstance(joint, PrismaticJoint)
    assert [joint.lower, joint.upper, joint.velocity] == pytest.approx([-0.210, 0.0, 2.0])
    assert [joint.acceleration, joint.jerk] == pytest.approx([20.0, 400.0])


def test_twin_moves_all_but_joint_4() -> None:
    """The article leaves joint 4 out of the model; the table is a joint that moves no tool."""
    assert [joint.name for joint in ROBOT.twin_joints] == [
        "joint_1",
        "joint_2",
        "joint_3",
        "table_joint",
    ]
    assert [joint.name for joint in ROBOT.arm_joints] == ["joint_1", "joint_2", "joint_3"]


def test_lengths_agree_with_the_reach_and_the_home_pose() -> None:
    """L1 + L2 is the reach, and the tool of the home pose stands there at height h."""
    geometry = ROBOT.geometry
    assert geometry.l1_mm + geometry.l2_mm == pytest.approx(ROBOT.reach_mm)
    assert ROBOT.home_pose[0][3] == pytest.approx(ROBOT.reach_mm / 1000.0)
    assert ROBOT.home_pose[2][3] == pytest.approx(geometry.h_mm / 1000.0)


def test_what_follows_from_the_lengths_may_be_typed_if_it_agrees(tmp_path: Path) -> None:
    """A profile of before, and one whose quill counts down, are read as they are."""
    typed = {"reach_mm": 650.0, "home_pose": [list(row) for row in ROBOT.home_pose]}
    folder = tmp_path
    source = shipped("robot.yaml")
    for key, value in typed.items():
        source = changed_yaml(source, folder, [key], value) / "robot.yaml"
    assert load_robot(folder) == ROBOT
    changed_yaml(source, folder, ["joints", 2, "screw_axis"], [0, 0, 0, 0, 0, -1])
    assert load_robot(folder).joint("joint_3").screw_axis == (0, 0, 0, 0, 0, -1)


@pytest.mark.parametrize(
    ("reach", "fits"), [(600.0, True), (680.0, True), (500.0, False), (690.0, False)]
)
def test_the_reach_of_another_arm_is_that_of_its_links(
    tmp_path: Path, reach: float, fits: bool
) -> None:
    """Stretched, 300 + 300 + 80 mm; it may be counted to the wrist, and never to anywhere else."""
    six = SHIPPED / "robots" / "articulated_six" / "robot.yaml"
    folder = changed_yaml(six, tmp_path, ["reach_mm"], reach)
    if fits:
        assert load_robot(folder).reach_mm == reach
        return
    with pytest.raises(ConfigError, match=rf"reach_mm = {reach:g}: Expected 510 to 680"):
        load_robot(folder)


@pytest.mark.parametrize(
    ("reach", "fits"), [(510.0, True), (1180.0, True), (500.0, False), (1190.0, False)]
)
def test_a_rail_lets_the_reach_be_longer(tmp_path: Path, reach: float, fits: bool) -> None:
    """By its longer way, 500 mm; the reach may be the arm's alone."""
    six = SHIPPED / "robots" / "articulated_six" / "robot.yaml"
    tree = yaml.safe_load(six.read_text(encoding="utf-8"))
    rail = {
        "name": "rail",
        "type": "prismatic",
        "axis_number": 7,
        "twin": True,
        "screw_axis": [0, 0, 0, 0, 1, 0],
        "lower_mm": -500.0,
        "upper_mm": 300.0,
        "velocity_mm_s": 500.0,
        "acceleration_mm_s2": 2000.0,
        "jerk_mm_s3": 30000.0,
        "effort": 3000.0,
    }
    tree["joints"].insert(0, rail)
    tree["home"]["rail"], tree["reach_mm"] = 0.0, reach
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump(tree), encoding="utf-8")
    if fits:
        assert load_robot(tmp_path).slides_mm == pytest.approx(500.0)
        return
    with pytest.raises(ConfigError, match=rf"reach_mm = {reach:g}: Expected 510 to 1180"):
        load_robot(tmp_path)


def test_home_pose_is_a_rigid_transform() -> None:
    """A proper rotation: orthogonal, determinant +1, last row 0 0 0 1."""
    pose = np.array(ROBOT.home_pose)
    rotation = pose[:3, :3]
    assert rotation @ rotation.T == pytest.approx(np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1.0)
    assert pose[3] == pytest.approx([0, 0, 0, 1])


@pytest.mark.parametrize(
    "joint", [joint for joint in ROBOT.joints if joint.screw_axis is not None], ids=lambda j: j.name
)
def test_screw_axes_are_normalised(joint: Any) -> None:
    """Turning: |omega| = 1 and v perpendicular to it; sliding: omega = 0 and |v| = 1."""
    omega, v = np.array(joint.screw_axis[:3]), np.array(joint.screw_axis[3:])
    if isinstance(joint, PrismaticJoint):
        assert not omega.any() and np.linalg.norm(v) == pytest.approx(1.0)
    else:
        assert np.linalg.norm(omega) == pytest.approx(1.0) and omega @ v == pytest.approx(0.0)


def test_unknown_joint_is_refused_with_the_known_ones() -> None:
    """The text helps against typing errors."""
    with pytest.raises(
        ConfigError, match=r"unknown joint 'joint_9': robot.yaml has joint_1, .*table_joint"
    ):
        ROBOT.joint("joint_9")


def test_home_is_the_articles_position_1_in_si() -> None:
    """Where the twin starts, and where HOME goes."""
    assert ROBOT.home_positions == pytest.approx([0.0, 0.0, -0.160, 0.0])
    assert ROBOT.positions_m["P1"] == (0.65, 0.0, 0.0)


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (["joints"], [], r"joints: no joint moves the tool: Expected one with twin: true"),
        (["joints", 0, "lower_deg"], 200.0, r"joint_1: lower limit is not below the upper limit"),
        (["joints", 0, "upper_deg"], -148.0, r"joint_1: lower limit is not below the upper limit"),
        (["joints", 1, "name"], "joint_1", r"name joint_1 occurs more than once"),
        (["joints", 1, "axis_number"], 1, r"axis_number: axis_number 1 occurs more than once"),
        (["joints", 2, "axis_number"], 10, r"joints\[2\]\.axis_number = 10: Expected `int` <= 9"),
        (
            ["joints", 0, "velocity_deg_s"],
            0.0,
            r"joints\[0\]\.velocity_deg_s = 0.0: Expected `float` >= 5",
        ),
        (["joints", 0, "type"], "spherical", r"joints\[0\]\.type = 'spherical'"),
        (["joints", 2, "lower_deg"], -10.0, r"joints\[2\].*unknown field `lower_deg`"),
        (["joints", 2, "lower_mm"], REMOVED, r"joints\[2\].*missing required field `lower_mm`"),
        (["joints", 0, "screw_axis"], [0, 0, 1], r"joints\[0\]\.screw_axis"),
        (
            ["joints", 2, "screw_axis"],
            [0, 0, 1, 1, 0, 0],
            r"joint_3\.screw_axis.*omega 0, a unit v",
        ),
        (["reach_mm"], -1, r"reach_mm = -1: Expected `float` >= 10"),
        (["reach_mm"], 640.0, r"reach_mm = 640: Expected 650 = l1_mm \+ l2_mm"),
        (["geometry"], REMOVED, r"missing required field `reach_mm`"),
        (
            ["joints", 1, "screw_axis"],
            [0, 0, 1, 0, -0.325, 0],
            r"joints\.joint_2\.screw_axis: 325 mm from the axis before: Expected geometry\.l1_mm",
        ),
        (
            ["home_pose"],
            [[0, -1, 0, 0.55], [-1, 0, 0, 0], [0, 0, -1, 0.16], [0, 0, 0, 1]],
            r"home_pose: 200 mm from the axis before: Expected geometry\.l2_mm = 300, or no home_",
        ),
        (["colour"], "yellow", r"unknown field `colour`"),
        (["home", "joint_3"], 1.0, r"home\.joint_3 = 1: Expected -210 to 0 mm"),
        (["home", "joint_1"], 149.0, r"home\.joint_1 = 149: Expected -148 to 148 deg"),
        (["home", "joint_1"], REMOVED, r"home\.joint_1: is missing"),
        (
            ["home", "joint_4"],
            0.0,
            r"home\.joint_4: is no joint of the twin; it has joint_1, .*table_joint",
        ),
        (["joints", 1, "inertia"], 0.15, r"unknown field `inertia`"),
        (["watched_points"], [], r"unknown field `watched_points`"),
        (["positions_m", "P1"], [0.65, 0.0], r"positions_m\.P1.*length 3"),
        (
            ["keep_out", 0, "lower_mm"],
            [900.0, 0.0, 0.0],
            r"keep_out\.below_table: lower_mm is not below upper_mm",
        ),
        (["urdf"], REMOVED, r"missing required field `urdf`"),
    ],
)
def test_wrong_profile_is_refused(
    tmp_path: Path, path: list[str | int], value: Any, text: str
) -> None:
    """File, key, value and what is allowed."""
    with pytest.raises(ConfigError, match=rf"robot\.yaml: .*{text}"):
        load_robot(changed_yaml(shipped("robot.yaml"), tmp_path, path, value))


def test_a_joint_that_counts_the_other_way_says_so_and_types_no_axis(tmp_path: Path) -> None:
    """Its axis follows from the lengths, turned round; the elbow is the same joint."""
    source = shipped("robot.yaml")
    for number, word in ((1, "right"), (2, "down")):
        source = changed_yaml(source, tmp_path, ["joints", number, "positive"], word) / "robot.yaml"
    robot = load_robot(tmp_path)
    assert robot.joints[1].screw_axis == (0.0, 0.0, -1.0, 0.0, 0.35, 0.0)
    assert robot.joints[2].screw_axis == (0.0, 0.0, 0.0, 0.0, 0.0, -1.0)
    elbow, usual = elbow_of(robot), elbow_of(ROBOT)
    assert elbow is not None and usual is not None
    assert (elbow.joint.name, elbow.sign) == ("joint_2", -1.0)
    assert elbow.bend(0.3) == pytest.approx(-usual.bend(0.3)) == pytest.approx(-0.3)


@pytest.mark.parametrize("word", ["down", "sideways"])
def test_a_word_that_is_no_way_to_count_is_refused(tmp_path: Path, word: str) -> None:
    """A joint that turns counts to the left, or to the right."""
    changed_yaml(shipped("robot.yaml"), tmp_path, ["joints", 0, "positive"], word)
    with pytest.raises(ConfigError, match="positive"):
        load_robot(tmp_path)
