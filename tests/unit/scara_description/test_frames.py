"""The frames of /tf are where the robot description says; KDL and the screws agree."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import PyKDL
import pytest
from fanuc_emulator.drives.arm import Arm
from harness.workspace import ROOT
from hypothesis import given
from hypothesis import strategies as st
from scara_config import load_robot
from scara_config.frames import FrameTable, TaughtFrame
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_description.frames import FramePose, Frames, JointStateError, frames_of, taught_poses
from scara_description.ghost import PREFIX, ghost_of
from scara_description.taught_frames import flange_in_tool, pose_of
from scipy.spatial.transform import Rotation

from scara_description.urdf import UrdfError

URDFS = sorted((ROOT / "src" / "scara_description" / "urdf").glob("*.urdf"))
ROBOTS = ("fanuc_sr6ia", "fanuc_sr3ia", "scara_4axis", "articulated_six")
Poses = Mapping[str, FramePose]


def text_of(urdf: Path) -> str:
    """Read a description."""
    return urdf.read_text(encoding="utf-8")


def by_child(poses: Iterable[FramePose]) -> Poses:
    """Return poses by the frame they place; each frame once."""
    poses = list(poses)
    found = {pose.child: pose for pose in poses}
    assert len(found) == len(poses)
    return found


def all_poses(frames: Frames, q: Mapping[str, float]) -> Poses:
    """Return the poses of all frames at ``q``."""
    return by_child([*frames.fixed, *frames.moved(list(q), list(q.values()))])


def matrix(pose: FramePose) -> np.ndarray:
    """Return a pose as a homogeneous transform; scipy reads the quaternion."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_quat(pose.rotation).as_matrix()
    found[:3, 3] = pose.xyz
    return found


def in_root(poses: Poses, frame: str) -> np.ndarray:
    """Follow the frames up to the one that hangs on nothing, as tf does."""
    found = np.eye(4)
    while frame in poses:
        found = matrix(poses[frame]) @ found
        frame = poses[frame].parent
    return found


def random_positions(frames: Frames, seed: int) -> Iterable[dict[str, float]]:
    """Yield joint positions, more than a turn to both sides."""
    generator = np.random.default_rng(seed)
    for _ in range(50):
        yield dict(zip(frames.moving, generator.uniform(-7.0, 7.0, len(frames.moving)).tolist()))


def words(joint: ElementTree.Element, tag: str, key: str, default: str) -> list[float]:
    """Read numbers of a joint as URDF writes them."""
    element = joint.find(tag)
    return [float(word) for word in (default if element is None else element.get(key)).split()]


def kdl_pose(joint: ElementTree.Element, q: float) -> np.ndarray:
    """Place a joint's child in its parent with KDL, from the URDF's words."""
    frame = PyKDL.Frame(
        PyKDL.Rotation.RPY(*words(joint, "origin", "rpy", "0 0 0")),
        PyKDL.Vector(*words(joint, "origin", "xyz", "0 0 0")),
    )
    made = PyKDL.Joint(PyKDL.Joint.Fixed)
    if joint.get("type") != "fixed":
        kind = PyKDL.Joint.TransAxis if joint.get("type") == "prismatic" else PyKDL.Joint.RotAxis
        axis = frame.M * PyKDL.Vector(*words(joint, "axis", "xyz", "1 0 0"))
        made = PyKDL.Joint("q", frame.p, axis, kind)
    pose = PyKDL.Segment(made, frame).pose(q)
    found = np.eye(4)
    found[:3] = [[pose[row, column] for column in range(4)] for row in range(3)]
    return found


def joints_of(text: str) -> list[ElementTree.Element]:
    """Return the joints of a URDF that hold a link."""
    found = ElementTree.fromstring(text).findall("joint")
    assert found
    return found


def child_of(joint: ElementTree.Element) -> str:
    """Return the link that a joint holds."""
    child = joint.find("child")
    assert child is not None
    return child.get("link", "")


def assert_is_as_kdl(text: str, q: Mapping[str, float]) -> None:
    """Compare every frame; quaternions have length 1."""
    poses = all_poses(frames_of(text), q)
    assert set(poses) == {child_of(joint) for joint in joints_of(text)}
    for joint in joints_of(text):
        pose = poses[child_of(joint)]
        expected = kdl_pose(joint, q.get(joint.get("name", ""), 0.0))
        np.testing.assert_allclose(matrix(pose), expected, atol=1e-12)
        assert np.linalg.norm(pose.rotation) == pytest.approx(1.0, abs=1e-14)


def two_links(joint: str, kind: str = "continuous") -> str:
    """Write a description of two links and the joint between them."""
    return (
        '<robot name="r"><link name="a"/><link name="b"/>'
        f'<joint name="j" type="{kind}"><parent link="a"/><child link="b"/>{joint}</joint></robot>'
    )


@pytest.mark.parametrize("urdf", URDFS, ids=lambda path: path.stem)
def test_every_frame_is_where_kdl_puts_it(urdf: Path) -> None:
    """All links of all robots, twin and ghost, at random positions."""
    for text in (text_of(urdf), ghost_of(text_of(urdf))):
        for q in random_positions(frames_of(text), 11):
            assert_is_as_kdl(text, q)


Numbers = st.tuples(*3 * [st.floats(-3.2, 3.2)])


@given(
    kind=st.sampled_from(("revolute", "continuous", "prismatic")),
    xyz=Numbers,
    rpy=Numbers,
    axis=Numbers.filter(lambda axis: np.linalg.norm(axis) > 0.01),
    q=st.floats(-10.0, 10.0),
)
def test_joint_of_any_place_and_direction_is_where_kdl_puts_it(
    kind: str, xyz: tuple[float, ...], rpy: tuple[float, ...], axis: tuple[float, ...], q: float
) -> None:
    """Also where the axis is written with another length than 1."""
    numbers = (" ".join(map(repr, values)) for values in (xyz, rpy, axis))
    text = two_links('<origin xyz="{}" rpy="{}"/><axis xyz="{}"/>'.format(*numbers), kind)
    assert_is_as_kdl(text, {"j": q})


@pytest.mark.parametrize("name", ROBOTS)
def test_tool_is_where_the_screws_of_the_profile_put_it(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What RViz shows and what the kinematics compute is one robot, the ghost too."""
    monkeypatch.setenv("SCARA_ROBOT", name)
    robot = load_robot(ROOT / "config")
    arm, text = ScrewModel.from_robot(robot), text_of(robot.description)
    for frames, prefix in ((frames_of(text), ""), (frames_of(ghost_of(text)), PREFIX)):
        for q in random_positions(frames, 12):
            tool = in_root(all_poses(frames, q), prefix + robot.tool_frame)
            joints = np.array([q[joint.name] for joint in robot.arm_joints])
            np.testing.assert_allclose(tool, forward_kinematics(arm, joints), atol=1e-9)


def test_twin_and_ghost_hang_on_one_frame_and_share_no_other() -> None:
    """One tree for tf: no frame has two parents."""
    text = text_of(ROOT / "src" / "scara_description" / "urdf" / "scara_cell.urdf")
    twin, real = (
        all_poses(frames, dict.fromkeys(frames.moving, 0.0))
        for frames in (frames_of(text), frames_of(ghost_of(text)))
    )
    assert not set(twin) & set(real)
    assert {pose.parent for pose in twin.values()} & {pose.parent for pose in real.values()} == {
        "base_link"
    }


def test_state_of_some_joints_moves_their_links_alone() -> None:
    """A table may be told by another node than the arm."""
    frames = frames_of(text_of(ROOT / "src" / "scara_description" / "urdf" / "scara_cell.urdf"))
    assert [pose.child for pose in frames.moved(("table_joint", "joint_1"), (0.1, 0.2))] == [
        "table_link",
        "link_1",
    ]


@pytest.mark.parametrize(
    ("names", "positions", "why"),
    [
        (["j"], [], "1 joint names have 0 positions"),
        (["j", "k"], [0.0, 0.0], "no moving joint 'k': there are j"),
        (["j"], [float("nan")], "j = nan: must be finite"),
        (["j"], [float("inf")], "j = inf: must be finite"),
    ],
)
def test_state_that_does_not_fit_is_refused(
    names: list[str], positions: list[float], why: str
) -> None:
    """A tf listener would take a NaN and lose the frame without a word."""
    with pytest.raises(JointStateError, match=why):
        frames_of(two_links("")).moved(names, positions)


@pytest.mark.parametrize("name", ["scara_4axis", "articulated_six"])
def test_taught_frames_are_shown_where_the_robots_controller_has_them(name: str) -> None:
    """A tool by the stand-in's flange, which on a SCARA is turned otherwise than tool0."""
    robot = load_robot(ROOT / "config" / "robots" / name)
    box = TaughtFrame("box", (200.0, -300.0, 50.0), (0.0, 0.0, 30.0))
    pin = TaughtFrame("pin", (40.0, 10.0, 60.0), (10.0, 20.0, 30.0))
    table = FrameTable({"uframe_1": box}, {"utool_2": pin})
    user, tool = taught_poses(table, "base_link", "tool0", flange_in_tool(robot))
    assert (user.parent, user.child) == ("base_link", "uframe_1")
    assert (tool.parent, tool.child) == ("tool0", "utool_2")
    assert matrix(user) == pytest.approx(pose_of(box), abs=1e-12)
    for q in np.random.default_rng(13).uniform(-1.0, 1.0, (20, len(robot.arm_joints))):
        shown = forward_kinematics(ScrewModel.from_robot(robot), q) @ matrix(tool)
        assert shown == pytest.approx(Arm(robot).pose(q) @ pose_of(pin), abs=1e-12)


def test_shapes_do_not_matter() -> None:
    """RViz shows meshes; the operator page, which reads the same files, does not."""
    mesh = '<link name="a"><visual><geometry><mesh filename="x"/></geometry></visual></link>'
    text = two_links("").replace('<link name="a"/>', mesh)
    assert [pose.child for pose in frames_of(text).moved(["j"], [0.0])] == ["b"]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("<robot", "no XML"),
        ('<robot name="r"><link name="a"/><link name="b"/></robot>', "no tree"),
        ('<robot name="r"/>', "no tree"),
        (two_links("", "floating"), "joint j is floating: it must be one of fixed, revolute"),
        (two_links('<axis xyz="0 0 0"/>'), "axis of joint j has no direction: 0 0 0"),
        (two_links('<axis xyz="nan 0 0"/>'), "axis of joint j has no direction: nan 0 0"),
    ],
)
def test_description_without_frames_is_refused(text: str, why: str) -> None:
    """The node ends with this text."""
    with pytest.raises(UrdfError, match=why):
        frames_of(text)
