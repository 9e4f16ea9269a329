"""The time base: stretched and frozen, the path stays, the joints' limits too."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.joint_motion import JointMotion
from scara_control.motion.drive import Drive, Follower, PathDriver, believed
from scara_control.motion.plan import plan_move
from scara_control.motion.time_scaling import ScaleBounds, TimeBase, advance, motion_at

JOINTS = load_robot().twin_joints
BOUNDS = ScaleBounds(ramp=4.0, jerk=80.0)
DT = 0.01
START, TARGET = (0.0, 0.0, -0.2, 0.0), (1.5, -1.2, -0.02, 0.8)


def driven(wanted, percent=100.0, steps=2000):
    """Drive the path with ``wanted(k)`` as scale.

    Return the time bases and motions up to its end.
    """
    path = plan_move(JOINTS, JointMotion.at_rest(START), TARGET, percent)
    bases = [TimeBase(0.0, wanted(0))]
    while bases[-1].tau < path.duration and len(bases) < steps:
        bases.append(advance(path, bases[-1], wanted(len(bases)), BOUNDS, JOINTS, DT))
    return path, bases, [motion_at(path, base) for base in bases]


@pytest.mark.parametrize("rate", [-2.0, -1.0, 0.0, 1.0])
def test_a_rate_of_the_scale_accelerates_along_the_way(rate):
    """At full scale too: d/dt (s v) = s^2 a + s' v."""
    path = plan_move(JOINTS, JointMotion.at_rest(START), TARGET, 100.0)
    tau = 0.3 * path.duration
    planned, motion = path.at(tau), motion_at(path, TimeBase(tau, 1.0, rate))
    assert motion.qdot == planned.qdot
    wanted = [a + rate * v for v, a in zip(planned.qdot, planned.qddot)]
    assert motion.qddot == pytest.approx(wanted)


@pytest.mark.parametrize("wanted", [0.1, 0.5, 0.9])
def test_path_time_grows_by_the_integral_of_the_scale(wanted):
    """Within a step the rate changes evenly, so Simpson's rule is exact for the scale."""
    _, bases, _ = driven(lambda k: wanted if k < 60 else 1.0)
    looked_at = 0
    for before, after in pairwise(bases):
        if not before.rate or not after.rate:
            continue  # a step that ends at the wanted scale is cut there
        middle = before.scale + (3.0 * before.rate + after.rate) * DT / 8.0
        grown = (before.scale + 4.0 * middle + after.scale) * DT / 6.0
        assert after.tau - before.tau == pytest.approx(grown, abs=1e-12)
        looked_at += 1
    assert looked_at > 3


@pytest.mark.parametrize(
    ("told", "taken"),
    [(0.3, 0.3), (0.5, 0.5), (0.6, 0.5), (-0.1, 0.0), (np.nan, 0.0), (np.inf, 0.0)],
)
def test_a_follower_is_believed_for_half_a_second(told, taken):
    """Nobody looks ahead for ever because of what somebody says of a delay."""
    assert believed(told, told) == Follower(taken, taken)


@pytest.mark.parametrize(("later", "more"), [(0.0, 0), (1e-9, 0), (0.3, 1), (1.0, 1), (1.2, 2)])
def test_a_move_begins_at_the_first_time_of_the_grid_behind_its_announcement(later, more):
    """Where that is a time of the grid itself, rounding adds no period."""
    config = load_motion()
    periods = round(config.move.announce / config.period)
    assert config.move.announce == pytest.approx(periods * config.period)
    go_at = PathDriver(JOINTS, config, 5.0).announced(5.0 + later * config.period)
    assert go_at == pytest.approx(5.0 + (periods + more) * config.period)


PLANS = st.lists(
    st.tuples(st.integers(1, 40), st.sampled_from([0.0, 0.2, 0.5, 0.8, 1.0])),
    min_size=1,
    max_size=6,
)


def by(plan):
    """Turn pieces of (steps, scale) into a function of the step; afterwards 1."""
    scales = [scale for steps, scale in plan for _ in range(steps)]
    return lambda k: scales[k] if k < len(scales) else 1.0


@settings(max_examples=60, deadline=None)
@given(PLANS, st.floats(20.0, 100.0))
def test_stretching_and_freezing_leave_the_path_where_it_was(plan, percent):
    """Every point lies on the line of the unstretched move, in the same order, to the same end."""
    path, bases, motions = driven(by(plan), percent)
    assert bases[-1].tau >= path.duration and motions[-1].q == TARGET
    line = np.array(TARGET) - np.array(START)
    q = np.array([motion.q for motion in motions])
    share = (q[:, 0] - START[0]) / line[0]
    assert np.allclose(q, START + share[:, None] * line, atol=1e-9)
    assert (np.diff(share) >= -1e-12).all()


@settings(max_examples=60, deadline=None)
@given(PLANS, st.floats(20.0, 100.0))
def test_no_change_of_scale_asks_more_acceleration_than_a_joint_has(plan, percent):
    """No velocity changes by more than acceleration times dt, and 5 % for the curve between."""
    _, _, motions = driven(by(plan), percent)
    change = np.abs(np.diff([motion.qdot for motion in motions], axis=0))
    allowed = np.array([joint.acceleration for joint in JOINTS]) * DT * 1.05
    assert (change <= allowed).all()


@pytest.mark.parametrize("step", [4, 5, 17])
def test_a_scale_that_rises_takes_all_of_an_acceleration_and_no_more(step):
    """Told at the set points themselves, to 2 % for where the path is looked at."""
    _, _, motions = driven(lambda k: 0.2 if k < step else 1.0)
    limits = [joint.acceleration for joint in JOINTS]
    used = np.abs([motion.qddot for motion in motions]) / limits
    assert 0.98 < used.max() <= 1.02


@settings(max_examples=60, deadline=None)
@given(PLANS, st.floats(20.0, 100.0))
def test_position_velocity_and_acceleration_belong_together(plan, percent):
    """As the quintic through them needs: checked by Simpson's rule on the velocity."""
    _, _, motions = driven(by(plan), percent)
    q = np.array([motion.q for motion in motions])
    v = np.array([motion.qdot for motion in motions])
    a = np.array([motion.qddot for motion in motions])
    hermite = 0.5 * DT * (v[:-1] + v[1:]) + DT**2 / 12.0 * (a[:-1] - a[1:])
    allowed = np.array([joint.jerk for joint in JOINTS]) * DT**3
    assert (np.abs(np.diff(q, axis=0) - hermite)[:-1] <= allowed).all()


@given(PLANS)
@settings(max_examples=60, deadline=None)
def test_the_scale_stays_between_frozen_and_planned_and_changes_within_its_bounds(plan):
    """0 <= s <= 1, no faster than the ramp; only the last steps may end the ramp early."""
    _, bases, _ = driven(by(plan))
    scale = np.array([base.scale for base in bases])
    assert scale.min() >= 0.0 and scale.max() <= 1.0
    assert np.abs(np.diff(scale)).max() <= BOUNDS.ramp * DT + BOUNDS.jerk * DT**2


def test_pause_freezes_within_the_ramp_and_resume_goes_on_to_the_end():
    """Frozen is exactly frozen: the path time stands still until the scale is raised."""
    path, bases, motions = driven(lambda k: 0.0 if 15 <= k < 100 else 1.0)
    frozen = [k for k, base in enumerate(bases) if base.scale == 0.0]
    assert 15 < frozen[0] < 60 and len({bases[k].tau for k in frozen}) == 1
    assert not any(motions[frozen[0]].qdot) and not any(motions[frozen[0]].qddot)
    assert bases[-1].tau >= path.duration


@pytest.mark.parametrize("scale", [0.25, 0.5, 0.8])
def test_a_constant_scale_stretches_the_duration_by_its_inverse(scale):
    """Half the scale, twice the time, half the velocity, a quarter of the acceleration."""
    path, bases, motions = driven(lambda _: scale)
    assert len(bases) - 1 == pytest.approx(path.duration / scale / DT, abs=1.0)
    planned = path.at(bases[10].tau)
    assert motions[10].qdot == pytest.approx([v * scale for v in planned.qdot])
    assert motions[10].qddot == pytest.approx([a * scale**2 for a in planned.qddot])


def test_a_drive_waits_for_its_time_and_then_begins():
    """Announced is announced: no motion before go_at, motion after."""
    path = plan_move(JOINTS, JointMotion.at_rest(START), TARGET, 100.0)
    drives = [Drive(path, 5.0, 5.1, TimeBase(0.0, 1.0))]
    while not drives[-1].done:
        drives.append(drives[-1].step(DT, 1.0, BOUNDS, JOINTS))
    waiting = [drive for drive in drives if drive.announcing]
    assert len(waiting) == 10
    assert all(drive.motion == JointMotion.at_rest(START) for drive in waiting)
    assert drives[11].motion.q != START and drives[10].motion == JointMotion.at_rest(START)
    assert drives[-1].motion == JointMotion.at_rest(TARGET)


@pytest.mark.parametrize("wanted", [0.0, 0.4, 0.8])
def test_a_new_scale_is_reached_without_running_past_it(wanted):
    """From the planned speed down; no faster than the ramp plus what its jerk takes."""
    _, bases, _ = driven(lambda k: 1.0 if k < 25 else wanted, steps=100)
    scales = [base.scale for base in bases[25:]]
    assert min(scales) >= wanted - 1e-3 and scales == sorted(scales, reverse=True)
    assert (
        scales.index(wanted) * DT
        <= (1.0 - wanted) / BOUNDS.ramp + BOUNDS.ramp / BOUNDS.jerk + 3 * DT
    )


@pytest.mark.parametrize("rate", [0.3688175487262424, 0.39, 0.4])
def test_a_pause_never_creeps_on(rate):
    """Where the scale is r^2 / 2 j the rate changed its sign with each step, for ever."""
    slow = plan_move(JOINTS, JointMotion.at_rest(START), TARGET, 20.0)
    base = TimeBase(0.3, rate**2 / (2.0 * BOUNDS.jerk), -rate)
    for _ in range(20):
        base = advance(slow, base, 0.0, BOUNDS, JOINTS, DT)
    assert (base.scale, base.rate) == (0.0, 0.0)
