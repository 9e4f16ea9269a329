"""The article's three positions and their solutions."""

from __future__ import annotations

import math

import pytest
from scara_config import load_robot
from scara_control.kinematics.arm_kinematics import ArmKinematics
from scara_control.kinematics.scara import Elbow

KINEMATICS = ArmKinematics(load_robot())
P1, P2, P3 = (0.65, 0.0, 0.0), (0.51, 0.16, 0.10), (0.51, -0.16, 0.16)  # [paper]


@pytest.mark.parametrize(
    ("point", "elbow", "q1_deg", "q2_deg", "q3"),
    [
        (P1, Elbow.RIGHTY, 0.0, 0.0, -0.160),
        (P1, Elbow.LEFTY, 0.0, 0.0, -0.160),
        (P2, Elbow.RIGHTY, -14.3218, 69.6000, -0.060),
        (P2, Elbow.LEFTY, 49.1577, -69.6000, -0.060),
        (P3, Elbow.RIGHTY, -49.1577, 69.6000, 0.000),
        (P3, Elbow.LEFTY, 14.3218, -69.6000, 0.000),
    ],
)
def test_position_has_the_known_solution(point, elbow, q1_deg, q2_deg, q3):
    """To the digits of the table, on both elbows, and the tool is there."""
    q = KINEMATICS.inverse(*point, elbow).chosen.q
    assert (math.degrees(q[0]), math.degrees(q[1])) == pytest.approx((q1_deg, q2_deg), abs=6e-5)
    assert q[2] == pytest.approx(q3, abs=1e-15)
    assert KINEMATICS.forward(q).position == pytest.approx(point, abs=1e-15)


def test_solution_agrees_with_the_law_of_cosines():
    """The article's own formulas, away from the edge: beta, alpha, gamma."""
    l1, l2 = 0.350, 0.300
    x, y, _ = P2
    r2 = x * x + y * y
    beta = math.acos((l1 * l1 + l2 * l2 - r2) / (2.0 * l1 * l2))
    alpha = math.acos((r2 + l1 * l1 - l2 * l2) / (2.0 * l1 * math.sqrt(r2)))
    gamma = math.atan2(y, x)
    answer = KINEMATICS.inverse(*P2)
    assert answer.righty is not None and answer.lefty is not None
    assert answer.righty[:2] == pytest.approx((gamma - alpha, math.pi - beta), abs=1e-12)
    assert answer.lefty[:2] == pytest.approx((gamma + alpha, beta - math.pi), abs=1e-12)


def test_first_position_is_singular():
    """At P1 det J = 0; the answer is damped and finite."""
    q = KINEMATICS.inverse(*P1).chosen.q
    answer = KINEMATICS.inverse_velocity(q, (-0.1, 0.05, 0.0))
    assert answer.manipulability == 0.0 and answer.damped
    assert all(math.isfinite(value) for value in answer.qdot)


def test_way_round_the_three_positions_stays_righty():
    """The elbow of the first choice is kept: each position is seeded with the one before."""
    elbows, seed = [], None
    for point in (P1, P2, P3, P1):
        q, elbow = KINEMATICS.inverse(*point, seed=seed).chosen
        elbows.append(elbow)
        seed = q
    assert elbows == [Elbow.RIGHTY] * 4
