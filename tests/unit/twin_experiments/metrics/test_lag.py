"""The lag of the follower, to a fraction of a step, and None where no lag fits."""

from __future__ import annotations

import numpy as np
import pytest
from twin_experiments.metrics.lag import estimate_lag, tool_velocity
from twin_experiments.metrics.series import Array

RATE, MAX_S = 100.0, 0.1
REACH = round(MAX_S * RATE)
TIMES = np.arange(0.0, 4.0, 1.0 / RATE)


def tool(late: float = 0.0) -> Array:
    """Return velocities of a tool that moves to and fro, so late [s]."""
    t = TIMES - late
    return np.stack((np.sin(5.0 * t), np.cos(3.0 * t), 0.3 * np.sin(7.0 * t)), axis=1)


def lag(late: float, segments: tuple[tuple[int, int], ...] = ((0, len(TIMES)),)) -> float | None:
    """Return the lag that is found of a follower that is so late [s]."""
    return estimate_lag(tool(), tool(late), segments, RATE, MAX_S)


@pytest.mark.parametrize("steps", [-8.9, -3.3, -0.25, 0.0, 0.3, 0.5, 1.7, 6.4, 8.8])
def test_a_part_of_a_step_is_found_with_its_sign(steps: float) -> None:
    """The parabola leans to the nearer neighbour: an error of a tenth of a step is too much."""
    assert lag(steps / RATE) == pytest.approx(steps / RATE, abs=0.05 / RATE)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_lag_at_the_edge_of_the_search_is_none(side: float) -> None:
    """It may as well be larger; the last step inside the edge counts."""
    assert lag(side * MAX_S) is None
    inside = side * (REACH - 1) / RATE
    assert lag(inside) == pytest.approx(inside, abs=0.05 / RATE)


@pytest.mark.parametrize(("length", "used"), [(4 * REACH, True), (4 * REACH - 1, False)])
def test_a_short_run_is_not_used_wherever_it_begins(length: int, used: bool) -> None:
    """Shorter than four times the largest lag says too little; its length counts, not its end."""
    found = lag(0.03, ((200, 200 + length),))
    assert found == (pytest.approx(0.03, abs=0.05 / RATE) if used else None)


@pytest.mark.parametrize(("scale", "found"), [(1e-3, 0.03), (0.0, None)])
def test_a_tool_that_moves_ever_so_slowly_has_a_lag(scale: float, found: float | None) -> None:
    """How fast it is says nothing of who is late; only of one that stands nothing is known."""
    segments = ((0, len(TIMES)),)
    slow = estimate_lag(scale * tool(), scale * tool(0.03), segments, RATE, MAX_S)
    assert slow == (None if found is None else pytest.approx(found, abs=0.05 / RATE))


@pytest.mark.parametrize("length", [255, 256, 257, 258])
def test_the_last_instant_of_a_run_counts(length: int) -> None:
    """However long the run is: both tools jerk once, and only at the edge of the search at once."""
    leader, follower = np.zeros((2, length, 3))
    leader[-1 - REACH, 0] = follower[-1, 0] = 1.0
    assert estimate_lag(leader, follower, ((0, length),), RATE, MAX_S) is None


def test_a_tool_that_was_seen_once_between_two_holes_has_no_velocity() -> None:
    """Two instants are the least that say how fast it was."""
    seen = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.5, 0.0, 0.1]])
    found = tool_velocity(seen, ((0, 1), (1, 3)), 10.0)
    assert found == pytest.approx(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 1.0], [2.0, 0.0, 1.0]]))
