"""A reading of a real SR-6iA's display, rounded to 2 decimals in deg and mm.

An oracle from outside this project.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scara_config import load_robot
from scara_control.kinematics.arm_kinematics import ArmKinematics
from scara_control.kinematics.jacobians import tip_jacobian
from scara_control.kinematics.scara import Elbow
from scipy.spatial.transform import Rotation

KINEMATICS = ArmKinematics(load_robot())
JOINTS = (19.62, 79.60, -18.17, -98.26)  # J1 deg, J2 deg, J3 mm, J4 deg [src]
PRINTED = (281.58, 413.66, 141.83)  # X, Y, Z mm [src]
PRINTED_R = 0.96  # deg [src]
HALF_DIGIT = 0.005

Q = (math.radians(JOINTS[0]), math.radians(JOINTS[1]), JOINTS[2] / 1e3, math.radians(JOINTS[3]))


def test_printed_position_gives_the_printed_joints_digit_for_digit():
    """Backwards all three joints agree to 2 decimals, more than the rounding of the input."""
    q, elbow = KINEMATICS.inverse(*(value / 1e3 for value in PRINTED), Elbow.RIGHTY).chosen
    assert (
        round(math.degrees(q[0]), 2),
        round(math.degrees(q[1]), 2),
        round(q[2] * 1e3, 2),
    ) == JOINTS[:3]
    assert elbow is Elbow.RIGHTY


def test_printed_joints_give_the_printed_position_within_their_rounding():
    """0.005 deg moves the tool by up to 0.04 mm: no more may be missing, in z nothing."""
    position = np.array(KINEMATICS.forward(Q).position) * 1e3
    half_digits = np.array([math.radians(HALF_DIGIT), math.radians(HALF_DIGIT), HALF_DIGIT / 1e3])
    allowed = np.abs(tip_jacobian(KINEMATICS.arm, Q[:3])[3:]) @ half_digits * 1e3 + HALF_DIGIT
    assert (np.abs(position - PRINTED) <= allowed).all()
    assert allowed.max() < 0.07
    assert round(position[2], 2) == PRINTED[2]


def test_joints_that_print_the_same_give_the_printed_position_digit_for_digit():
    """Joint positions that the display shows so give its X, Y, Z: the lengths are right."""
    q = KINEMATICS.inverse(*(value / 1e3 for value in PRINTED), Elbow.RIGHTY).chosen.q
    position = KINEMATICS.forward(q).position
    assert tuple(round(value * 1e3, 2) for value in position) == PRINTED
    assert (round(math.degrees(q[0]), 2), round(math.degrees(q[1]), 2)) == JOINTS[:2]


def test_printed_joints_give_the_printed_rotation():
    """R = J1 + J2 + J4, read from the whole pose."""
    turned, home = KINEMATICS.forward(Q), KINEMATICS.forward((0.0, 0.0, 0.0, 0.0))
    rotation = Rotation.from_quat(turned.orientation) * Rotation.from_quat(home.orientation).inv()
    assert round(math.degrees(rotation.as_euler("zyx")[0]), 2) == PRINTED_R


def test_printed_configuration_is_righty():
    """The display shows R for J2 > 0."""
    assert KINEMATICS.forward(Q).elbow is Elbow.RIGHTY


@pytest.mark.parametrize("index", [0, 1])
def test_reading_tells_one_hundredth_of_a_degree(index):
    """The oracle is sharp: a joint that is off by 0.02 deg is outside of what rounding explains."""
    wrong = list(Q)
    wrong[index] += math.radians(0.02)
    q = KINEMATICS.inverse(*KINEMATICS.forward(wrong).position, Elbow.RIGHTY).chosen.q
    assert round(math.degrees(q[index]), 2) != JOINTS[index]
    assert np.abs(np.array(KINEMATICS.forward(wrong).position) * 1e3 - PRINTED).max() > 0.07
