"""How noisy a robot at rest is."""

from __future__ import annotations

import numpy as np
import pytest
from twin_controller.core.sides.measure import noise_at_rest

READINGS, DT = 48, 0.0097


def rows(noise: float, speed: float = 0.0, acceleration: float = 0.0, seed: int = 0) -> list:
    """Return readings of two joints; the first moves [deg/s], [deg/s^2], the second is quieter."""
    random, t = np.random.default_rng(seed), DT * np.arange(READINGS)
    way = speed * t + 0.5 * acceleration * t**2
    return np.stack(
        [
            way + random.normal(0.0, noise, READINGS),
            5.0 + random.normal(0.0, 0.3 * noise, READINGS),
        ],
        axis=1,
    ).tolist()


@pytest.mark.parametrize("noise", [0.001, 0.01, 0.05])
def test_the_noise_of_the_noisiest_joint_is_found(noise: float) -> None:
    """From half a second of readings, in nearly all of them."""
    found = [noise_at_rest(rows(noise, seed=seed)) for seed in range(200)]
    known = [value for value in found if value is not None]
    assert len(known) > 190
    assert np.mean(known) == pytest.approx(noise, rel=0.05)
    assert max(known) < 1.5 * noise


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01])
@pytest.mark.parametrize("speed", [0.5, -5.0, 100.0])
def test_a_robot_that_moves_tells_no_noise(noise: float, speed: float) -> None:
    """However slowly: 0.5 deg/s are 0.005 deg from one reading to the next."""
    for seed in range(50):
        assert noise_at_rest(rows(noise, speed, seed=seed)) is None


def test_the_beginning_and_the_turn_of_a_motion_are_no_noise() -> None:
    """A swing whose halves have the same mean strays more than from reading to reading."""
    assert noise_at_rest(rows(0.003, 0.0, 40.0)) is None
    turn = 0.5 * DT * READINGS
    assert noise_at_rest(rows(0.003, -40.0 * turn, 40.0)) is None


def test_a_robot_without_noise_has_none() -> None:
    """Also one whose readings are not whole binary numbers."""
    assert noise_at_rest([[0.1, -160.3]] * READINGS) == pytest.approx(0.0, abs=1e-9)
