"""Set points: exact between points, bounded after them, refused when they make no motion."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from harness.running.thorough import examples
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_control.joint_track import JointTrack, SetpointError

NUMBER = st.floats(-10.0, 10.0)
LIMIT, STOP = 0.05, 4.0


def track(times, points, limit=LIMIT, stop=STOP):
    """Make a track of one joint from (q, v, a) triples."""
    return JointTrack(
        times,
        [[p[0]] for p in points],
        [[p[1]] for p in points],
        [[p[2]] for p in points],
        extrapolation_limit=limit,
        stop_accelerations=[stop],
    )


@given(st.lists(NUMBER, min_size=6, max_size=6), st.floats(0.002, 2.0), st.floats(0.0, 0.999))
def test_any_quintic_is_reproduced_between_two_points(coefficients, duration, where):
    """Position, velocity and acceleration at both ends determine a quintic, and it is that one."""
    exact = [
        np.polynomial.Polynomial(coefficients).deriv(k)
        if k
        else np.polynomial.Polynomial(coefficients)
        for k in range(3)
    ]
    points = [[poly(t) for poly in exact] for t in (0.0, duration)]
    got = track([5.0, 5.0 + duration], points).sample_joint(0, 5.0 + where * duration)
    scale = 1.0 + max(map(abs, coefficients)) * 40.0
    for k in range(3):
        assert got[k] == pytest.approx(exact[k](where * duration), abs=1e-9 * scale / duration**k)


@given(st.lists(st.tuples(NUMBER, NUMBER, NUMBER), min_size=2, max_size=5), st.floats(0.01, 0.3))
def test_motion_is_smooth_through_every_point(points, spacing):
    """Position, velocity and acceleration meet the point from both of its sides."""
    times = [k * spacing for k in range(len(points))]
    path = track(times, points)
    for t, point in zip(times[1:-1], points[1:-1]):
        before, after = path.sample_joint(0, t - 1e-9), path.sample_joint(0, t)
        assert after == pytest.approx(point, abs=1e-9)
        assert before[0] == pytest.approx(point[0], abs=1e-6)
        assert before[1] == pytest.approx(point[1], abs=1e-3)


@given(st.tuples(NUMBER, NUMBER, NUMBER), st.floats(0.0, LIMIT - 1e-9))
def test_after_the_last_point_velocity_and_acceleration_carry_on(point, age):
    """Up to the limit the last point's acceleration is trusted."""
    q, v, a = point
    got = track([1.0], [point]).sample_joint(0, 1.0 + age)
    assert got == pytest.approx((q + v * age + a * age**2 / 2, v + a * age, a), abs=1e-9)


@given(st.tuples(NUMBER, NUMBER, NUMBER), st.floats(0.0, 20.0))
def test_extrapolation_is_bounded_and_ends_at_rest(point, age):
    """Past the limit the joint ramps down by its own deceleration, then stands still."""
    path = track([0.0], [point])
    at_limit = path.sample_joint(0, LIMIT)
    q, v, _ = path.sample_joint(0, LIMIT + age)
    braking_time = abs(at_limit[1]) / STOP
    assert abs(q - at_limit[0]) <= at_limit[1] ** 2 / (2.0 * STOP) + 1e-9
    assert abs(v) == pytest.approx(max(0.0, abs(at_limit[1]) - STOP * age), abs=1e-9)
    assert path.sample_joint(0, LIMIT + braking_time + 1e-6)[1:] == (0.0, 0.0)


@settings(max_examples=examples(10, 100))
@given(st.tuples(NUMBER, NUMBER, NUMBER))
def test_position_is_the_integral_of_velocity_all_the_way_to_rest(point):
    """No jump hides at the end of the extrapolation or of the ramp."""
    path = track([0.0], [point], stop=20.0)
    dt = 1e-4
    samples = [path.sample_joint(0, k * dt) for k in range(8001)]
    for (q0, v0, _), (q1, v1, _) in pairwise(samples):
        assert q1 - q0 == pytest.approx(0.5 * (v0 + v1) * dt, abs=1e-6)


@given(st.tuples(NUMBER, NUMBER, NUMBER))
def test_once_it_stands_one_polynomial_holds_for_ever(point):
    """Until then the ramp has none; what is computed elsewhere is the standstill, bit for bit."""
    path = track([0.0], [point])
    braking_time = abs(path.sample_joint(0, LIMIT)[1]) / STOP
    if braking_time > 1e-6:
        assert path.polynomial(0, LIMIT + 0.5 * braking_time) is None
    stands = LIMIT + braking_time + 1e-6
    begin, end, longest, (q, v, a) = path.polynomial(0, stands)
    assert (begin, end, longest) == (stands, math.inf, math.inf)
    assert (q, v, a) == path.sample_joint(0, stands + 1e5) == (q, 0.0, 0.0)


def test_before_the_first_point_the_joint_rests_there():
    """A set point of the future is waited for at its position."""
    assert track([2.0], [(0.5, 3.0, 1.0)]).sample_joint(0, 1.999) == (0.5, 0.0, 0.0)
    assert track([2.0], [(0.5, 3.0, 1.0)]).sample_joint(0, 2.0) == (0.5, 3.0, 1.0)


def test_newer_packet_of_the_same_motion_does_not_jump():
    """Two packets cut from one motion agree wherever both hold."""
    motion = [
        lambda t: math.sin(3 * t),
        lambda t: 3 * math.cos(3 * t),
        lambda t: -9 * math.sin(3 * t),
    ]

    def packet(start):
        times = [start + 0.01 * k for k in range(15)]
        return track(times, [[f(t) for f in motion] for t in times])

    for t in np.linspace(0.011, 0.139, 50):
        assert packet(0.0).sample_joint(0, t)[0] == pytest.approx(
            packet(0.01).sample_joint(0, t)[0], abs=1e-10
        )


def test_all_joints_are_sampled_in_their_order():
    """Each column is a joint of its own."""
    path = JointTrack(
        [0.0, 1.0],
        [[0.0, 5.0], [1.0, 6.0]],
        [[1.0, 1.0], [1.0, 1.0]],
        [[0.0, 0.0], [0.0, 0.0]],
        extrapolation_limit=0.1,
        stop_accelerations=[1.0, 1.0],
    )
    q, qdot, qddot = path.sample(0.25)
    assert q == pytest.approx([0.25, 5.25])
    assert qdot == pytest.approx([1.0, 1.0])
    assert qddot == pytest.approx([0.0, 0.0])
    assert (path.joint_count, path.first_time, path.last_time) == (2, 0.0, 1.0)


def test_sampling_backwards_and_forwards_gives_the_same():
    """The remembered segment is only a short cut."""
    path = track([0.0, 0.1, 0.2, 0.3], [(0, 0, 0), (1, 2, 3), (2, -1, 0), (0, 0, 0)])
    times = [0.01 * k for k in range(30)]
    forwards = [path.sample_joint(0, t) for t in times]
    assert [path.sample_joint(0, t) for t in reversed(times)] == forwards[::-1]


@pytest.mark.parametrize(
    ("times", "positions", "velocities", "accelerations", "limit", "stop", "why"),
    [
        ([], [], [], [], 0.1, [1.0], "no points"),
        ([0.0], [[0.0, 1.0]], [[0.0]], [[0.0]], 0.1, [1.0], "point 0: 2 positions for 1 joints"),
        ([0.0], [[0.0]], [[]], [[0.0]], 0.1, [1.0], "point 0: 0 velocities for 1 joints"),
        ([0.0, 1.0], [[0.0]], [[0.0]], [[0.0]], 0.1, [1.0], "1 rows of positions for 2 times"),
        ([0.0], [[math.nan]], [[0.0]], [[0.0]], 0.1, [1.0], "point 0: positions = .*not finite"),
        (
            [0.0],
            [[0.0]],
            [[0.0]],
            [[math.inf]],
            0.1,
            [1.0],
            "point 0: accelerations = .*not finite",
        ),
        ([math.nan], [[0.0]], [[0.0]], [[0.0]], 0.1, [1.0], "point 0: time = nan"),
        (
            [1.0, 1.0],
            [[0.0]] * 2,
            [[0.0]] * 2,
            [[0.0]] * 2,
            0.1,
            [1.0],
            "point 1: time .* is not after point 0",
        ),
        ([0.0], [[0.0]], [[0.0]], [[0.0]], -0.1, [1.0], "extrapolation_limit = -0.1"),
        ([0.0], [[0.0]], [[0.0]], [[0.0]], 0.1, [0.0], "stop_accelerations"),
    ],
)
def test_points_that_make_no_motion_are_refused(
    times, positions, velocities, accelerations, limit, stop, why
):
    """The text names the point and the value."""
    with pytest.raises(SetpointError, match=why):
        JointTrack(
            times,
            positions,
            velocities,
            accelerations,
            extrapolation_limit=limit,
            stop_accelerations=stop,
        )
