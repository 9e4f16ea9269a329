"""The angle between both tools: against scipy, and over moves and rests alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from harness.workspace import ROOT
from scara_config import load_robot
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scipy.spatial.transform import Rotation
from twin_experiments.config import load_experiments, metrics_settings
from twin_experiments.metrics.angles import angle_errors, angles_between
from twin_experiments.metrics.errors import compare
from twin_experiments.metrics.series import Motion

ROBOTS = ROOT / "config" / "robots"
FOUR = load_robot(ROBOTS / "scara_4axis")


@pytest.mark.parametrize("name", ["scara_4axis", "articulated_six", "fanuc_sr6ia"])
def test_angle_is_that_of_the_rotation_between_the_tools(name: str) -> None:
    """Of any arm, from none over the smallest to half a turn."""
    robot = load_robot(ROBOTS / name)
    arm, random = ScrewModel.from_robot(robot), np.random.default_rng(3)
    low, high = np.array([(joint.lower, joint.upper) for joint in robot.arm_joints]).T
    q = random.uniform(low, high, (200, len(low)))
    other = q + np.geomspace(1e-9, 1.0, 200)[:, None] * random.uniform(-1.0, 1.0, q.shape)
    found = angles_between(arm, q, other)
    for one, two, angle in zip(q, other, found):
        turns = [Rotation.from_matrix(forward_kinematics(arm, p)[:3, :3]) for p in (one, two)]
        assert angle == pytest.approx((turns[0].inv() * turns[1]).magnitude(), abs=1e-12)
    assert angles_between(arm, q, q).max() == 0.0


def test_half_a_turn_of_the_wrist_is_half_a_turn_of_the_tool() -> None:
    """And three quarters one way are a quarter the other."""
    arm, q = ScrewModel.from_robot(FOUR), np.zeros((3, 4))
    other = q.copy()
    other[:, 3] = [math.pi, 1.5 * math.pi, -math.pi]
    expected = [math.pi, 0.5 * math.pi, math.pi]
    assert angles_between(arm, q, other) == pytest.approx(expected, abs=1e-7)


def test_moves_and_rests_have_an_angle_each() -> None:
    """The wrist is 2 deg behind while it turns and at rest off by up to 0.5; the place never is."""
    stamps = np.arange(0.0, 4.0, 0.004)
    begun, ended = 1.0, 2.0
    turned = np.clip(stamps - begun, 0.0, ended - begun)
    rate = ((begun <= stamps) & (stamps < ended)).astype(float)
    creeps = 0.5 - 0.2 * np.abs(stamps - 3.0)
    off = np.where(stamps < begun, 0.0, np.where(stamps < ended, 2.0, creeps))

    def side(name: str, wrist: np.ndarray) -> Motion:
        q, qdot = np.zeros((2, len(stamps), 4))
        q[:, 1], q[:, 3], qdot[:, 3] = 1.0, wrist, rate
        return Motion(name, stamps, q, qdot)

    arm = ScrewModel.from_robot(FOUR)
    sides = side("real", turned), side("twin", turned - np.radians(off))
    settings = metrics_settings(load_experiments(FOUR, ROOT / "config").metrics, FOUR)
    place = lambda q: np.array([forward_kinematics(arm, p)[:3, 3] for p in q])  # noqa: E731
    comparison = compare(*sides, place, settings, "real")
    found = angle_errors(comparison, arm)
    assert comparison.path.max_mm == pytest.approx(0.0, abs=1e-9)
    assert found.path_max_deg == pytest.approx(2.0, abs=1e-6)
    assert found.rest_max_deg == pytest.approx(0.5, abs=1e-6)
