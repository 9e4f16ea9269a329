"""Joint moves: all axes together, the same path whatever happens to the speed."""

import numpy as np
import pytest
from fanuc_emulator.drives.interpolator import JointMove, stopping_speed
from hypothesis import given, settings
from hypothesis import strategies as st

DT = 0.002
VELOCITIES = (7.7, 12.2, 2.0)
ACCELERATIONS = (35.0, 56.0, 16.0)


def drive(move: JointMove, override: float | list[float], limit: int = 20000) -> np.ndarray:
    """Advance to the end and return all positions, shape (steps + 1, joints)."""
    rows = [move.positions()]
    while not move.done and len(rows) < limit:
        value = override if isinstance(override, float) else override[len(rows) % len(override)]
        rows.append(move.advance(value, DT))
    assert move.done
    return np.array(rows)


@given(st.floats(1e-6, 10.0), st.floats(0.1, 100.0))
def test_braking_from_the_stopping_speed_ends_exactly_at_the_end(
    distance: float, deceleration: float
) -> None:
    """The ramp in whole steps covers the distance, no more and no less."""
    speed, travelled = stopping_speed(distance, deceleration, DT), 0.0
    while speed > 1e-9:
        travelled += speed * DT
        speed -= deceleration * DT
    assert travelled == pytest.approx(distance, rel=1e-6)


def test_nothing_can_be_stopped_behind_its_end() -> None:
    """Half a rad too far, or there: no speed is slow enough."""
    assert stopping_speed(-0.5, 10.0, DT) == stopping_speed(0.0, 10.0, DT) == 0.0


def test_all_axes_start_and_end_together_on_a_straight_joint_path() -> None:
    """Every axis has the same progress at each instant."""
    rows = drive(JointMove((0.0, 1.0, -0.1), (1.0, -0.5, 0.0), 0.5, VELOCITIES, ACCELERATIONS), 1.0)
    progress = (rows - rows[0]) / (rows[-1] - rows[0])
    assert np.ptp(progress, axis=1).max() < 1e-12
    assert tuple(rows[-1]) == (1.0, -0.5, 0.0)


@pytest.mark.parametrize(("speed", "override"), [(1.0, 1.0), (0.5, 1.0), (1.0, 0.1), (0.4, 0.5)])
def test_slowest_axis_reaches_programmed_speed_times_override(
    speed: float, override: float
) -> None:
    """A joint move runs at greatest speed x programmed % x override %."""
    rows = drive(
        JointMove((0.0, 0.0, 0.0), (2.5, 0.1, 0.0), speed, VELOCITIES, ACCELERATIONS), override
    )
    speeds = np.abs(np.diff(rows[:, 0])) / DT
    assert speeds.max() == pytest.approx(VELOCITIES[0] * speed * override, rel=1e-6)


@settings(max_examples=50, deadline=None)
@given(
    st.tuples(*[st.floats(-2.0, 2.0)] * 3),
    st.floats(0.2, 1.0),
    st.lists(st.sampled_from([0.0, 0.2, 1.0]), min_size=1, max_size=20).filter(any),
)
def test_changing_override_keeps_path_and_limits(
    target: tuple[float, ...], speed: float, overrides: list[float]
) -> None:
    """Hold, resume and override change only the time on the path; its limits always hold."""
    stretched = [value for value in overrides for _ in range(30)]
    rows = drive(
        JointMove((0.0, 0.0, 0.0), target, speed, VELOCITIES, ACCELERATIONS), stretched, 10**6
    )
    along = rows @ np.array(target) / max(np.dot(target, target), 1e-300)
    assert np.abs(rows - along[:, None] * np.array(target)).max() < 1e-9
    rates = np.diff(rows, axis=0, prepend=rows[:1]) / DT
    assert (np.abs(rates) <= np.array(VELOCITIES) * speed * (1 + 1e-6) + 1e-9).all()
    changes = np.abs(np.diff(rates, axis=0, append=np.zeros((1, 3)))) / DT
    assert (changes <= np.array(ACCELERATIONS) * (1 + 1e-6) + 1e-6).all()


def test_hold_stops_on_the_path_and_resume_ends_at_the_target() -> None:
    """Override 0 is a hold: it decelerates, stays, and loses nothing."""
    move = JointMove((0.0, 0.0, 0.0), (1.0, 1.0, 0.1), 1.0, VELOCITIES, ACCELERATIONS)
    for _ in range(60):
        move.advance(1.0, DT)
    for _ in range(200):
        held = move.advance(0.0, DT)
    assert move.rate == 0.0
    assert 0.0 < held[0] < 1.0
    assert move.advance(0.0, DT) == held
    assert tuple(drive(move, 1.0)[-1]) == (1.0, 1.0, 0.1)


def test_a_move_to_where_it_stands_is_done_at_once() -> None:
    """A zero move takes no time and divides by nothing."""
    move = JointMove((0.3, 0.1, 0.0), (0.3, 0.1, 0.0), 1.0, VELOCITIES, ACCELERATIONS)
    assert move.done
    assert move.advance(1.0, DT) == (0.3, 0.1, 0.0)
    assert move.law == (0.0, 0.0) and move.nears_end(0.0)


def test_a_move_that_has_not_begun_does_not_near_its_end() -> None:
    """However weak its axes are: nothing decelerates yet."""
    weak = tuple(1e-3 * most for most in ACCELERATIONS)
    move = JointMove((0.0, 0.0, 0.0), (1.0, 1.0, 0.1), 1.0, VELOCITIES, weak)
    assert move.law[1] < 0.5 and not move.nears_end(1.0)


@pytest.mark.parametrize("seconds", [0.1, 1.5, 6.0])
def test_a_move_takes_the_time_that_it_is_told_or_the_shortest(seconds: float) -> None:
    """By a ramp, an even part and a ramp; what cannot be done in time is done at the speed told."""
    move = JointMove((0.0,) * 3, (1.0, 0.2, 0.0), 0.5, VELOCITIES, ACCELERATIONS, seconds)
    plain = JointMove((0.0,) * 3, (1.0, 0.2, 0.0), 0.5, VELOCITIES, ACCELERATIONS)
    taken, shortest = (DT * (len(drive(each, 1.0)) - 1) for each in (move, plain))
    assert taken == pytest.approx(max(seconds, shortest), abs=2.0 * DT)
