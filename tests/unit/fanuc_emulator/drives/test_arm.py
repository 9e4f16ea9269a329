"""The robot's own kinematics by other routes: exponentials, closed forms, differences, scipy."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from fanuc_emulator.drives.arm import (
    CLEAR,
    SINGULAR,
    Arm,
    Matrix,
    inverse,
    rotation_vector,
    turned_by,
)
from fanuc_emulator.drives.planner import matrix, numbers_of
from harness.workspace import ROOT
from scara_config import Robot, load_robot
from scara_config.programs.tp.values import Pose
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

ROBOTS = ROOT / "config" / "robots"
SCARA, SIX = load_robot(ROBOTS / "fanuc_sr6ia"), load_robot(ROBOTS / "articulated_six")
BOTH = pytest.mark.parametrize("robot", [SCARA, SIX], ids=lambda robot: robot.name)


def drawn(robot: Robot, count: int = 8) -> list[np.ndarray]:
    """Return joint positions of the arm throughout its ranges [rad or m]."""
    low, high = np.array([(j.lower, j.upper) for j in robot.joints if j.screw_axis]).T
    return list(np.random.default_rng(4).uniform(low, high, (count, len(low))))


def pose_of(x: float, y: float, z: float, w: float, p: float, r: float) -> Matrix:
    """Return a transform by scipy: turned about the fixed X, Y and Z in this order [mm, deg]."""
    found = np.eye(4)
    found[:3, :3] = Rotation.from_euler("xyz", [w, p, r], degrees=True).as_matrix()
    found[:3, 3] = np.array([x, y, z]) * 1e-3
    return found


def test_the_flange_of_a_scara_looks_down_and_turns_by_the_sum_of_its_joints() -> None:
    """Place by the law of the two links, R = J1 + J2 + J4 as its maker counts it."""
    arm, shape = Arm(SCARA), SCARA.geometry
    assert shape is not None
    for q in drawn(SCARA):
        x = shape.l1_mm * math.cos(q[0]) + shape.l2_mm * math.cos(q[0] + q[1])
        y = shape.l1_mm * math.sin(q[0]) + shape.l2_mm * math.sin(q[0] + q[1])
        r = math.degrees(q[0] + q[1] + q[3])
        assert arm.pose(q) == pytest.approx(
            pose_of(x, y, shape.h_mm + 1e3 * q[2], 180.0, 0.0, r), abs=1e-12
        )


def test_the_pose_is_the_product_of_exponentials() -> None:
    """Lynch & Park, sec. 4.1, by scipy's matrix exponential; the home pose is as it is filed."""
    arm = Arm(SIX)
    for q in drawn(SIX):
        wanted = np.eye(4)
        for joint, theta in zip(SIX.joints, q):
            x, y, z, *v = joint.screw_axis or ()
            twist = np.array([[0, -z, y, v[0]], [z, 0, -x, v[1]], [-y, x, 0, v[2]], [0, 0, 0, 0]])
            wanted = wanted @ expm(theta * twist)
        assert arm.pose(q) == pytest.approx(wanted @ np.array(SIX.home_pose), abs=1e-12)


def twist_between(before: Matrix, after: Matrix) -> np.ndarray:
    """Return the twist in the base that leads from a pose to one very near."""
    change = (after - before) @ np.linalg.inv(0.5 * (after + before))
    return np.array([change[2, 1], change[0, 2], change[1, 0], *change[:3, 3]])


@BOTH
def test_the_jacobian_is_how_the_pose_changes(robot: Robot) -> None:
    """By differences, joint by joint."""
    arm, h = Arm(robot), 1e-6
    for q in drawn(robot):
        steps = h * np.eye(len(q))
        found = [twist_between(arm.pose(q - e), arm.pose(q + e)) / (2.0 * h) for e in steps]
        assert arm.jacobian(q) == pytest.approx(np.array(found).T, abs=1e-8)


@BOTH
def test_an_arm_is_singular_by_its_reach_and_not_by_its_size(robot: Robot) -> None:
    """One ten times as large is singular in the same places: where the bend all but vanishes."""

    def larger(joint: object) -> object:
        screw = getattr(joint, "screw_axis", None)
        if screw is None or not any(screw[:3]):
            return joint
        return msgspec.structs.replace(joint, screw_axis=(*screw[:3], *(10 * v for v in screw[3:])))

    replace = msgspec.structs.replace
    big = replace(robot, joints=tuple(map(larger, robot.joints)), reach_mm=10.0 * robot.reach_mm)
    bent = 1 if robot is SCARA else 4
    q = drawn(robot)[0]
    seen = []
    for angle in np.linspace(0.0, 0.15, 40):
        q[bent] = angle
        jacobian = Arm(robot).jacobian(q)
        scaled = jacobian / np.array([[1.0]] * 3 + [[robot.reach_mm * 1e-3]] * 3)
        seen.append(bool(np.linalg.svd(scaled)[1][-1] < SINGULAR))
        assert Arm(robot).singular(jacobian) is seen[-1]
        if robot is SIX:
            assert Arm(big).singular(Arm(big).jacobian(q)) is seen[-1]
    assert seen[0] and not seen[-1]


@pytest.mark.parametrize("way", range(6))
def test_a_direction_is_lost_below_the_limit_and_not_above(way: int) -> None:
    """Turns about each axis count in rad, ways along each by the reach."""
    arm = Arm(SIX)
    sound = np.diag([1.0] * 3 + [SIX.reach_mm * 1e-3] * 3)
    for share, lost in ((0.9998, True), (1.0002, False)):
        weak = sound.copy()
        weak[way, way] *= share * SINGULAR
        assert arm.singular(weak) is lost
        weak[way, way] *= CLEAR
        assert arm.clear(np.array([sound, weak])) is (not lost)


@pytest.mark.parametrize(
    ("robot", "place"),
    [
        (SCARA, (0.7, 0.0, 0.1, 180.0, 0.0, 0.0)),
        (SCARA, (0.4, 0.2, 0.1, 175.0, 0.0, 0.0)),
        (SIX, (0.9, 0.0, 0.3, 0.0, 90.0, 0.0)),
    ],
)
def test_a_pose_that_no_joint_positions_have_has_none(
    robot: Robot, place: tuple[float, ...]
) -> None:
    """Out of reach, tilted: the nearest that it can come to is no answer."""
    pose = pose_of(*(1e3 * each for each in place[:3]), *place[3:])
    for guess in drawn(robot):
        assert Arm(robot).solve(pose, guess) is None


TURNS = [
    *Rotation.random(12, random_state=np.random.RandomState(2)).as_rotvec(),
    *(angle * np.array([0.6, 0.0, -0.8]) for angle in (0.0, 1e-13, 1e-10, 1e-8, 1e-4, 1.0, 3.1)),
    *(1e-8 * each for each in np.eye(3)),
]
HALF_TURNS = [math.pi * np.array(axis) for axis in ((1, 0, 0), (0, -1, 0), (0, 0.6, 0.8))]


@pytest.mark.parametrize("vector", [*TURNS, *HALF_TURNS])
def test_rotations_and_their_vectors_are_those_of_scipy(vector: np.ndarray) -> None:
    """Small ones and half turns too; of a half turn either sense is right."""
    turn = Rotation.from_rotvec(vector).as_matrix()
    assert turned_by(vector) == pytest.approx(turn, abs=1e-12)
    found = rotation_vector(turn)
    if np.linalg.norm(vector) < 3.14:
        assert found == pytest.approx(vector, abs=1e-9, rel=1e-6)
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(vector), rel=1e-6, abs=1e-9)
    assert turned_by(found) == pytest.approx(turn, abs=1e-8)


@pytest.mark.parametrize(
    "place", [(400, -120, 35, 180, 0, 30), (1, 2, 3, 25, -40, 110), (-7, 8, -9, -170, 80, -5)]
)
def test_x_y_z_w_p_r_are_read_and_shown_as_the_maker_counts_them(place: tuple[float, ...]) -> None:
    """Turned by W about X, then P about Y, then R about Z of the frame; and the way back."""
    pose = pose_of(*place)
    assert matrix(Pose((*map(float, place), 0.0, 0.0, 0.0))) == pytest.approx(pose, abs=1e-12)
    assert numbers_of(pose) == pytest.approx(place, abs=1e-9)
    assert inverse(pose) == pytest.approx(np.linalg.inv(pose), abs=1e-12)
