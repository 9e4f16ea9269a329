"""The turn of a tool is told as the robot's own display tells it."""

from __future__ import annotations

import math

import pytest
from harness.workspace import ROOT
from operator_panel.view.words import turn_text
from scara_config import load_robot

from scara_description.urdf import link_pose, origin_transform, parse_urdf


def test_scara_shows_the_sum_of_its_joints() -> None:
    """The reading of a real SR-6iA, without joint 4, which the twin has not: R = J1 + J2."""
    robot = load_robot(ROOT / "config")
    model = parse_urdf(robot.description.read_text(encoding="utf-8"))
    joints = {"joint_1": math.radians(19.62), "joint_2": math.radians(79.60), "joint_3": -0.018}
    home = link_pose(model, robot.tool_frame, {})[:3, :3]
    now = link_pose(model, robot.tool_frame, joints)[:3, :3]
    assert turn_text(home, now) == "R 99.2 deg"
    assert turn_text(home, home) == "R 0.0 deg"


@pytest.mark.parametrize(("w", "p", "r"), [(10.0, -20.0, 30.0), (-170.0, 45.0, -90.0)])
def test_tool_of_a_wrist_is_told_by_three_turns_about_fixed_axes(
    w: float, p: float, r: float
) -> None:
    """X first, then y, then z of the base."""
    nowhere = (0.0, 0.0, 0.0)
    home = origin_transform(nowhere, (0.3, -1.2, 0.4))[:3, :3]
    turn = origin_transform(nowhere, tuple(map(math.radians, (w, p, r))))[:3, :3]  # type: ignore[arg-type]
    text = f"W {w:.1f}  P {p:.1f}  R {r:.1f} deg"
    assert turn_text(home, turn @ home) == text.replace("-", "\N{MINUS SIGN}")
