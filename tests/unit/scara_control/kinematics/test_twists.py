"""Twists: adjoint, exponential and quaternion, against scipy and against their definitions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scara_control.kinematics.twists import adjoint, exp6, quaternion, skew, twist_matrix
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

TWISTS = arrays(float, 6, elements=st.floats(-4.0, 4.0))


def test_skew_is_the_cross_product():
    """skew(a) b = a x b."""
    a, b = np.array([1.0, -2.0, 3.0]), np.array([0.5, 4.0, -1.0])
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b))


@settings(deadline=None)
@given(TWISTS, st.sampled_from([1.0, 1e-3, 1e-5, 1e-8, 0.0]))
def test_exponential_equals_the_general_matrix_exponential(twist, angle_scale):
    """For turning, screwing and sliding, also where the series takes over at small angles."""
    twist = np.concatenate([twist[:3] * angle_scale, twist[3:]])
    np.testing.assert_allclose(exp6(twist), expm(twist_matrix(twist)), rtol=0.0, atol=1e-12)


def test_exponential_of_a_sliding_joint_is_its_travel():
    """With omega = 0 nothing turns and the travel is exact."""
    expected = np.eye(4)
    expected[:3, 3] = [0.0, 0.0, -0.21]
    np.testing.assert_array_equal(exp6(np.array([0.0, 0.0, 0.0, 0.0, 0.0, -0.21])), expected)


@settings(deadline=None)
@given(TWISTS, TWISTS)
def test_adjoint_carries_a_twist_to_the_fixed_frame(motion, twist):
    """[Ad_T V] = T [V] T^-1."""
    transform = exp6(motion)
    moved = transform @ twist_matrix(twist) @ np.linalg.inv(transform)
    np.testing.assert_allclose(twist_matrix(adjoint(transform) @ twist), moved, atol=1e-10)


@pytest.mark.parametrize(
    "vector",
    [
        (0.0, 0.0, 0.0),
        (math.pi, 0.0, 0.0),
        (0.0, math.pi, 0.0),
        (0.0, 0.0, math.pi),
        (2.1, -2.1, 0.3),
        (1e-9, 0.0, 0.0),
    ],
)
def test_quaternion_turns_as_the_matrix_does(vector):
    """The quaternion is of unit length and stands for the same rotation, half turns included."""
    rotation = Rotation.from_rotvec(vector).as_matrix()
    answer = np.array(quaternion(rotation))
    assert np.linalg.norm(answer) == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(Rotation.from_quat(answer).as_matrix(), rotation, atol=1e-14)


def test_quaternion_has_one_sign():
    """Of q and -q the one with positive w is given, so that equal poses print equally."""
    assert all(
        quaternion(Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix())[3] > 0.0
        for angle in (-3.0, -1.0, 1.0, 3.0)
    )
