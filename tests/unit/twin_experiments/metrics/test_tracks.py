"""Where a side was at equal steps of time, and how far along its way."""

from __future__ import annotations

import numpy as np
import pytest
from twin_experiments.metrics.series import Motion
from twin_experiments.metrics.tracks import resample, travelled

STAMPS = np.linspace(0.0, 1.0, 11)
SLOPE = 0.5


@pytest.mark.parametrize(
    ("end", "count"), [(0.0, 1), (0.29, 30), (0.295, 30), (0.3, 31), (1.0, 101)]
)
def test_every_step_up_to_the_end_is_there(end: float, count: int) -> None:
    """0.29 s times 100 is a rounding less than 29: no step is lost by it, and none is behind."""
    motion = Motion("real", STAMPS, SLOPE * STAMPS[:, None], np.full((11, 1), SLOPE))
    positions, velocities = resample(motion, 100.0, 0.0, end)
    assert positions[:, 0] == pytest.approx(SLOPE * 0.01 * np.arange(count), abs=1e-9)
    assert velocities[:, 0] == pytest.approx([SLOPE] * count)


def test_a_way_is_the_sum_of_its_steps_from_its_first_place() -> None:
    """Back and forth counts twice."""
    places = np.array([[1.0, 0.0, 0.0], [1.0, 3.0, 4.0], [1.0, 0.0, 0.0], [1.0, 0.0, 2.0]])
    assert travelled(places) == pytest.approx([0.0, 5.0, 10.0, 12.0])
