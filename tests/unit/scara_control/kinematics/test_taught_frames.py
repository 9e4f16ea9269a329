"""User and tool frames: taught by points that another library made, and targets in them."""

from __future__ import annotations

import math
from random import Random

import numpy as np
import PyKDL
import pytest
from harness.kdl_chain import KdlChain
from harness.workspace import ROOT
from scara_config import ConfigError, load_robot
from scara_config.frames import FrameTable, TaughtFrame, load_frames
from scara_config.palletise import load_palletise
from scara_control.kinematics.taught_frames import (
    BaseTargets,
    FrameError,
    frame_of,
    pose_of,
    tool_frame,
    tool_tip,
    user_frame,
)
from scara_control.kinematics.tool import tool_kinematics

ROBOTS = {
    name: load_robot(ROOT / "config" / "robots" / name)
    for name in ("fanuc_sr6ia", "scara_4axis", "articulated_six")
}


def kdl(frame: TaughtFrame) -> np.ndarray:
    """Return a frame's pose by another library, shape (4, 4) [m]."""
    w, p, r = map(math.radians, frame.wpr_deg)
    made = PyKDL.Frame(PyKDL.Rotation.RPY(w, p, r), PyKDL.Vector(*[1e-3 * x for x in frame.xyz_mm]))
    return np.array(
        [[made[row, column] for column in range(4)] for row in range(3)] + [[0, 0, 0, 1]]
    )


def drawn(random: Random) -> TaughtFrame:
    """Return a frame anywhere, turned anyhow."""
    xyz = tuple(random.uniform(-500.0, 500.0) for _ in range(3))
    wpr = random.uniform(-180.0, 180.0), random.uniform(-89.0, 89.0), random.uniform(-180.0, 180.0)
    return TaughtFrame("drawn", xyz, wpr)


def test_a_pose_is_that_of_another_library_and_back() -> None:
    """W, P, R about fixed axes."""
    random = Random(3)
    for frame in (drawn(random) for _ in range(200)):
        assert pose_of(frame) == pytest.approx(kdl(frame), abs=1e-12)
        back = frame_of("drawn", kdl(frame))
        assert back.xyz_mm == pytest.approx(frame.xyz_mm)
        assert back.wpr_deg == pytest.approx(frame.wpr_deg, abs=1e-6)


@pytest.mark.parametrize("p", [90.0, -90.0])
def test_an_upright_frame_has_the_same_pose_again(p: float) -> None:
    """W and R cannot be told apart there, their pose can."""
    frame = TaughtFrame("upright", (1.0, 2.0, 3.0), (20.0, p, 50.0))
    assert kdl(frame_of("upright", kdl(frame))) == pytest.approx(kdl(frame), abs=1e-9)


@pytest.mark.parametrize("count", [3, 4])
def test_a_user_frame_is_found_by_points_on_its_axes(count: int) -> None:
    """The third lies anywhere in the plane, on the side of y; a fourth is the origin."""
    random = Random(4)
    for _ in range(100):
        wanted = drawn(random)
        pose, (x, y) = kdl(wanted), (random.uniform(0.05, 0.4) for _ in range(2))
        shift = np.array([0.03, 0.04, 0.05]) if count == 4 else np.zeros(3)
        places = [(0, 0, 0), (x, 0, 0), (random.uniform(-0.2, 0.2), y, 0)]
        points = [pose[:3, :3] @ place + pose[:3, 3] + shift for place in places]
        found = user_frame("found", points + [pose[:3, 3]] * (count - 3))
        assert pose_of(found) == pytest.approx(pose, abs=1e-9)


@pytest.mark.parametrize(
    ("points", "why"),
    [
        ([(0, 0, 0), (0.1, 0, 0)], "2 points: a user frame is taught by three or four"),
        ([(0, 0, 0), (0.005, 0, 0), (0, 0.1, 0)], "the point for x is 5.0 mm off"),
        ([(0, 0, 0), (0.1, 0, 0), (0.2, 0.004, 0)], "the point for y is 4.0 mm off"),
    ],
)
def test_points_that_make_no_frame_are_refused(points, why: str) -> None:
    """With how far they are off."""
    with pytest.raises(FrameError, match=why):
        user_frame("bad", points)


def touching(random: Random, tip: np.ndarray, about_z: bool = False) -> list[np.ndarray]:
    """Return three poses of the flange with the same tip at one place."""
    place, poses = np.array([0.4, 0.1, 0.2]), []
    for k in range(3):
        wpr = (180.0, 0.0, 40.0 * k)
        if not about_z:
            wpr = (180.0 + random.uniform(-30, 30) + 30 * k, 25.0 * k, random.uniform(-90, 90))
        pose = kdl(TaughtFrame("flange", (0.0, 0.0, 0.0), wpr))
        pose[:3, 3] = place - pose[:3, :3] @ tip
        poses.append(pose)
    return poses


def test_a_tip_is_found_by_three_turns() -> None:
    """Of an arm that turns its tool anyhow; an error of a pointer shows."""
    random = Random(5)
    for _ in range(50):
        tip = np.array([random.uniform(-0.1, 0.1) for _ in range(3)])
        poses = touching(random, tip)
        found = tool_tip(poses)
        assert 1e-3 * np.array(found.xyz_mm) == pytest.approx(tip, abs=1e-9)
        assert found.spread_mm < 1e-6
        poses[1][0, 3] += 1e-4
        assert 1e-3 < tool_tip(poses).spread_mm < 1.0


def test_what_an_arm_turns_about_the_vertical_alone_tells_nothing_of_the_height() -> None:
    """Its tip beside the axis is found, and along the axis it is that of the flange."""
    found = tool_tip(touching(Random(6), np.array([0.03, -0.02, 0.07]), about_z=True))
    assert found.xyz_mm == pytest.approx((30.0, -20.0, 0.0), abs=1e-6)


def test_tips_that_do_not_meet_and_flanges_that_hardly_turn_are_refused() -> None:
    """With how far."""
    poses = touching(Random(7), np.array([0.03, 0.0, 0.1]))
    poses[2][2, 3] += 0.02
    with pytest.raises(FrameError, match=r"the tips are .* mm apart, allowed are 2"):
        tool_tip(poses)
    with pytest.raises(FrameError, match="point 2 is turned by less than 20 deg"):
        tool_tip([poses[0]] * 3)
    with pytest.raises(FrameError, match="4 points: a tool frame is taught by three or six"):
        tool_frame("bad", [*poses, poses[0]])


def test_six_points_turn_the_tool_frame_too() -> None:
    """Place, along x, along z: whatever the flange is turned as meanwhile."""
    random = Random(8)
    wanted = TaughtFrame("gun", (30.0, -20.0, 110.0), (20.0, -35.0, 70.0))
    tool = kdl(wanted)
    poses = touching(random, tool[:3, 3])
    flange = kdl(TaughtFrame("flange", (0.0, 0.0, 0.0), (170.0, 10.0, 30.0)))
    for way in ((0.0, 0.0, 0.0), (0.08, 0.0, 0.0), (0.01, 0.0, 0.06)):
        pose = flange.copy()
        pose[:3, 3] = np.array([0.3, 0.2, 0.1]) + flange[:3, :3] @ tool[:3, :3] @ way
        poses.append(pose)
    assert pose_of(tool_frame("gun", poses)) == pytest.approx(tool, abs=1e-9)


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
    frame = kdl(TABLE.find("user", 1))
    point = frame[:3, :3].T @ (here + [0.02, 0.03, -0.08] - frame[:3, 3])
    targets = BaseTargets(robot, tool)
    target, yaw = targets.in_base(TABLE, tuple(point), turned, (1, 2), seed)
    q = tool.inverse(*target, None, seed, yaw).chosen.q
    flange = np.vstack([chain.pose(q), [0, 0, 0, 1]])
    if name == "scara_4axis":
        # A SCARA's flange is turned as its maker counts it: about z by the sum of its joints.
        turn = tool.yaw(q)
        flange[:3, :3] = kdl(TaughtFrame("f", (0.0, 0.0, 0.0), (180.0, 0.0, math.degrees(turn))))[
            :3, :3
        ]
    tip = (np.linalg.inv(frame) @ flange @ kdl(TABLE.find("tool", 2)))[:3, 3]
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
    with pytest.raises(FrameError, match="tool frame 2 is beside the flange"):
        targets.in_base(TABLE, point, None, (0, 2), seed)
    found = targets.in_base(TABLE, point, None, (0, 1), seed)
    assert found.point == pytest.approx((0.1, 0.1, 0.16))
    with pytest.raises(FrameError, match="user frame 2 is tilted"):
        targets.in_base(TABLE, point, 0.1, (2, 0), seed)
    with pytest.raises(
        ConfigError, match=r"user frame 3 was never taught: frames.yaml has 1 \(box\)"
    ):
        targets.in_base(TABLE, point, None, (3, 0), seed)


def test_the_shipped_pallet_is_where_its_parts_go() -> None:
    """frames.yaml and palletise.yaml agree."""
    folder = ROOT / "config" / "robots" / "fanuc_sr6ia"
    pallet = load_palletise(folder).pallet
    frame = load_frames(folder).find("user", 1)
    assert frame.xyz_mm == (*pallet.middle_mm, pallet.top_mm)
