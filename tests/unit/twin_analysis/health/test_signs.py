"""What one cycle says of its joints, held against closed forms."""

from __future__ import annotations

from itertools import chain

import numpy as np
import pytest
from twin_analysis.health.readings import JointReadings, cycle_of
from twin_analysis.health.signs import CycleSignals, TorqueError, _play, signs_of

DT, FASTEST = 0.004, 2.0
GAP_S = 0.05
FAST, SLOW, REST = 0.4, 0.04, 0.0
"""Speeds [rad/s]: that of a move that tells friction, of one that shows play, and none."""
RUBS, INERTIA = 5.0, 2.0
"""Torque against friction, the same at any speed, and by acceleration."""


def cycle(*moves: tuple[float, float], free: float = 0.0) -> CycleSignals:
    """Return one joint that goes at so much speed for so many seconds, one move after the other.

    Args:
        moves: Speed [rad/s] and duration [s]; the first and the last tenth of a second are ramps.
        free: At the beginning of a slow move the motor goes so far without its load [rad].
    """
    speeds, torques = [], []
    for speed, seconds in moves:
        t = np.arange(round(seconds / DT)) * DT
        v = speed * np.clip(10.0 * np.minimum(t, seconds - t), 0.0, 1.0)
        torque = INERTIA * np.gradient(v, DT) + RUBS * np.sign(v)
        torque[(abs(speed) == SLOW) & (np.cumsum(np.abs(v)) * DT < free)] = 0.0
        speeds.append(v)
        torques.append(torque)
    v, torque = np.concatenate(speeds), np.concatenate(torques)
    q = np.concatenate(([0.0], np.cumsum(v[:-1]) * DT))[:, None]
    return CycleSignals(np.arange(len(v)) * DT, q, q, torque[:, None])


def turns(*ways: float) -> list[tuple[float, float]]:
    """Return fast moves both ways, then slow ones in these directions, with a rest before each."""
    fast = [(FAST, 1.0), (REST, 0.5), (-FAST, 1.0)]
    return [*fast, *chain.from_iterable(((REST, 0.5), (way * SLOW, 1.0)) for way in ways)]


@pytest.mark.parametrize("ways", [(1.0,), (1.0, -1.0), (1.0, -1.0, 1.0), (1.0, 1.0, -1.0, -1.0)])
def test_play_is_the_way_without_the_load_after_a_turn(ways: tuple[float, ...]) -> None:
    """The mean of all turns, however many; a move that goes on the same way is none."""
    tight, worn = (
        signs_of(cycle(*turns(*ways), free=free), np.array([FASTEST])).play[0]
        for free in (0.0, 0.004)
    )
    assert worn - tight == pytest.approx(0.004, rel=0.1)


def test_a_joint_that_turns_without_a_rest_or_fast_shows_no_play() -> None:
    """What its torque is then is more than friction."""
    moves = [(FAST, 1.0), (REST, 0.5), (-FAST, 1.0), (REST, 0.02), (SLOW, 1.0)]
    assert signs_of(cycle(*moves, free=0.004), np.array([FASTEST])).play == [0.0]


def test_noise_of_the_readings_is_smoothed_out() -> None:
    """A parabola over 40 ms leaves a hundredth of a degree in no acceleration."""
    t, noise = np.arange(0.0, 10.0, DT), np.random.default_rng(1)
    torque = INERTIA * -3.2 * np.sin(2.0 * t) + RUBS * np.sign(np.cos(2.0 * t))
    q = 0.8 * np.sin(2.0 * t)
    read = q + 4e-5 * noise.standard_normal(len(t))
    found = signs_of(
        CycleSignals(t, *(each[:, None] for each in (q, read, torque))), np.array([2.0])
    )
    assert found.inertia == pytest.approx([INERTIA], rel=0.02)


def test_play_is_the_way_without_torque_and_too_much_torque_takes_as_much_off_as_none_adds() -> (
    None
):
    """A joint that turns back: ten samples without torque, one with five times of it."""
    direction = np.repeat([0.0, 1.0, 0.0, -1.0], 500)
    v, torque = 0.01 * direction, direction.copy()
    torque[1500:1510], torque[1510] = 0.0, -5.0
    still = np.zeros(len(v))
    found = _play(v, torque, still, np.ones(1), direction, DT, SLOW)
    assert found == pytest.approx((10 - 1) * 0.01 * DT)


def back_for(samples: int) -> CycleSignals:
    """Return a joint that goes one way for a second and back above 3 % of its speed for so many.

    Its speed back is a parabola in time, so that a parabola through 11 places, as is laid through
    them, tells it too small by 5.93 of its steps.
    """
    j = np.arange(-20, 21) + (0.5 if samples % 2 == 0 else 0.0)
    step, wide = 0.00076, (0.5 * samples) ** 2 + 5.93
    end = np.sqrt(wide + 0.06 / step)
    inside = np.clip(j, -end, end)
    back = -(0.06 * inside + step * (wide * inside - inside**3 / 3.0)) * DT
    there = np.cumsum(np.full(250, FAST)) * DT
    q = np.concatenate((there, np.full(30, there[-1]), there[-1] + back - back[0]))[:, None]
    torque = np.sign(np.gradient(q, DT, axis=0))
    return CycleSignals(np.arange(len(q)) * DT, q, q, torque)


def test_a_joint_that_goes_back_for_less_than_a_parabola_says_nothing() -> None:
    """Ten places are one: five to either side."""
    with pytest.raises(TorqueError, match="no joint moves fast enough in both directions"):
        signs_of(back_for(9), np.array([FASTEST]))
    assert np.isfinite(signs_of(back_for(10), np.array([FASTEST])).forward).all()


def test_a_cycle_is_read_from_the_robots_first_reading_on() -> None:
    """Evenly, by the robot's own step; the twin is asked where it was at the same instants."""
    t = 5.0 + 0.01 * np.arange(200)
    twin_t = 4.0 + 0.004 * np.arange(1000)
    real = JointReadings(("a", "b"), t, np.column_stack((t, 2.0 * t)), np.ones((200, 2)))
    twin = JointReadings(("b", "c"), twin_t, np.column_stack((3.0 * twin_t, twin_t)), np.ones(0))
    names, cycle = cycle_of(real, twin, GAP_S)
    assert names == ("b",)
    assert cycle.times[:3] == pytest.approx([0.0, 0.01, 0.02]) and len(cycle.times) in (199, 200)
    assert cycle.measured[:, 0] == pytest.approx(2.0 * (5.0 + cycle.times))
    assert cycle.wanted[:, 0] == pytest.approx(3.0 * (5.0 + cycle.times))


def side(*parts: tuple[float, float], dt: float = DT) -> JointReadings:
    """Return a side whose joint is at its time [rad], and is read from when to when [s]."""
    t = np.concatenate([np.arange(begin, end, dt) for begin, end in parts])
    return JointReadings(("a",), t, t[:, None], np.ones((len(t), 1)))


def test_a_cycle_ends_with_the_side_that_ends_first() -> None:
    """The other one did not stand still; nor did it before it was heard."""
    _, cycle = cycle_of(side((0.0, 2.0)), side((0.5, 1.5)), GAP_S)
    assert cycle.times[-1] == pytest.approx(1.0, abs=2.0 * DT)
    assert cycle.wanted == pytest.approx(cycle.measured)
    with pytest.raises(TorqueError, match="less than 100 samples of both sides at once"):
        cycle_of(side((0.0, 1.0)), side((0.7, 2.0)), GAP_S)


def test_a_hole_in_a_side_is_no_way_that_it_went() -> None:
    """Also where the other side begins within it; one that nobody asks about is none."""
    whole, holed = side((0.0, 2.0)), side((0.0, 0.5), (0.8, 2.0))
    for who, sides in (("robot", (holed, whole)), ("twin", (whole, holed))):
        with pytest.raises(TorqueError, match=f"the {who} told nothing for 0.30 s, allowed are"):
            cycle_of(*sides, GAP_S)
    with pytest.raises(TorqueError, match="the twin told nothing"):
        cycle_of(side((0.6, 2.0)), holed, GAP_S)
    cycle_of(side((1.0, 2.0)), holed, GAP_S)
