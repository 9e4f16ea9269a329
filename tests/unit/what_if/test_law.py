"""The robot's time law, against the stand-in's own interpolator."""

from __future__ import annotations

import numpy as np
import pytest
from fanuc_emulator.drives.interpolator import JointMove
from what_if.timing.law import trapezoid

VELOCITY, ACCELERATION = (4.0, 6.0, 1.0), (20.0, 30.0, 10.0)


@pytest.mark.parametrize("end", [(1.0, -0.5, 0.05), (0.02, 0.0, 0.0), (2.0, 3.0, -0.2)])
def test_a_move_takes_as_long_as_the_stand_ins(end: tuple[float, ...]) -> None:
    """Two codes, one law: the stand-in steps, ours is in closed form."""
    dt, steps = 1e-4, 0
    move = JointMove((0.0,) * 3, end, 1.0, VELOCITY, ACCELERATION)
    while not move.done:
        move.advance(1.0, dt)
        steps += 1
    course = trapezoid((0.0,) * 3, end, VELOCITY, ACCELERATION, 0.004)
    assert course.times[-1] == pytest.approx(steps * dt, abs=5 * dt)


def test_speeds_are_the_slopes_of_positions() -> None:
    """And nobody is faster than allowed."""
    course = trapezoid((0.0,) * 3, (1.0, -0.5, 0.05), VELOCITY, ACCELERATION, 1e-4)
    slopes = np.gradient(course.q, course.times, axis=0)
    assert np.abs(slopes - course.qdot)[2:-2].max() < 0.01
    assert np.all(np.abs(course.qdot).max(axis=0) <= np.array(VELOCITY) + 1e-9)
    assert np.all(np.abs(course.qddot).max(axis=0) <= np.array(ACCELERATION) + 1e-9)
    assert tuple(course.q[-1]) == pytest.approx((1.0, -0.5, 0.05))


def test_a_move_to_where_it_stands_takes_no_time() -> None:
    """No division by nothing."""
    assert trapezoid((1.0,), (1.0,), (1.0,), (1.0,), 0.01).times.tolist() == [0.0]
