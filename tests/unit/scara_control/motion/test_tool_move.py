"""The time on a way of the tool along which a joint goes to and fro: held by closed forms."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from scara_config import load_robot
from scara_control.joint_track import JointTrack
from scara_control.kinematics.tool_path import SolvedPath
from scara_control.motion.plan import PlanError
from scara_control.motion.tool_move import plan_tool_move

JOINT = msgspec.structs.replace(
    load_robot().twin_joints[0],
    velocity_deg_s=math.degrees(20.0),
    acceleration_deg_s2=math.degrees(15.0),
    jerk_deg_s3=math.degrees(1000.0),
)
LENGTH_M, EVEN, SWING, WAVES = 0.4, 2.0, 0.004, 100.0
"""The joint goes 2 rad for each metre, and to and fro by 4 mrad, 16 times a metre."""


def wavy() -> SolvedPath:
    """Return the way of one joint, with its derivatives by the way of the tool."""
    s = np.linspace(0.0, LENGTH_M, 801)
    sine, cosine = np.sin(WAVES * s), np.cos(WAVES * s)
    rows = np.stack(
        (
            EVEN * s + SWING * sine,
            EVEN + SWING * WAVES * cosine,
            -SWING * WAVES**2 * sine,
            -SWING * WAVES**3 * cosine,
        )
    )[..., None]
    track = JointTrack(s, *rows[:3], extrapolation_limit=0.0, stop_accelerations=[1.0])
    return SolvedPath(track, rows[1:], 0.0)


@pytest.mark.parametrize(
    ("percent", "share", "jerk", "least"),
    [
        *[(5.0, 1.0, 1000.0, 0.8), (10.0, 0.5, 1000.0, 0.8), (10.0, 0.01, 1000.0, 0.8)],
        (10.0, 1.0, 100.0, 0.6),
    ],
)
def test_a_joint_that_goes_to_and_fro_takes_most_of_what_it_may_have_and_no_more(
    percent: float, share: float, jerk: float, least: float
) -> None:
    """Of speed, acceleration and jerk, however little of an acceleration or a jerk that is.

    Less of a jerk: its three parts are largest at different places, and bounded as if at one.
    """
    joint = msgspec.structs.replace(JOINT, jerk_deg_s3=math.degrees(jerk))
    move = plan_tool_move((joint,), wavy(), percent, share)
    times, step = np.linspace(0.0, move.duration, 20001, retstep=True)
    _, qdot, qddot = np.array([move.at_time(time) for time in times])[..., 0].T
    used = (
        np.abs(qdot).max() / (JOINT.velocity * percent / 100.0),
        np.abs(qddot).max() / (JOINT.acceleration * share),
        np.abs(np.diff(qddot)).max() / (joint.jerk * step),
    )
    assert least < max(used) <= 1.0 + 1e-6


def test_a_way_that_is_bent_too_sharply_is_refused_with_the_slowest_speed_that_was_tried() -> None:
    """A joint of 2 rad/s that goes 2.4 rad for a metre, and a twentieth of that: 45 mm/s."""
    with pytest.raises(PlanError, match=r"too sharply, even at 45\.5 mm/s$"):
        plan_tool_move((JOINT,), wavy(), 10.0, 1e-6)


@pytest.mark.parametrize(("speed_mm_s", "least"), [(1000.0, 1.0), (1001.0, 0.94)])
def test_a_joint_that_turns_back_everywhere_limits_the_speed_by_its_bend_alone(
    speed_mm_s: float, least: float
) -> None:
    """Where it has no speed, an acceleration of the tool costs it none, its bend does.

    At 1 m/s that takes all the acceleration that it has.
    """
    s = np.linspace(0.0, LENGTH_M, 801)
    slope, bend = np.zeros((801, 2)), np.zeros((801, 2))
    slope[:, 0], bend[:, 1] = 1.0, JOINT.acceleration
    q = np.stack((s, np.zeros(801)), axis=1)
    track = JointTrack(s, q, slope, bend, extrapolation_limit=0.0, stop_accelerations=[1.0, 1.0])
    path = SolvedPath(track, np.stack((slope, bend, np.zeros((801, 2)))), speed_mm_s)
    move = plan_tool_move((JOINT, JOINT), path, 100.0, 1.0)
    assert least <= move.speed <= 1.0
