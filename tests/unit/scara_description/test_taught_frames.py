"""User and tool frames: taught by points that another library made, and targets in them."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest
from harness.kdl_chain import kdl_pose
from harness.workspace import ROOT
from scara_config.frames import TaughtFrame, load_frames
from scara_config.palletise import load_palletise
from scara_description.taught_frames import (
    FrameError,
    frame_of,
    pose_of,
    tool_frame,
    tool_tip,
    user_frame,
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
        assert pose_of(frame) == pytest.approx(kdl_pose(frame), abs=1e-12)
        back = frame_of("drawn", kdl_pose(frame))
        assert back.xyz_mm == pytest.approx(frame.xyz_mm)
        assert back.wpr_deg == pytest.approx(frame.wpr_deg, abs=1e-6)


@pytest.mark.parametrize("p", [90.0, -90.0])
def test_an_upright_frame_has_the_same_pose_again(p: float) -> None:
    """W and R cannot be told apart there, their pose can."""
    frame = TaughtFrame("upright", (1.0, 2.0, 3.0), (20.0, p, 50.0))
    pose = kdl_pose(frame)
    assert kdl_pose(frame_of("upright", pose)) == pytest.approx(pose, abs=1e-9)


@pytest.mark.parametrize("count", [3, 4])
def test_a_user_frame_is_found_by_points_on_its_axes(count: int) -> None:
    """The third lies anywhere in the plane, on the side of y; a fourth is the origin."""
    random = Random(4)
    for _ in range(100):
        wanted = drawn(random)
        pose, (x, y) = kdl_pose(wanted), (random.uniform(0.05, 0.4) for _ in range(2))
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
        pose = kdl_pose(TaughtFrame("flange", (0.0, 0.0, 0.0), wpr))
        pose[:3, 3] = place - pose[:3, :3] @ tip
        poses.append(pose)
    return poses


def test_a_tip_is_found_by_three_turns() -> None:
    """Of an arm that turns its tool anyhow; an error of a pointer shows."""
    random = Random(5)
    for _ in range(50):
        tip = np.array([random.uniform(-0.1, 0.1) for _ in range(3)])
        poses = touching(random, tip)
        found, spread = tool_tip(poses)
        assert found == pytest.approx(tip, abs=1e-9)
        assert spread < 1e-9
        poses[1][0, 3] += 1e-4
        assert 1e-6 < tool_tip(poses)[1] < 1e-3


def test_what_an_arm_turns_about_the_vertical_alone_tells_nothing_of_the_height() -> None:
    """Its tip beside the axis is found, and along the axis it is that of the flange."""
    found, _ = tool_tip(touching(Random(6), np.array([0.03, -0.02, 0.07]), about_z=True))
    assert found == pytest.approx((0.03, -0.02, 0.0), abs=1e-9)


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
    tool = kdl_pose(wanted)
    poses = touching(random, tool[:3, 3])
    flange = kdl_pose(TaughtFrame("flange", (0.0, 0.0, 0.0), (170.0, 10.0, 30.0)))
    for way in ((0.0, 0.0, 0.0), (0.08, 0.0, 0.0), (0.01, 0.0, 0.06)):
        pose = flange.copy()
        pose[:3, 3] = np.array([0.3, 0.2, 0.1]) + flange[:3, :3] @ tool[:3, :3] @ way
        poses.append(pose)
    assert pose_of(tool_frame("gun", poses)) == pytest.approx(tool, abs=1e-9)


def test_the_shipped_pallet_is_where_its_parts_go() -> None:
    """frames.yaml and palletise.yaml agree."""
    folder = ROOT / "config" / "robots" / "fanuc_sr6ia"
    pallet = load_palletise(folder).pallet
    frame = load_frames(folder).find("user", 1)
    assert frame.xyz_mm == (*pallet.middle_mm, pallet.top_mm)
