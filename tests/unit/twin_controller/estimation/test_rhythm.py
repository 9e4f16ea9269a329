"""Period and jitter of a robot's readings, found from stamps alone."""

from __future__ import annotations

from random import Random

import pytest
from twin_controller.estimation.rhythm import ASSUMED_MS, ENOUGH, FEW, FORGET, Rhythm, heard

POLL_MS = 9.7


def rhythm_of(period: int, error: int, readings: int, seed: int = 1) -> Rhythm:
    """Poll a robot that renews its reading each ``period`` ms, and stamps it ``error`` ms off."""
    random, rhythm = Random(seed), Rhythm()
    begin = random.randrange(10**9)
    while rhythm.count < readings:
        begin_of = begin + int(POLL_MS * (rhythm.count + 1)) // period * period
        stamp = begin_of + random.randint(-error, error)
        rhythm = heard(rhythm, stamp, 1e-3 * POLL_MS * (rhythm.count + 1))
    return rhythm


def test_a_clock_that_is_set_leaves_nothing_of_the_one_before() -> None:
    """An hour in the spread would keep a robot from being led for half a minute."""
    rhythm = rhythm_of(2, 5, 300)
    for reading in range(301, 601):
        at = 1e-3 * POLL_MS * reading
        stamp = 3_600_000 + int(1e3 * at) // 2 * 2
        rhythm = heard(rhythm, stamp, at)
        assert rhythm.spread < 0.01
    assert rhythm.period == pytest.approx(0.002)


@pytest.mark.parametrize("period", [1, 2, 4, 8, 10, 12, 16])
def test_a_period_is_found_within_two_seconds(period: int) -> None:
    """For every period that robots have, wherever their clock began."""
    for seed in range(5):
        assert rhythm_of(period, 0, ENOUGH, seed).period == pytest.approx(period * 1e-3)


@pytest.mark.parametrize(("period", "error"), [(8, 1), (8, 2), (16, 4), (4, 1)])
def test_a_period_is_found_though_stamps_are_wrong(period: int, error: int) -> None:
    """And how wrong they are: a uniform error has the deviation error / sqrt(3), about."""
    for seed in range(5):
        rhythm = rhythm_of(period, error, 300, seed)
        assert rhythm.period == pytest.approx(period * 1e-3)
        variance = sum(k * k for k in range(-error, error + 1)) / (2 * error + 1)
        assert rhythm.jitter == pytest.approx(variance**0.5 * 1e-3, rel=0.3)


@pytest.mark.parametrize(("period", "error"), [(4, 2), (6, 2)])
def test_no_part_of_a_period_is_taken_for_it(period: int, error: int) -> None:
    """All parts of these have the same R: with one of them the robot's clock would be late."""
    for seed in range(8):
        found = [rhythm_of(period, error, count, seed) for count in range(ENOUGH, FORGET + 1, 100)]
        assert found[-1].period == pytest.approx(period * 1e-3)
        assert all(rhythm.period in (0.004, 0.001 * period) for rhythm in found)
        # Too rough to tell which reading of the grid a stamp means.
        assert not any(rhythm.corrects for rhythm in found)


@pytest.mark.parametrize(("plain", "period"), [(True, 0.001), (False, 0.004)])
def test_a_clock_beside_the_readings_is_of_no_age(plain: bool, period: float) -> None:
    """However its stamps vary: those vary with the answers' times. Others are of some age."""
    random, rhythm = Random(1), Rhythm()
    for k in range(ENOUGH):
        at = POLL_MS * k
        rhythm = heard(rhythm, int(at) + random.randint(-3, 3), 1e-3 * at, plain)
    assert rhythm.period == period and rhythm.jitter > 0.001 and not rhythm.corrects


def test_the_period_of_exact_stamps_is_no_other_that_they_nearly_keep() -> None:
    """Polls in step with 10 ms see only every other or third reading of 4 ms."""
    random, rhythm = Random(1), Rhythm()
    for k in range(1000):
        rhythm = heard(rhythm, int(10.0 * k + random.uniform(-0.3, 0.3) + 5.0) // 4 * 4, 1e-2 * k)
    assert rhythm.period == pytest.approx(0.004)


def test_stamps_that_are_right_have_no_jitter() -> None:
    """And before enough of them have come, nothing is claimed."""
    assert rhythm_of(2, 0, 300).jitter == 0.0
    for early in (rhythm_of(2, 0, FEW - 1), rhythm_of(8, 1, ENOUGH - 1), rhythm_of(1, 0, 150)):
        assert (early.known, early.period, early.jitter) == (False, ASSUMED_MS * 1e-3, 0.0)


def test_exact_stamps_tell_their_period_at_once() -> None:
    """A fifth of a second is enough then, and it stays."""
    for period in (2, 4, 8, 10):
        for seed in range(5):
            for readings in (FEW, 2 * FEW, 5 * FEW):
                rhythm = rhythm_of(period, 0, readings, seed)
                assert rhythm.known and rhythm.period == pytest.approx(period * 1e-3)


@pytest.mark.parametrize(("period", "error"), [(2, 5), (1, 3), (8, 8)])
def test_stamps_too_rough_for_a_period_are_known_as_rough(period: int, error: int) -> None:
    """The clock's bounds must be as wide as they are, or readings contradict each other."""
    for seed in range(5):
        rhythm = rhythm_of(period, error, 300, seed)
        variance = sum(k * k for k in range(-error, error + 1)) / (2 * error + 1) + period**2 / 12
        assert rhythm.jitter == pytest.approx(variance**0.5 * 1e-3, rel=0.3)


@pytest.mark.parametrize(("period", "error"), [(8, 1), (8, 2), (16, 4)])
def test_rough_stamps_of_a_known_period_tell_their_readings_instant(
    period: int, error: int
) -> None:
    """Each reading lies on the robot's own grid: within a tenth of what its stamp is wrong by."""
    for seed in range(5):
        random, rhythm = Random(seed), Rhythm()
        begin, wrong = random.randrange(10**9), []
        for k in range(600):
            true = begin + int(POLL_MS * (k + 1)) // period * period
            stamp = true + random.randint(-error, error)
            rhythm = heard(rhythm, stamp, 1e-3 * POLL_MS * (k + 1))
            if k > ENOUGH:
                # The grid itself is only known from the same stamps.
                wrong.append(rhythm.instant(stamp) - true)
        assert rhythm.corrects and rhythm.spread == 0.0
        assert max(map(abs, wrong)) < 0.3 * error, seed


@pytest.mark.parametrize(("period", "error"), [(2, 0), (8, 0), (2, 5), (8, 8), (4, 2)])
def test_other_stamps_stay_as_they_are(period: int, error: int) -> None:
    """Exact ones have nothing to correct, and those too rough tell no grid."""
    rhythm = rhythm_of(period, error, 600)
    assert not rhythm.corrects
    assert rhythm.instant(123457) == 123457.0
    assert rhythm.spread == rhythm.roughness
