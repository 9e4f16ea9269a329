"""What is drawn around the robot, held against its kinematics."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from harness.workspace import ROOT
from operator_panel.page.picture.landmarks_io import reach_radii
from scara_config import load_robot

from scara_description.urdf import link_pose, parse_urdf


def test_reach_is_where_the_tool_comes_to_with_the_elbow_straight_and_bent_most() -> None:
    """By the URDF: another way than the two lengths."""
    robot = load_robot(ROOT / "config")
    model = parse_urdf(robot.description.read_text(encoding="utf-8"))
    home = {joint.name: 0.0 for joint in robot.twin_joints}
    bent = {**home, "joint_2": robot.arm_joints[1].upper}
    expected = [
        math.hypot(*link_pose(model, robot.tool_frame, pose)[:2, 3]) for pose in (home, bent)
    ]
    assert reach_radii(robot) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ("lower", "upper"), [(0.0, 150.0), (-10.0, 150.0), (-120.0, 0.0), (-150.0, 200.0), (20.0, 60.0)]
)
def test_the_inner_ring_is_where_the_tool_comes_nearest(lower: float, upper: float) -> None:
    """By trying, for ranges that are not the same to both sides."""
    robot = load_robot(ROOT / "config")
    ends = {"lower_deg": lower, "upper_deg": upper}
    joints = [
        msgspec.structs.replace(joint, **ends) if joint.name == "joint_2" else joint
        for joint in robot.joints
    ]
    changed = msgspec.structs.replace(robot, joints=tuple(joints))
    assert robot.geometry is not None
    first, second = robot.geometry.l1_mm * 1e-3, robot.geometry.l2_mm * 1e-3
    tried = np.radians(np.linspace(lower, upper, 3501))
    nearest = np.abs(first + second * np.exp(1j * tried)).min()
    assert reach_radii(changed)[1] == pytest.approx(nearest, abs=1e-4)
