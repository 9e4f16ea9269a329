"""A rest ends where the twin begins to stir, not where it is fast enough to count as moving."""

from __future__ import annotations

import numpy as np
import pytest
from twin_experiments.metrics.errors import STIRS_S, MetricsSettings, compare
from twin_experiments.metrics.series import Motion

RATE = 100.0
SETTINGS = MetricsSettings(reach_mm=650.0, moving_speeds=np.array([1e-3]), rate_hz=RATE)
RESTS = 3.0
"""From then on the twin stirs [s]."""


def motion(side: str, stirs: int, slow: float) -> Motion:
    """One joint rests, goes slowly for so many steps [m/s], then fast for a second."""
    stamps = np.arange(0.0, RESTS + stirs / RATE + 1.0, 1.0 / RATE)
    begun = round(RESTS * RATE)
    speed = np.where(np.arange(len(stamps)) < begun + stirs, slow, 0.1)
    speed[:begun] = 0.0
    place = np.concatenate(([0.0], np.cumsum(speed[:-1]) / RATE))
    return Motion(side, stamps, place[:, None], speed[:, None])


def end_of_rest(stirs: int, real: float, twin: float) -> float:
    """Return when the one rest ends that is found, of sides that begin so slowly."""
    found = compare(
        motion("real", stirs, real),
        motion("twin", stirs, twin),
        tool=lambda q: np.column_stack((q, 0.0 * q, 0.0 * q)),
        leader="twin",
        set_positions={},
        settings=SETTINGS,
    )
    (rest,) = found.rests
    return rest.end + SETTINGS.rest_margin_s


@pytest.mark.parametrize("stirs", [0, 1, 2, 7, 8, round(STIRS_S * RATE) - 1])
def test_a_rest_ends_where_the_twin_begins_to_stir(stirs: int) -> None:
    """To the step, however long its slow beginning is."""
    assert end_of_rest(stirs, 0.0, 2e-4) == pytest.approx(RESTS, abs=1.1 / RATE)
    ends = [end_of_rest(steps, 0.0, 2e-4) for steps in (0, stirs)]
    assert ends[0] == pytest.approx(ends[1], abs=0.1 / RATE)


@pytest.mark.parametrize(("real", "twin"), [(2e-4, 0.0), (0.0, 0.5e-4)])
def test_noise_of_the_robot_and_a_drift_of_the_twin_end_no_rest(real: float, twin: float) -> None:
    """A twentieth of the moving speed is no beginning, and the robot's readings are rough."""
    assert end_of_rest(20, real, twin) == pytest.approx(RESTS + 20 / RATE, abs=1.1 / RATE)


def test_a_beginning_is_traced_back_for_a_limited_time() -> None:
    """A twin that creeps all the time would have no rest at all."""
    stirs = round(2.0 * STIRS_S * RATE)
    assert end_of_rest(stirs, 0.0, 2e-4) == pytest.approx(RESTS + STIRS_S, abs=1.1 / RATE)
