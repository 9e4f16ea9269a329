"""A robot that stamps its answers, not its readings: its motion tells when it renewed them."""

from __future__ import annotations

import numpy as np
import pytest
from twin_controller.estimation.latch import MOST, UNKNOWN_AGE_MS, Latch, cut, renewed

VELOCITY = (7.7, 12.0, 2.0)
POLL_MS, TICK_MS = 9.7, 2
FULL_S, NOISE = 0.25, 2e-6


def move(seconds: float) -> np.ndarray:
    """Return smooth moves there and back, one each 0.6 s, in parts of greatest speeds [s]."""
    at = np.clip((seconds % 0.6 - 0.1) / FULL_S, 0.0, 1.0)
    way = at**3 * (10.0 - 15.0 * at + 6.0 * at**2)
    return np.array([0.06, -0.02, 0.01]) * (1.0 - way if int(seconds / 0.6) % 2 else way)


def heard(
    latch: Latch, period: int, phase: int, moves: int = 1, seed: int = 0, begin: float = 5000.0
) -> list[Latch]:
    """Return what is known after each answer of a robot with such a grid."""
    chance = np.random.default_rng(seed)
    found, clock = [], begin + chance.uniform(0.0, 20.0)
    while clock < begin + moves * 600.0:
        renewed_at = clock - (clock - phase) % period
        q = move((renewed_at - begin) * 1e-3) + chance.normal(0.0, NOISE, 3)
        stamp = int(clock) // TICK_MS * TICK_MS
        latch = renewed(latch, stamp, list(q * VELOCITY), VELOCITY)
        found.append(latch)
        clock += POLL_MS + chance.uniform(-1.0, 1.0)
    return found


@pytest.mark.parametrize(("period", "phase"), [(4, 0), (8, 4), (8, 6), (10, 2), (12, 8), (16, 10)])
def test_the_grid_is_found_in_the_first_move(period: int, phase: int) -> None:
    """Period and phase, as far as ticks of 2 ms tell them, and so each reading's instant."""
    last = heard(Latch(), period, phase, moves=2)[-1]
    assert last.settled and last.period == period * 1e-3 and last.doubt == 0.0
    for stamp in range(9000, 9000 + 4 * period, TICK_MS):
        assert last.instant(stamp) == pytest.approx(stamp - (stamp - phase) % period, abs=1.0)


def test_nothing_is_subtracted_from_stamps_that_are_the_readings_own() -> None:
    """Whatever the motion and its noise: no grid, in none of many moves."""
    for seed in range(12):
        steps = heard(Latch(), TICK_MS, 0, moves=3, seed=seed)
        assert steps[-1].settled and not steps[-1].period_ms
        assert steps[-1].instant(1234) == 1234 and steps[-1].doubt == 0.0


def test_a_reading_of_unknown_age_is_taken_for_half_of_the_oldest() -> None:
    """A robot that stands shows nothing: until it moves there is a doubt, and no period."""
    steps = heard(Latch(), 8, 4)
    assert steps[5].instant(1000) == 1000 - UNKNOWN_AGE_MS
    assert steps[5].doubt > 0.0 and not steps[5].period


def stood(period: int, phase: int, noise: float, answers: int = 200) -> Latch:
    """Return what is known of a robot that stands, with noise that is new in each reading."""
    chance, latch, clock, shown = np.random.default_rng(5), Latch(), 5000.0, None
    for _ in range(answers):
        stamp = int(clock) // TICK_MS * TICK_MS
        renewed_at = stamp - (stamp - phase) % period
        if renewed_at != shown:
            shown, q = renewed_at, chance.normal(0.0, 1.0, 3) * noise
        latch = renewed(latch, stamp, list(q * VELOCITY), VELOCITY)
        clock += POLL_MS + chance.uniform(-1.0, 1.0)
    return latch


@pytest.mark.parametrize(("period", "phase"), [(10, 2), (12, 8), (14, 0), (16, 10)])
def test_a_robot_that_stands_shows_a_slow_grid_by_its_noise(period: int, phase: int) -> None:
    """Its first move is followed by readings whose age is known."""
    latch = stood(period, phase, NOISE)
    assert (latch.settled, latch.period_ms, latch.phase_ms) == (True, period, phase)


@pytest.mark.parametrize(("period", "noise"), [(2, NOISE), (4, NOISE), (8, NOISE), (12, 0.0)])
def test_answers_that_are_all_new_or_all_the_same_show_none(period: int, noise: float) -> None:
    """Faster than it is asked, any grid fits; and a robot without noise never changes."""
    latch = stood(period, 0, noise)
    assert not latch.settled and not latch.period_ms


def test_a_robot_that_was_set_up_anew_is_seen_again() -> None:
    """Another phase after a restart, another period after a change."""
    known = cut(heard(Latch(), 8, 4)[-1])
    assert (known.period_ms, known.rows) == (8, ())
    shifted = heard(known, 8, 0, moves=2, seed=1)[-1]
    assert shifted.instant(8008) == pytest.approx(8008, abs=1.0)
    slower = heard(known, 12, 0, moves=2, seed=2)[-1]
    assert slower.period_ms == 12


def test_who_never_moves_clearly_keeps_its_stamps() -> None:
    """Curves that tell nothing end the search."""
    chance = np.random.default_rng(3)
    latch = Latch()
    for count in range(400):
        q = chance.normal(0.0, 1.0, 3) * 1e-3 + count * 1e-3
        latch = renewed(latch, 10 * count, list(q * VELOCITY), VELOCITY)
    assert latch.settled and latch.drawn == MOST
