"""Trace alignment.

Against brute force, and what it says of late, wrong, shorter and equal traces.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from twin_analysis.compare.fidelity import Fidelity, FidelityError, measure_fidelity
from twin_experiments.metrics.series import Array

TIMES = np.arange(0.0, 10.0, 0.02)
ACCEPTED = np.array([0.02, 0.02])
GAP = 0.2


def wave(times: Array) -> Array:
    """Return a motion that never repeats within the time looked at."""
    return np.stack((np.sin(times) + 0.1 * times, np.cos(0.7 * times)), axis=1)


def fidelity(one: Array, other: Array, band: int = 50, accepted: Array = ACCEPTED) -> Fidelity:
    """Measure with everything in motion."""
    return measure_fidelity(
        one, other, accepted, (np.ones(len(one), bool), np.ones(len(other), bool)), GAP, band
    )


def best_score(one: Array, other: Array) -> float:
    """Fill the whole matrix of Needleman and Wunsch cell by cell."""
    table = np.full((len(one) + 1, len(other) + 1), -np.inf)
    table[0, 0] = 0.0
    for i in range(len(one) + 1):
        for j in range(len(other) + 1):
            candidates = [table[i, j]]
            if i and j:
                distance = np.abs(one[i - 1] - other[j - 1])
                if (distance <= 1.0).all():
                    candidates.append(table[i - 1, j - 1] + 1.0 - distance.mean())
            if i:
                candidates.append(table[i - 1, j] - GAP)
            if j:
                candidates.append(table[i, j - 1] - GAP)
            table[i, j] = max(candidates)
    return float(table[-1, -1])


@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.integers(1, 12))
def test_the_alignment_is_the_best_there_is(seed: int, n: int, m: int) -> None:
    """By anti-diagonals or cell by cell, the score is the same."""
    generator = np.random.default_rng(seed)
    one, other = generator.normal(size=(n, 2)), generator.normal(size=(m, 2))
    found = fidelity(one, other, accepted=np.ones(2))
    pairs = found.pairs
    score = sum(1.0 - np.abs(one[i] - other[j]).mean() for i, j in pairs) - GAP * (
        n + m - 2 * len(pairs)
    )
    assert score == pytest.approx(best_score(one, other), abs=1e-9)
    assert (np.diff(pairs, axis=0) > 0).all(), "order is kept"
    assert (np.abs(one[pairs[:, 0]] - other[pairs[:, 1]]) <= 1.0).all(), (
        "only what is accepted is matched"
    )


def test_equal_traces_match_wholly() -> None:
    """Every snapshot with its own counterpart, at distance 0."""
    found = fidelity(wave(TIMES), wave(TIMES))
    assert (found.matched_percent, found.moving_percent, found.mean_distance) == (100.0, 100.0, 0.0)
    assert (found.gaps, found.longest_gap, found.mean_shift) == (0, 0, 0.0)


@pytest.mark.parametrize("late", [1, 5, 20])
def test_a_late_trace_matches_but_for_its_ends_and_shows_its_lag(late: int) -> None:
    """A constant lag costs as many snapshots at either end, and is the mean shift."""
    found = fidelity(wave(TIMES), wave(TIMES - 0.02 * late))
    assert found.mean_shift == pytest.approx(late, abs=0.05)
    assert found.matched_percent == pytest.approx(100.0 * (1.0 - late / len(TIMES)), abs=0.05)
    assert found.mean_distance == pytest.approx(0.0, abs=1e-9)


def test_a_wrong_path_does_not_match() -> None:
    """An offset beyond what is accepted leaves one gap as long as both."""
    found = fidelity(wave(TIMES), wave(TIMES) + 1.0)
    assert (found.matched_percent, found.mean_distance, found.mean_shift) == (0.0, None, None)
    assert (found.gaps, found.longest_gap) == (1, 2 * len(TIMES))


def test_an_offset_within_what_is_accepted_is_the_distance_of_the_matched() -> None:
    """Half of what is accepted, in the direction in which nothing else helps."""
    still = np.zeros((100, 2))
    found = fidelity(still, still + 0.5 * ACCEPTED)
    assert found.matched_percent == 100.0 and found.mean_distance == pytest.approx(0.5)


def test_a_trace_that_strays_for_a_while_has_one_gap() -> None:
    """The gap is as long as the stray part of both traces."""
    strays = wave(TIMES)
    strays[200:250] += 1.0
    found = fidelity(wave(TIMES), strays)
    assert (found.gaps, found.longest_gap) == (1, 100)
    assert found.matched_percent == pytest.approx(100.0 * (1.0 - 50 / len(TIMES)))


def test_traces_of_different_lengths_are_aligned() -> None:
    """The band is widened to the difference of the lengths."""
    found = fidelity(wave(TIMES), wave(TIMES[100:]), band=5)
    assert found.pairs[:, 0].tolist() == list(range(100, len(TIMES)))


def test_rests_do_not_make_a_moving_part_look_better() -> None:
    """Of 100 snapshots at rest and 100 in motion, those in motion are wrong."""
    one, other = np.zeros((200, 2)), np.zeros((200, 2))
    one[100:, 0] = np.arange(1.0, 101.0)
    other[100:, 1] = np.arange(1.0, 101.0)
    moves = np.arange(200) >= 100
    found = measure_fidelity(one, other, ACCEPTED, (moves, moves), GAP, 20)
    assert found.matched_percent == pytest.approx(50.0) and found.moving_percent == 0.0


@pytest.mark.parametrize(
    ("one", "other", "accepted", "text"),
    [
        (np.zeros((0, 2)), np.zeros((3, 2)), ACCEPTED, "the first trace has shape"),
        (np.zeros((3, 2)), np.zeros((3, 1)), ACCEPTED, "the second trace has shape"),
        (np.zeros((3, 2)), np.full((3, 2), np.nan), ACCEPTED, "the second trace is not finite"),
        (np.zeros((3, 2)), np.zeros((3, 2)), np.array([0.0, 1.0]), "are not all positive"),
    ],
)
def test_what_cannot_be_aligned_is_refused(
    one: Array, other: Array, accepted: Array, text: str
) -> None:
    """The text says which trace and why."""
    with pytest.raises(FidelityError, match=text):
        fidelity(one, other, accepted=accepted)
