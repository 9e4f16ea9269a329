"""Speeds of a robot that tells positions alone."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scara_config import load_robot
from scara_control.joint_motion import JointMotion
from twin_controller.config import load_twin_controller
from twin_controller.core.events import LinkChanged, RealMeasured
from twin_controller.core.setup import Setup
from twin_controller.core.sides.measure import take_in
from twin_controller.core.sides.side import RealSide, Sides
from twin_controller.core.sides.speeds import slope_weights, speeds

CUBIC, FEWEST, MOST, PARABOLA = 3, 3, 16, 2
CONFIG = Path(__file__).resolve().parents[5] / "config"
ROBOT = load_robot(CONFIG)
SETUP = Setup(ROBOT, load_twin_controller(ROBOT, CONFIG))
PERIOD = 0.008
MOST_SPEED, MOST_ACCELERATION = (math.radians(440.0),), (math.radians(2500.0),)


def readings(rows: np.ndarray, period: float = PERIOD) -> list[JointMotion]:
    """Return positions [rad], shape (n,) or (n, joints), as readings without speeds."""
    table = rows.reshape(len(rows), -1)
    return [JointMotion.measured(row, (), k * period) for k, row in enumerate(table.tolist())]


def found(rows: np.ndarray, noise: float = 0.0, period: float = PERIOD) -> float:
    """Return the speed at the last of some positions of one joint."""
    *before, newest = readings(rows, period)
    return speeds(before, newest, (noise,), MOST_SPEED, MOST_ACCELERATION)[0]


@pytest.mark.parametrize("count", [2, 3, FEWEST, 40])
def test_an_even_motion_has_its_speed(count: int) -> None:
    """From the second reading on."""
    assert found(0.3 - 2.0 * PERIOD * np.arange(count)) == pytest.approx(-2.0)


@pytest.mark.parametrize("count", [*range(2, 12), MOST, MOST + 1, 40])
def test_noise_alone_is_averaged_over_every_reading_that_there_is(count: int) -> None:
    """Where no jerk could matter as much, and to a bound: by a line of two, a parabola of more."""
    rows = np.random.default_rng(count).normal(0.0, 0.1, count)
    assert found(rows, 1.0) == 0.0
    told = speeds(*_split(rows), (0.01,), (1e9,), (1e-9,))[0]
    s = PERIOD * np.arange(1 - min(count, MOST), 1)
    assert told == pytest.approx(float(slope_weights(s, PARABOLA) @ rows[-MOST:]))


def _split(rows: np.ndarray) -> tuple[list[JointMotion], JointMotion]:
    *before, newest = readings(rows)
    return before, newest


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_a_motion_that_speeds_up_has_the_speed_of_its_newest_reading(noise: float) -> None:
    """A difference of two readings alone would be half a period old."""
    t = PERIOD * np.arange(20)
    assert found(0.5 * 30.0 * t**2, noise) == pytest.approx(30.0 * t[-1])


@pytest.mark.parametrize("period", [0.004, 0.008, 0.016])
def test_a_drive_that_turns_to_braking_has_its_speed(period: float) -> None:
    """A jerk that lasts costs nothing from the fourth reading on; while it begins, less than j T^2.

    From 30 to -30 rad/s^2 within 40 ms, as in the middle of the article's moves.
    """
    jerk, t = -60.0 / 0.04, period * np.arange(30)
    begun = np.maximum(0.0, t - t[20])
    way = -5.0 * t + 15.0 * t**2 + jerk / 6.0 * begun**3
    speed = -5.0 + 30.0 * t + jerk / 2.0 * begun**2
    off = [abs(found(way[: k + 1], 1e-6, period) - speed[k]) for k in range(19, 29)]
    assert max(off[5:]) <= 0.01 * abs(jerk) * period**2 + 0.01
    assert max(off) <= 0.25 * abs(jerk) * period**2 + 0.01


def test_no_drive_is_thought_faster_than_it_can_be() -> None:
    """Where speeding up ends at its greatest speed a parabola through the corner goes beyond."""
    t, most = 0.012 * np.arange(40), MOST_SPEED[0]
    begun = np.minimum(t, most / 38.0)
    way = 19.0 * begun**2 + most * (t - begun)
    for sign in (1.0, -1.0):
        told = [found(sign * way[: k + 1], 1e-5, 0.012) for k in range(3, 40)]
        assert max(sign * np.array(told)) == pytest.approx(most, abs=1e-9)


def test_a_motion_that_begins_is_seen_by_its_newest_readings_whatever_their_age() -> None:
    """What an unknown age hides grows with the speed: first there is little to average.

    At half the greatest speed the same ages are averaged over more readings than three.
    """
    random = np.random.default_rng(11)
    few: list[float] = []
    for _ in range(200):
        ages = random.uniform(0.0, 0.008, 24)
        times = 0.01 * np.arange(24)
        at = np.maximum(0.0, times - ages - times[19])
        samples = readings(20.0 * at**2, 0.01)
        told = speeds(samples[:-1], samples[-1], (1e-5,), MOST_SPEED, MOST_ACCELERATION, 0.0023)
        few.append(told[0] - 40.0 * at[-1])
    # It goes at 1.4 rad/s then; readings of when it stood would make that 0.6 rad/s less.
    assert abs(np.mean(few)) <= 0.3
    evenly = 0.5 * MOST_SPEED[0] * (times - random.uniform(0.0, 0.008, (500, 24)))
    rows = [readings(row, 0.01) for row in evenly]
    wrong = [
        speeds(row[:-1], row[-1], (1e-5,), MOST_SPEED, MOST_ACCELERATION, 0.0023)[0] for row in rows
    ]
    three = np.linalg.norm(slope_weights(times[-FEWEST:] - times[-1], PARABOLA))
    assert np.std(wrong) <= 0.5 * three * 0.0023 * 0.5 * MOST_SPEED[0]


def test_a_motion_that_has_become_slow_is_told_by_readings_of_its_slow_part() -> None:
    """Six readings after a fast one: what an age hides of it is past, and little is averaged."""
    random, times = np.random.default_rng(3), 0.01 * np.arange(24)
    wrong: list[float] = []
    for _ in range(100):
        at = times - random.uniform(0.0, 0.008, 24) - times[-7]
        row = readings(np.where(at < 0.0, 4.0, 0.4) * at, 0.01)
        told = speeds(row[:-1], row[-1], (1e-5,), MOST_SPEED, MOST_ACCELERATION, 0.0023)
        wrong.append(told[0] - 0.4)
    assert abs(np.mean(wrong)) <= 0.05 and np.std(wrong) <= 0.2


def test_one_reading_has_no_speed() -> None:
    """Nor has one long after those before it."""
    assert found(np.array([0.3])) == 0.0
    *before, newest = readings(np.array([0.0, 0.1, 0.2]), period=1.0)
    assert speeds(before, newest, (0.0,), MOST_SPEED, MOST_ACCELERATION) == (0.0,)


@pytest.mark.parametrize(("noise_deg", "percent"), [(0.001, 0.08), (0.01, 0.5), (0.1, 2.5)])
def test_noise_is_averaged_as_long_as_a_jerk_costs_less(noise_deg: float, percent: float) -> None:
    """Over a reading's age of 10 ms half a percent of the greatest speed is 0.02 deg."""
    noise, random = math.radians(noise_deg), np.random.default_rng(7)
    moves = 2.0 * PERIOD * np.arange(40)
    wrong = [found(moves + random.normal(0.0, noise, 40), noise) - 2.0 for _ in range(500)]
    few = noise * np.linalg.norm(slope_weights(-PERIOD * np.arange(CUBIC + 1)[::-1], CUBIC))
    most = noise * np.linalg.norm(slope_weights(-PERIOD * np.arange(MOST)[::-1], PARABOLA))
    assert 0.9 * most <= np.std(wrong) <= 1.1 * few
    assert np.std(wrong) <= 1e-2 * percent * MOST_SPEED[0]


@pytest.mark.parametrize("period", [0.004, 0.008, 0.016])
@pytest.mark.parametrize("noise_deg", [0.001, 0.006])
def test_readings_far_apart_do_not_smear_a_move(period: float, noise_deg: float) -> None:
    """A move of 0.25 s to half the greatest speed: its speed is right within 2.5 % of that."""
    times = np.arange(-0.3, 0.25, period)
    share = np.clip(times / 0.25, 0.0, 1.0)
    way = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    speed = 30.0 * (share * (1.0 - share)) ** 2 / 0.25
    scale = 0.5 * MOST_SPEED[0] / speed.max()
    off = [
        abs(found(scale * way[: k + 1], math.radians(noise_deg), period) - scale * speed[k])
        for k in range(20, len(times))
    ]
    assert max(off) <= 0.025 * MOST_SPEED[0]


@pytest.mark.parametrize(("noise_deg", "noise_mm"), [(0.001, 0.002), (0.01, 0.02)])
def test_noise_of_a_robot_that_stands_is_no_speed_and_a_slow_motion_is_one(
    noise_deg: float, noise_mm: float
) -> None:
    """The field plant's readings, each 8 ms: whole counts of the encoder and noise.

    What stands by its positions has a speed of exactly 0, whatever differences say.
    """
    random = np.random.default_rng(3)
    noises = [noise_deg if joint.unit == "deg" else noise_mm for joint in SETUP.joints]
    spread = np.array(noises) * SETUP.scale
    sides = take_in(SETUP, Sides(), LinkChanged(0.0, "real", True, ""))
    home, way = np.array(SETUP.home), np.zeros(len(SETUP.home))
    shown = []
    for k in range(900):
        moves = k > 600
        way[0] = math.radians(5.0) * PERIOD * max(0, k - 600)
        q = home + way + random.normal(0.0, spread)
        at = 10.0 + k * PERIOD
        motion = JointMotion.measured(q.tolist(), (), k * PERIOD)
        event = RealMeasured(at + 0.004, at, at + 0.004, 8 * k, motion)
        sides = take_in(SETUP, sides, event)
        if k > 300:
            shown.append((moves, sides.real.last.qdot))
    real: RealSide = sides.real
    assert real.noise == pytest.approx(max(noise_deg, noise_mm), rel=0.3)
    assert {qdot for moves, qdot in shown if not moves} == {(0.0,) * len(home)}
    last = np.array([qdot[0] for moves, qdot in shown if moves][50:])
    assert last.mean() == pytest.approx(math.radians(5.0), rel=0.1)
    assert last.std() <= 0.005 * SETUP.velocity[0]


def test_a_joint_that_stands_while_another_moves_has_no_speed_but_now_and_then() -> None:
    """Its noise alone would make the twin tremble: 60 of 60 readings had a speed of it.

    One that creeps by ten times its noise within what is looked at has the speed that it has.
    """
    source, noise = np.random.default_rng(5), 1e-4
    t = 0.016 * np.arange(80)
    rows = np.stack([2.0 * t, 0.0 * t, 0.01 * t], axis=1)
    rows += source.normal(0.0, noise, rows.shape)
    samples = readings(rows, 0.016)
    limits = (MOST_SPEED * 3, MOST_ACCELERATION * 3)
    told = np.array(
        [speeds(samples[:k], samples[k], (noise,) * 3, *limits) for k in range(20, len(samples))]
    )
    assert np.abs(told[:, 0] - 2.0).max() < 0.1
    assert np.count_nonzero(told[:, 1]) <= 2
    assert np.count_nonzero(told[:, 2]) >= 55 and abs(told[:, 2].mean() - 0.01) < 2e-3
