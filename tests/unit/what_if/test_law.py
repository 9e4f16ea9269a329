"""The time law in closed form, against the stand-in's own steps."""

from __future__ import annotations

import numpy as np
import pytest
from fanuc_emulator.drives.interpolator import JointMove
from what_if.timing.law import NO_TIME, Law, _times, straight_course

VELOCITY, ACCELERATION = (4.0, 6.0, 1.0), (20.0, 30.0, 10.0)


@pytest.mark.parametrize("end", [(1.0, -0.5, 0.05), (0.02, 0.0, 0.0), (2.0, 3.0, -0.2)])
def test_a_move_takes_as_long_as_the_stand_ins(end: tuple[float, ...]) -> None:
    """It steps, ours is in closed form."""
    dt, steps = 1e-4, 0
    move = JointMove((0.0,) * 3, end, 1.0, VELOCITY, ACCELERATION)
    while not move.done:
        move.advance(1.0, dt)
        steps += 1
    law = Law(JointMove((0.0,) * 3, end, 1.0, VELOCITY, ACCELERATION), 1.0)
    assert law.duration == pytest.approx(steps * dt, abs=5 * dt)


@pytest.mark.parametrize("override", [0.1, 0.6, 1.0])
def test_a_move_is_where_the_stand_ins_is_at_each_instant(override: float) -> None:
    """At any override, ramps included."""
    dt, end = 1e-4, (1.0, -0.5, 0.05)
    move = JointMove((0.0,) * 3, end, 1.0, VELOCITY, ACCELERATION)
    law = Law(move, override)
    stepped = []
    while not move.done:
        move.advance(override, dt)
        stepped.append(move.progress)
    times = dt * np.arange(1, len(stepped) + 1)
    assert np.abs(law.at(times)[0] - np.array(stepped)).max() < 2e-3


def test_speeds_are_the_slopes_of_positions() -> None:
    """And nobody is faster than allowed."""
    move = JointMove((0.0,) * 3, (1.0, -0.5, 0.05), 1.0, VELOCITY, ACCELERATION)
    course = straight_course((0.0,) * 3, move, Law(move, 1.0), 1e-4)
    slopes = np.gradient(course.q, course.times, axis=0)
    assert np.abs(slopes - course.qdot)[2:-2].max() < 0.01
    assert np.all(np.abs(course.qdot).max(axis=0) <= np.array(VELOCITY) + 1e-9)
    assert np.all(np.abs(course.qddot).max(axis=0) <= np.array(ACCELERATION) + 1e-9)
    assert tuple(course.q[-1]) == pytest.approx((1.0, -0.5, 0.05))


@pytest.mark.parametrize(("sample", "counts"), [(10.0, (1, 1, 1)), (0.06, (4, 2, 4))])
def test_a_law_is_looked_at_in_its_corners_and_as_often_as_asked_for(
    sample: float, counts: tuple[int, int, int]
) -> None:
    """No more often: ramps of 0.2 s, and 0.1 s between them."""
    law = Law(JointMove((0.0,), (1.2,), 1.0, (4.0,), (20.0,)), 1.0)
    assert (law.ramp, law.duration) == pytest.approx((0.2, 0.5))
    corners = (0.0, 0.2, 0.3, 0.5)
    wanted = [0.0]
    for begin, end, count in zip(corners, corners[1:], counts):
        wanted += np.linspace(begin, end, count + 1)[1:].tolist()
    assert law.times(sample) == pytest.approx(wanted)


def test_a_move_to_where_it_stands_takes_no_time() -> None:
    """No division by nothing; it is there at any time, and at rest."""
    move = JointMove((1.0,), (1.0,), 1.0, (1.0,), (1.0,))
    assert straight_course((1.0,), move, Law(move, 1.0), 0.01).times.tolist() == [0.0]
    place, speed, change = Law(move, 1.0).at(np.array([0.0, 1.0]))
    assert (place.tolist(), speed.tolist(), change.tolist()) == ([1.0] * 2, [0.0] * 2, [0.0] * 2)


def test_a_piece_that_is_rounding_gets_no_time_of_its_own() -> None:
    """Slopes are taken between neighbours: two of them are never as near as that."""
    times = _times((0.0, 1.0, 1.0 + 0.5 * NO_TIME, 2.0), 0.4)
    assert np.diff(times).min() > 0.3 and times[-1] == 2.0
    assert len(times) == 1 + 3 + 3
