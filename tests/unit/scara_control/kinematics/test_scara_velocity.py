"""Velocity kinematics of the SCARA: exact away from the straight arm, damped near it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import load_robot
from scara_control.errors import JointVectorError
from scara_control.kinematics.jacobians import tip_jacobian
from scara_control.kinematics.scara import Scara, tool_position
from scara_control.kinematics.scara_velocity import (
    DAMPED_BELOW,
    DAMPING,
    joint_velocities,
    planar_jacobian,
    tool_velocity,
)
from scara_control.kinematics.screws import ScrewModel

ROBOT = load_robot()
SCARA = Scara.from_robot(ROBOT)
ARM = ScrewModel.from_robot(ROBOT)
ANGLE = st.floats(-2.5, 2.5)
SPEED = st.floats(-2.0, 2.0)
ONSET = math.asin(DAMPED_BELOW)


@settings(deadline=None)
@given(ANGLE, ANGLE, SPEED, SPEED, SPEED)
def test_tool_velocity_is_the_difference_quotient_of_the_position(q1, q2, w1, w2, up):
    """The velocity is dp/dt, and the screw model's tip Jacobian says the same."""
    dt = 1e-6
    after = tool_position(SCARA, q1 + w1 * dt, q2 + w2 * dt, up * dt)
    before = tool_position(SCARA, q1 - w1 * dt, q2 - w2 * dt, -up * dt)
    velocity = tool_velocity(SCARA, (q1, q2, 0.0), (w1, w2, up))
    np.testing.assert_allclose(velocity, np.subtract(after, before) / (2.0 * dt), atol=1e-8)
    np.testing.assert_allclose(
        velocity, (tip_jacobian(ARM, [q1, q2, 0.0]) @ [w1, w2, up])[3:], atol=1e-14
    )


@settings(deadline=None)
@given(ANGLE, st.floats(ONSET * 1.001, 2.6), SPEED, SPEED, SPEED)
def test_bent_arm_reaches_the_wanted_velocity_exactly(q1, q2, vx, vy, vz):
    """Round trip through both directions; no damping is reported."""
    answer = joint_velocities(SCARA, (q1, q2, 0.0), (vx, vy, vz))
    np.testing.assert_allclose(
        tool_velocity(SCARA, (q1, q2, 0.0), answer.qdot), (vx, vy, vz), atol=1e-12
    )
    assert not answer.damped
    assert answer.manipulability == pytest.approx(
        abs(np.linalg.det(planar_jacobian(SCARA, (q1, q2, 0.0)))), abs=1e-15
    )


@settings(deadline=None)
@given(ANGLE, st.floats(-ONSET * 0.999, ONSET * 0.999), SPEED, SPEED)
def test_nearly_straight_arm_is_damped_and_bounded(q1, q2, vx, vy):
    """Damped least squares, checked against the matrix formula; damping is reported."""
    answer = joint_velocities(SCARA, (q1, q2, 0.0), (vx, vy, 0.0))
    jacobian = np.array(planar_jacobian(SCARA, (q1, q2, 0.0)))
    weight = DAMPING * (1.0 - abs(math.sin(q2)) / DAMPED_BELOW)
    expected = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + weight**2 * np.eye(2), [vx, vy])
    np.testing.assert_allclose(answer.qdot[:2], expected, rtol=1e-6, atol=1e-9)
    assert answer.damped


def test_straight_arm_gives_no_speed_along_itself():
    """At P1 the tool cannot leave radially; the sideways part is kept within a few thousandths."""
    along = joint_velocities(SCARA, (0.0, 0.0, 0.0), (0.5, 0.0, 0.1))
    assert along.qdot == pytest.approx((0.0, 0.0, 0.1))
    assert along.manipulability == 0.0 and along.damped
    across = joint_velocities(SCARA, (0.0, 0.0, 0.0), (0.0, 0.5, 0.0))
    assert tool_velocity(SCARA, (0.0, 0.0, 0.0), across.qdot) == pytest.approx(
        (0.0, 0.5, 0.0), rel=2e-3
    )


def test_damping_sets_in_without_a_jump():
    """The joint velocities are continuous where damping begins."""
    inside = joint_velocities(SCARA, (0.2, ONSET * (1 - 1e-7), 0.0), (0.1, 0.2, 0.0))
    outside = joint_velocities(SCARA, (0.2, ONSET * (1 + 1e-7), 0.0), (0.1, 0.2, 0.0))
    assert inside.damped and not outside.damped
    np.testing.assert_allclose(inside.qdot, outside.qdot, rtol=1e-5)


@pytest.mark.parametrize(
    ("q", "velocity"),
    [
        ([0.0, 0.0], [0.0] * 3),
        ([0.0] * 3, [0.0] * 2),
        ([math.nan, 0.0, 0.0], [0.0] * 3),
        ([0.0] * 3, [math.inf] * 3),
    ],
)
@pytest.mark.parametrize("function", [tool_velocity, joint_velocities])
def test_refuses_wrong_counts_and_what_is_not_finite(function, q, velocity):
    """Neither direction computes from NaN."""
    with pytest.raises(JointVectorError):
        function(SCARA, q, velocity)
