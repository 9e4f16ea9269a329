"""What is drawn around the robot, held against its kinematics."""

from __future__ import annotations

import math

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
