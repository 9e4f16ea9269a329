"""A person who walks to and fro is where the speed and the time say."""

from __future__ import annotations

import pytest
from twin_experiments.walk import walked


@pytest.mark.parametrize(
    ("elapsed", "x"), [(0.0, 3.0), (1.0, 2.5), (4.0, 1.0), (5.0, 1.5), (8.0, 3.0), (9.0, 2.5)]
)
def test_walks_there_and_back(elapsed: float, x: float) -> None:
    """Two metres at half a metre a second take four seconds each way."""
    assert walked((3.0, 0.5, 0.0), (1.0, 0.5, 0.0), 0.5, elapsed) == pytest.approx((x, 0.5, 0.0))


@pytest.mark.parametrize(("end", "speed"), [((3.0, 0.0, 0.0), 1.0), ((1.0, 0.0, 0.0), 0.0)])
def test_stands_without_a_way_or_a_speed(end: tuple[float, float, float], speed: float) -> None:
    """No division by nothing."""
    assert walked((3.0, 0.0, 0.0), end, speed, 7.0) == (3.0, 0.0, 0.0)
