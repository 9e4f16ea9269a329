"""What a robot can have done between two readings."""

from __future__ import annotations

import math
from pathlib import Path
from random import Random

import pytest
from scara_config import load_robot
from scara_control.joint_motion import JointMotion
from twin_controller.plausible import (
    GAP,
    LASTING,
    MOST_REFUSED,
    Plausibility,
    Reading,
    Verdict,
    judge,
)

ROBOT = load_robot(Path(__file__).resolve().parents[3] / "config")
JOINTS = ROBOT.joints
WRAP = 2.0**31 * 1e-3
POLL = 0.0097


def still(local: float, *degrees: float, remote: float | None = None) -> Reading:
    """Return a robot that stands; the first joints at the given degrees, or millimetres."""
    q = tuple(
        value * joint.scale for value, joint in zip((*degrees, *(0.0,) * len(JOINTS)), JOINTS)
    )
    true_at = local + 500.0 if remote is None else remote
    return Reading(JointMotion.measured(q, (0.0,) * len(JOINTS), true_at), local)


def fed(*readings: Reading) -> tuple[Plausibility, list[Verdict]]:
    """Judge readings one after the other; the first one is believed already."""
    state, verdicts = Plausibility(last=readings[0]), []
    for reading in readings:
        state, verdict = judge(state, reading, JOINTS, wrap=WRAP)
        verdicts.append(verdict)
    return state, verdicts


def sweep(t: float, share: float, turn: float) -> tuple[list[float], list[float]]:
    """Swing every joint at ``share`` of its greatest speed, as twice its acceleration allows."""
    q, qdot = [], []
    for joint in JOINTS:
        v = share * joint.velocity
        omega = min(2.0 * joint.acceleration / v, 2.0 * v / (joint.upper - joint.lower) * turn)
        q.append(0.5 * (joint.lower + joint.upper) - v / omega * math.cos(omega * t))
        qdot.append(v * math.sin(omega * t))
    return q, qdot


@pytest.mark.parametrize("share", [1.0, 0.5, 0.05])
@pytest.mark.parametrize("seed", range(4))
def test_no_motion_that_the_robot_can_make_is_refused(share: float, seed: int) -> None:
    """Full speed, reversals at twice the acceleration, a coarse clock that stalls, late polls."""
    rng = Random(seed)
    state, local, true_at = Plausibility(), 100.0, 0.0
    for k in range(3000):
        local += POLL + (rng.uniform(0.0, 0.08) if rng.random() < 0.02 else rng.uniform(0.0, 0.001))
        held = 0.06 if k % 500 in (7, 8, 9) else 0.0
        true_at = max(true_at, math.floor((local - rng.uniform(0.0, 0.003) - held) * 500.0) / 500.0)
        q, qdot = sweep(true_at, share, 3.0)
        noisy = tuple(v + rng.uniform(-0.2, 0.2) * joint.scale for v, joint in zip(qdot, JOINTS))
        motion = JointMotion.measured(q, noisy, (true_at + 2147470.0) % WRAP)
        reading = Reading(motion, local)
        state, verdict = judge(state, reading, JOINTS, wrap=WRAP)
        assert verdict is (Verdict.ACCEPTED if k else Verdict.FIRST), (k, state.reason)


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        (still(10.01, 23.0), "joint_1 jumped by 3.000 deg"),
        (still(10.01, -20.0), "joint_1 jumped by 40.000 deg"),
        (still(10.01, 20.0, 0.0, -12.0), "joint_3 jumped by 12.000 mm"),
        (still(10.01, 20.0, remote=510.01 + 3600.0), "the clock went on by 3600.010 s in 0.010 s"),
        (still(10.01, 20.0, remote=510.01 - 3600.0), "the clock went on by -3599.990 s in 0.010 s"),
    ],
)
def test_a_single_wrong_reading_is_refused_and_the_next_good_one_accepted(
    wrong: Reading, reason: str
) -> None:
    """The reason names joint, step and time."""
    state, verdicts = fed(still(10.0, 20.0), wrong)
    assert verdicts == [Verdict.ACCEPTED, Verdict.REFUSED]
    assert reason in state.reason
    assert fed(still(10.0, 20.0), wrong, still(10.02, 20.0))[1][-1] is Verdict.ACCEPTED


def test_a_speed_that_no_drive_can_reach_is_refused() -> None:
    """A sign flip of a fast joint's speed."""
    others = (0.0,) * (len(JOINTS) - 1)
    fast = JointMotion.measured((0.0, *others), (4.0, *others), 500.0)
    flipped = JointMotion.measured((0.04, *others), (-4.0, *others), 500.01)
    state, verdicts = fed(Reading(fast, 10.0), Reading(flipped, 10.01))
    assert (
        verdicts[-1] is Verdict.REFUSED
        and "joint_1 changed its speed by 458.4 deg/s" in state.reason
    )


def test_readings_that_go_on_fitting_each_other_are_a_jump() -> None:
    """Encoders that were set anew: known after three readings, not before."""
    _, verdicts = fed(
        still(10.0, 20.0), *(still(10.0 + POLL * k, 50.0) for k in range(1, LASTING + 1))
    )
    assert verdicts == [Verdict.ACCEPTED, *[Verdict.REFUSED] * (LASTING - 1), Verdict.JUMPED]


def test_random_readings_never_pass_and_are_soon_given_up() -> None:
    """Noise does not agree with itself, but a robot that says nothing else is not there."""
    rng = Random(3)
    readings = [
        still(10.0 + POLL * k, rng.uniform(60.0, 140.0) * rng.choice((-1, 1)))
        for k in range(1, MOST_REFUSED + 1)
    ]
    _, verdicts = fed(still(10.0, 20.0), *readings)
    assert verdicts == [Verdict.ACCEPTED, *[Verdict.REFUSED] * (MOST_REFUSED - 1), Verdict.JUMPED]


def test_the_first_reading_counts_once_a_second_one_fits_it() -> None:
    """After a connect there is nothing to compare with: a lie then would be the baseline."""
    state, verdicts = Plausibility(), []
    for reading in (still(10.0, -20.0), still(10.01, 20.0), still(10.02, 20.0)):
        state, verdict = judge(state, reading, JOINTS)
        verdicts.append(verdict)
    assert verdicts == [Verdict.FIRST, Verdict.FIRST, Verdict.ACCEPTED]


def test_nothing_is_compared_after_a_silence() -> None:
    """The controller has forgotten that side, and aligns anew: a first reading again."""
    assert fed(still(10.0, 20.0), still(10.0 + GAP + 0.01, 120.0))[1][-1] is Verdict.FIRST


def test_a_clock_that_wraps_goes_on() -> None:
    """2^31 ms to 0."""
    assert (
        fed(still(10.0, 20.0, remote=WRAP - 0.002), still(10.01, 20.0, remote=0.008))[1][-1]
        is Verdict.ACCEPTED
    )


def test_a_robot_that_tells_no_speeds_is_judged_by_how_far_it_can_have_come() -> None:
    """1.5 times its greatest speed for 10 ms and the slack is 10 deg of joint 1."""

    def told(local: float, degrees: float) -> Reading:
        reading = still(local, degrees)
        motion = JointMotion.measured(reading.motion.q, (), reading.motion.time)
        return Reading(motion, local)

    _, verdicts = fed(told(0.0, 0.0), told(POLL, 9.0), told(2 * POLL, -0.5), told(3 * POLL, 10.0))
    refused = [Verdict.ACCEPTED, Verdict.ACCEPTED, Verdict.ACCEPTED, Verdict.REFUSED]
    assert verdicts == refused
