"""Pauses of the machine, from the times at which anything at all was recorded."""

from __future__ import annotations

import numpy as np
import pytest
from twin_experiments.metrics.pauses import (
    Pause,
    find_pauses,
    longest_ms,
    pauses_within,
    undisturbed,
)

TWO = (Pause(1.0, 0.05), Pause(3.0, 0.1))


@pytest.mark.parametrize(
    ("arrivals", "pauses"),
    [
        ([], []),
        ([5.0], []),
        ([0.0, 0.029, 0.058], []),
        ([0.0, 0.01, 0.05, 0.06], [(0.01, 0.04)]),
        ([0.31, 0.0, 0.2, 0.01, 0.21, 0.3], [(0.01, 0.19), (0.21, 0.09)]),
    ],
)
def test_a_silence_of_more_than_30_ms_is_a_pause(
    arrivals: list[float], pauses: list[tuple[float, float]]
) -> None:
    """Whatever the order in which the topics are read."""
    found = find_pauses(np.array(arrivals))
    assert [each.start for each in found] == pytest.approx([start for start, _ in pauses])
    lengths = [each.duration for each in found]
    assert lengths == pytest.approx([duration for _, duration in pauses])


def test_the_longest_pause_is_told_in_milliseconds() -> None:
    """0 if there is none."""
    assert longest_ms(TWO) == pytest.approx(100.0)
    assert longest_ms(()) == 0.0


@pytest.mark.parametrize(
    ("start", "end", "count"),
    [(0.0, 0.9, 0), (0.0, 1.01, 1), (1.04, 2.0, 1), (1.06, 2.9, 0), (0.0, 4.0, 2)],
)
def test_pauses_of_an_experiment_are_those_that_touch_it(
    start: float, end: float, count: int
) -> None:
    """Also one that began before it, or ends after it."""
    assert len(pauses_within(TWO, start, end)) == count


def test_what_lies_in_a_pause_or_within_200_ms_after_it_is_disturbed() -> None:
    """1.00 to 1.25 s for a pause from 1.00 to 1.05 s."""
    instants = np.array([0.99, 1.0, 1.05, 1.24, 1.26, 2.99, 3.2, 3.31])
    expected = [True, False, False, False, True, True, False, True]
    assert undisturbed(instants, TWO).tolist() == expected
