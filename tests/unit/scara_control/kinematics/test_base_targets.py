"""Targets in user frames and for tool frames, by another library's kinematics."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from harness.kdl_chain import KdlChain, kdl_pose
from harness.workspace import ROOT
from operator_panel.config import ToolSpeeds
from operator_panel.control.frame_lessons import LESSONS, taught
from operator_panel.control.tool_jog import ToolArm
from scara_config import ConfigError, load_robot
from scara_config.frames import FrameTable, TaughtFrame
from scara_control.kinematics.base_targets import BaseTargetError, BaseTargets
from scara_control.kinematics.tool import tool_kinematics

from scara_description.urdf import parse_urdf

ROBOTS = {
    name: load_robot(ROOT / "config" / "robots" / name)
    for name in ("fanuc_sr6ia", "scara_4axis", "articulated_six")
}
TABLE = FrameTable(
    {
        "uframe_1": TaughtFrame("box", (200.0, -300.0, 50.0), (0.0, 0.0, 30.0)),
        "uframe_2": TaughtFrame("tilted", (0.0, 0.0, 0.0), (5.0, 0.0, 0.0)),
    },
    {
        "utool_1": TaughtFrame("pin", (0.0, 0.0, 60.0)),
        "utool_2": TaughtFrame("arm", (40.0, 10.0, 60.0)),
    },
)


@pytest.mark.parametrize("name", ["scara_4axis", "articulated_six"])
@pytest.mark.parametrize("turned", [None, 0.4])
def test_the_tip_comes_to_the_place_in_the_frame(name: str, turned: float | None) -> None:
    """By another library's kinematics of the arm, the frame and the tool; kept turn or a yaw."""
    robot = ROBOTS[name]
    tool = tool_kinematics(robot)
    chain = KdlChain(tool.joints, robot.home_pose)
    seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
    if name == "scara_4axis":
        seed = tool.inverse(0.35, -0.05, 0.1, None, seed, 0.7).chosen.q
    here = np.array(tool.position(seed))
    frame = kdl_pose(TABLE.find("user", 1))
    point = frame[:3, :3].T @ (here + [0.02, 0.03, -0.08] - frame[:3, 3])
    targets = BaseTargets(robot, tool)
    target, yaw = targets.in_base(TABLE, tuple(point), turned, (1, 2), seed)
    q = tool.inverse(*target, None, seed, yaw).chosen.q
    flange = np.vstack([chain.pose(q), [0, 0, 0, 1]])
    if name == "scara_4axis":
        # A SCARA's flange is turned as its maker counts it: about z by the sum of its joints.
        turn = tool.yaw(q)
        turned_so = TaughtFrame("f", (0.0, 0.0, 0.0), (180.0, 0.0, math.degrees(turn)))
        flange[:3, :3] = kdl_pose(turned_so)[:3, :3]
    tip = (np.linalg.inv(frame) @ flange @ kdl_pose(TABLE.find("tool", 2)))[:3, 3]
    assert tip == pytest.approx(point, abs=1e-6)
    if turned is not None and name == "scara_4axis":
        assert math.remainder(tool.yaw(q) - math.radians(30.0) - turned, math.tau) == pytest.approx(
            0
        )


def test_what_has_no_meaning_for_the_arm_is_refused() -> None:
    """A tip beside the flange of an arm without a wrist, a yaw in a tilted frame, no such frame."""
    robot = ROBOTS["fanuc_sr6ia"]
    tool = tool_kinematics(robot)
    targets = BaseTargets(robot, tool)
    seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
    point = (0.1, 0.1, 0.1)
    with pytest.raises(BaseTargetError, match="tool frame 2 is beside the flange"):
        targets.in_base(TABLE, point, None, (0, 2), seed)
    place, _ = targets.in_base(TABLE, point, None, (0, 1), seed)
    assert place == pytest.approx((0.1, 0.1, 0.16))
    with pytest.raises(BaseTargetError, match="user frame 2 is tilted"):
        targets.in_base(TABLE, point, 0.1, (2, 0), seed)
    with pytest.raises(
        ConfigError, match=r"user frame 3 was never taught: frames.yaml has 1 \(box\)"
    ):
        targets.in_base(TABLE, point, None, (3, 0), seed)


@pytest.mark.parametrize("joints", [4, 5])
def test_a_tip_before_a_flange_that_leans_is_refused(joints: int) -> None:
    """Such an arm turns its tool as it may: the tip would come to another place."""
    six = ROBOTS["articulated_six"]
    robot = msgspec.structs.replace(six, joints=six.joints[:joints])
    tool = tool_kinematics(robot)
    seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
    targets = BaseTargets(robot, tool)
    with pytest.raises(BaseTargetError, match="before the flange, and this arm cannot turn"):
        targets.in_base(TABLE, (0.3, 0.25, 0.3), None, (0, 1), seed)
    assert targets.in_base(TABLE, (0.3, 0.25, 0.3), None, (0, 0), seed) == ((0.3, 0.25, 0.3), None)


def test_a_tip_before_a_flange_that_cannot_lean_is_where_the_flange_points() -> None:
    """An arm solved by numbers whose joints all turn about the vertical: no turn moves that tip."""
    sr6ia = ROBOTS["fanuc_sr6ia"]
    robot = msgspec.structs.replace(sr6ia, geometry=None)
    tool = tool_kinematics(robot)
    assert not tool.turns
    seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
    targets = BaseTargets(robot, tool)
    for point in ((0.1, 0.1, 0.1), (0.3, -0.1, 0.2)):
        expected, _ = BaseTargets(sr6ia, tool).in_base(TABLE, point, None, (0, 1), seed)
        place, yaw = targets.in_base(TABLE, point, None, (0, 1), seed)
        assert place == pytest.approx(expected) and yaw is None


@pytest.mark.parametrize("name", ["scara_4axis", "epson_gx4"])
def test_a_tool_that_was_taught_on_the_page_is_used_as_it_was_taught(name: str) -> None:
    """The real tip, fixed to the last link, comes to the place, whatever the tool is turned by."""
    robot = load_robot(ROOT / "config" / "robots" / name)
    tool = tool_kinematics(robot)
    chain = KdlChain(tool.joints, robot.home_pose)
    seed = [robot.home[joint.name] * joint.scale for joint in tool.joints]
    # By tool0; turned about the vertical alone, a tool does not tell its height.
    tip = np.array([0.03, -0.02, 0.0])
    touched = np.array([0.7e-3 * robot.reach_mm, 0.05, 0.1])
    speeds = ToolSpeeds(slow_mm_s=1.0, fast_mm_s=2.0, slow_deg_s=1.0, fast_deg_s=2.0)
    arm = ToolArm(robot, parse_urdf(robot.description.read_text("utf-8")), speeds, 10.0)
    poses = []
    for yaw in (0.0, 1.0, -1.0):
        turned = chain.pose(tool.inverse(*touched, None, seed, yaw).chosen.q)[:, :3]
        q = tool.inverse(*(touched - turned @ tip), None, seed, yaw).chosen.q
        poses.append(arm.flange({joint.name: each for joint, each in zip(tool.joints, q)}))
    table = FrameTable({}, {"utool_1": taught(LESSONS["tool_3"], "pin", poses)})
    point = (0.6e-3 * robot.reach_mm, -0.05, 0.08)
    target, yaw = BaseTargets(robot, tool).in_base(table, point, 0.4, (0, 1), seed)
    pose = chain.pose(tool.inverse(*target, None, seed, yaw).chosen.q)
    assert pose[:, :3] @ tip + pose[:, 3] == pytest.approx(point, abs=1e-6)
