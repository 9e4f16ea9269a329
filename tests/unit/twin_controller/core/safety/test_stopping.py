"""Where a side stops from here: against ramps that are integrated numerically, and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from harness.pair import SETUP
from hypothesis import given
from hypothesis import strategies as st
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.keep_out.zones import WatchedMove
from twin_controller.core.events import TwinPlan
from twin_controller.core.safety.stopping import (
    Braking,
    braking_time,
    fastest_share,
    gain,
    on_path,
    rest_of_plan,
    speed_reached,
    stop_from,
    stop_on_plan,
)

FITTED = 4
DT = 1e-5
SPEED = st.floats(-5.0, 5.0)
DELAY = st.floats(0.001, 0.1)
BRAKE = st.floats(1.0, 60.0)


def ramp_down(position: float, speed: float, braking: float) -> float:
    """Integrate a constant deceleration to standstill, by steps."""
    while speed != 0.0:
        slower = math.copysign(max(0.0, abs(speed) - braking * DT), speed)
        position += 0.5 * (speed + slower) * DT
        speed = slower
    return position


@given(v=SPEED, a=st.floats(-30.0, 30.0), delay=DELAY, braking=BRAKE)
def test_a_stop_is_the_delay_at_the_fitted_gain_and_then_a_ramp(
    v: float, a: float, delay: float, braking: float
) -> None:
    """Both integrated by steps; a loss of speed does not count."""
    gains = a if a * v > 0.0 else 0.0
    steps = max(1, round(delay / DT))
    position, speed = 0.0, v
    for _ in range(steps):
        position += (speed + 0.5 * gains * delay / steps) * delay / steps
        speed += gains * delay / steps
    expected = ramp_down(position, speed, braking)
    reached = speed_reached((v,), (a,), delay, (math.inf,))
    found = stop_from((0.0,), (v,), reached, Braking((braking,), delay))[0]
    assert found == pytest.approx(expected, rel=2e-3, abs=2e-4)


@given(v=st.tuples(SPEED, SPEED), braking=st.tuples(BRAKE, BRAKE), delay=DELAY)
def test_a_program_is_stopped_along_its_path(
    v: tuple[float, float], braking: tuple[float, float], delay: float
) -> None:
    """The way has the direction of the speed; no joint brakes harder than it can."""
    way = stop_from((0.0, 0.0), v, v, Braking(braking, delay, together=True))
    assert way[0] * v[1] == pytest.approx(way[1] * v[0], abs=1e-9)
    duration = braking_time(v, braking)
    for one, speed, most in zip(way, v, braking):
        assert abs(one) == pytest.approx(abs(speed) * (delay + 0.5 * duration))
        assert abs(speed) <= most * duration * (1.0 + 1e-9)


@given(free=st.floats(0.0, 0.3), delay=DELAY, duration=st.floats(0.0, 0.4))
def test_the_share_of_the_speed_is_the_inverse_of_the_stopping_way(
    free: float, delay: float, duration: float
) -> None:
    """There and back."""
    share = fastest_share(free, delay, duration)
    assert share * delay + 0.5 * share * share * duration == pytest.approx(free, abs=1e-9)


@given(slope=st.floats(-50.0, 50.0), jitter=st.tuples(*[st.floats(-2e-3, 2e-3)] * FITTED))
def test_the_gain_hardly_changes_when_samples_are_stamped_wrongly(
    slope: float, jitter: tuple[float, ...]
) -> None:
    """Two milliseconds too early or too late, of ten: exact without, within a third with."""
    exact = [JointMotion.measured((0.0,), (slope * 0.01 * k,), 0.01 * k) for k in range(FITTED)]
    assert gain(exact)[0] == pytest.approx(slope, abs=1e-9)
    late = [JointMotion.measured(one.q, one.qdot, one.time + d) for one, d in zip(exact, jitter)]
    assert gain(late)[0] == pytest.approx(slope, abs=0.34 * abs(slope) + 1e-9)
    assert gain(exact[:1]) == (0.0,)


def test_the_limit_of_one_joint_slows_all_of_them_alike() -> None:
    """Otherwise the way would lead beside the path; no joint gets slower than it is."""
    assert on_path((1.0, 2.0), (2.0, 4.0), (4.0, 2.0)) == pytest.approx((1.0, 2.0))
    assert on_path((1.0, 2.0), (2.0, 4.0), (4.0, 3.0)) == pytest.approx((1.5, 3.0))
    assert on_path((1.0, 2.0), (2.0, 4.0), (4.0, 1.0)) == pytest.approx((1.0, 2.0))
    assert on_path((1.0, 2.0), (1.5, 3.0), (4.0, 4.0)) == (1.5, 3.0)
    assert on_path((-1.0, -2.0), (-2.0, -4.0), (4.0, 3.0)) == pytest.approx((-1.5, -3.0))


A = SETUP.acceleration[0]


def plan(start: float, speed: float, rows: int, braking: float = 0.0) -> TwinPlan:
    """Return a plan of one joint among four, 10 ms a row, that brakes from the first row on."""
    times = tuple(0.01 * k for k in range(rows))
    points = []
    for t in times:
        t = min(t, speed / braking) if braking else t
        moving = speed - braking * t
        of_first = (
            start + speed * t - 0.5 * braking * t * t,
            moving if abs(moving) > 1e-12 else 0.0,
            -braking,
        )
        points.append(JointMotion(*((value, 0.0, 0.0, 0.0) for value in of_first)))
    return TwinPlan(0.0, 1000.0, Setpoints.due(SETUP.names, times, tuple(points)))


def test_on_a_plan_the_delay_is_what_the_plan_says() -> None:
    """A plan that brakes meanwhile has lost that speed when the stop begins: by closed forms."""
    made, delay, at = plan(0.0, 3.0, 16, braking=20.0), 0.05, 1000.02
    t = 0.02 + delay
    speed = 3.0 - 20.0 * t
    expected = 3.0 * t - 10.0 * t * t + speed * speed / (2.0 * SETUP.braking[0])
    stop = stop_on_plan(made, at, Braking(SETUP.braking, delay))[-1]
    assert stop[0] == pytest.approx(expected, rel=1e-3)
    now = made.setpoints.points[2]
    without = stop_from(now.q, now.qdot, now.qdot, Braking(SETUP.braking, delay))
    assert stop[0] < without[0] - 0.02, "from the speed alone it would be further"


def test_the_way_of_a_stop_on_a_plan_goes_by_its_rows_until_the_stop_begins() -> None:
    """Not by those that lie behind, nor by those that it does not come to any more."""
    made = plan(0.0, 3.0, 16, braking=20.0)
    *rows, there, _ = stop_on_plan(made, 1000.025, Braking(SETUP.braking, 0.05))
    assert rows == [point.q for point in made.setpoints.points[3:8]]
    assert there[0] == pytest.approx(3.0 * 0.075 - 10.0 * 0.075**2, abs=1e-6)


def test_the_rest_of_a_plan_that_ends_at_rest_is_its_rows() -> None:
    """Only what is still to come."""
    made = plan(0.0, 2.0, 16, braking=20.0)
    rest = rest_of_plan(made, 1000.035, WatchedMove(), SETUP.acceleration)
    points = made.setpoints.points
    assert rest == tuple(point.q for point in points[4:]) and not any(points[-1].qdot)


@pytest.mark.parametrize("start", [0.0, 1.0, -1.0])
@pytest.mark.parametrize(
    ("target", "known"), [(0.9, True), (0.2, False), (0.1, False), (-0.5, False), (None, False)]
)
def test_a_target_is_believed_while_the_plan_can_still_stop_there(
    target: float | None, known: bool, start: float
) -> None:
    """A plan that overshoots its announced target, or leads elsewhere, has no known end."""
    made = plan(start, 2.0, 11)
    rows = [q for _, q in made.rows]
    assert rows[-1][0] + 2.0**2 / (2.0 * A) < start + 0.9
    end = () if target is None else (start + target, 0.0, 0.0, 0.0)
    rest = rest_of_plan(made, 1000.0, WatchedMove(end), SETUP.acceleration)
    assert bool(rest) is known
    if known:
        assert rest[-1] == end and np.allclose(rest[:-1], rows[1:])


@pytest.mark.parametrize(("off", "known"), [(0.0, True), (5e-5, True), (3e-4, False), (0.3, False)])
def test_a_plan_on_the_announced_way_goes_on_by_its_places(off: float, known: bool) -> None:
    """Of a way that is not straight those places are still to come that lie behind the plan."""
    made = plan(0.0, 2.0, 11)
    last = made.rows[-1][1]
    step = 0.1
    places = tuple((last[0] + k * step - 0.05, off, 0.0, 0.0) for k in range(-3, 6))
    # Two places may be as near to one another as they like.
    places = ((places[0][0] - 0.01, off, 0.0, 0.0), *places)
    end = (last[0] - 1.0, off, 0.0, 0.0)
    rest = rest_of_plan(made, 1000.0, WatchedMove(end, between=places), SETUP.acceleration)
    assert bool(rest) is known
    if known:
        assert rest[-1] == end
        assert [q[0] for q in rest[-6:-1]] == pytest.approx(
            [last[0] + k * step - 0.05 for k in range(1, 6)]
        )
        assert rest[:-6] == tuple(q for _, q in made.rows[1:]), "and none that it has passed"
