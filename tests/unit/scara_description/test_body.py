"""A URDF from a profile.

The frames are where the screws say, and a body that does not fit is refused.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from harness.workspace import ROOT
from harness.yaml_files import REMOVED, changed_yaml
from robot_doctor.chain import read_description
from scara_config import ConfigError, Robot, load_robot
from scara_config.profile import CHOICE
from scara_config.robot import PrismaticJoint
from scara_description.body import load_body, urdf_of
from scara_description.inertia import rotation_from_rpy

from scara_description.urdf import parse_robot, rpy_of

FOLDER = ROOT / "config" / "robots" / "articulated_six"


@pytest.fixture(scope="module")
def robot() -> Robot:
    """Return the six-joint robot."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(CHOICE, "articulated_six")
        return load_robot(ROOT / "config")


def test_screws_and_tool_of_the_urdf_are_those_of_the_profile(robot: Robot) -> None:
    """Read back by another route: the frames' own transforms."""
    described = read_description(urdf_of(robot, load_body(robot, FOLDER)), robot.tool_frame)
    for joint in robot.twin_joints:
        assert described.joints[joint.name].screw == pytest.approx(joint.screw_axis, abs=1e-9)
    np.testing.assert_allclose(described.tool_pose, robot.home_pose, atol=1e-9)


@pytest.mark.parametrize(
    "rpy",
    [
        (0.0, 0.0, 0.0),
        (0.3, -0.7, 2.0),
        (math.pi, 0.0, -math.pi / 2),
        (0.0, math.pi / 2, 0.0),
        (0.0, -math.pi / 2, 0.4),
    ],
)
def test_roll_pitch_yaw_give_the_rotation_back(rpy: tuple[float, float, float]) -> None:
    """Straight up and down too."""
    rotation = rotation_from_rpy(*rpy)
    np.testing.assert_allclose(rotation_from_rpy(*rpy_of(rotation)), rotation, atol=1e-12)


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (
            ["links", 1, "parent"],
            "link_9",
            r"links\[1\]\.parent = 'link_9': Expected a link above it",
        ),
        (["links", 1, "joint"], "joint_9", r"links\[1\]\.joint = joint_9: no joint of the twin"),
        (["links", 1, "joint"], REMOVED, r"Expected each of joint_1, .* once"),
        (
            ["links", 0, "shapes", 0, "colour"],
            "pink",
            r"shapes\.colour = pink: Expected one of black",
        ),
        (["links", 0, "shapes", 0, "box_mm"], REMOVED, r"each needs either box_mm or cylinder_mm"),
        (["links", 7, "name"], "tool1", r"links: there is no tool0"),
        (["links", 0, "mass_kg"], 0.0, r"mass_kg = 0\.0: Expected `float` > 0"),
    ],
)
def test_a_body_that_does_not_fit_is_refused(
    robot: Robot, tmp_path: Path, path: list[str | int], value: Any, text: str
) -> None:
    """File, link and what is allowed."""
    with pytest.raises(ConfigError, match=rf"body\.yaml: .*{text}"):
        load_body(robot, changed_yaml(FOLDER / "body.yaml", tmp_path, path, value))


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_a_table_turns_about_z_or_slides_along_it(kind: str) -> None:
    """It moves no tool, so its profile has no axis for it."""
    folder = ROOT / "config" / "robots" / "fanuc_sr3ia"
    cell = load_robot(folder)
    body = load_body(cell, folder)
    table = cell.joint("table_joint")
    slide = PrismaticJoint(
        name=table.name,
        axis_number=table.axis_number,
        twin=True,
        screw_axis=None,
        effort=100.0,
        lower_mm=-200.0,
        upper_mm=200.0,
        velocity_mm_s=100.0,
        acceleration_mm_s2=1000.0,
        jerk_mm_s3=10000.0,
    )
    moved = table if kind == "revolute" else slide
    joints = [moved if joint is table else joint for joint in cell.joints]
    text = urdf_of(msgspec.structs.replace(cell, joints=joints), body)
    described = next(
        joint for joint in parse_robot(text).findall("joint") if joint.get("name") == table.name
    )
    axis = described.find("axis")
    assert axis is not None
    assert (described.get("type"), axis.get("xyz")) == (kind, "0 0 1")
    assert read_description(text, cell.tool_frame).joints[table.name].kind == kind
