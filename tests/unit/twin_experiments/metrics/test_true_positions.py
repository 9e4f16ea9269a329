"""Positions at rest with the real side's tool where it really is, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from twin_experiments.metrics.errors import MetricsSettings, compare
from twin_experiments.metrics.series import Array, Motion
from twin_experiments.metrics.true_positions import TrueArm, TruePositioning, true_positioning

SETTINGS = MetricsSettings(reach_mm=650.0, moving_speeds=np.full(3, 1e-3))
STAMPS = np.arange(0.0, 4.0, 0.005)
TARGET = {"P": np.array([0.2, 0.0, 0.0])}


def sliding(q: Array) -> Array:
    """Take the joints for the tool: three sliding joints along x, y, z."""
    return q


def one_move(side: str, *, up: float = 0.0) -> Motion:
    """Rest, move 0.2 m along x within 1 s, rest again; joint 3 is ``up`` [m] further."""
    u = np.clip(STAMPS - 1.0, 0.0, 1.0)
    zeros = np.zeros_like(STAMPS)
    x, speed = 0.2 * (3.0 * u**2 - 2.0 * u**3), 0.2 * (6.0 * u - 6.0 * u**2)
    return Motion(
        side,
        STAMPS,
        np.column_stack((x, zeros, zeros + up)),
        np.column_stack((speed, zeros, zeros)),
    )


def longer(q: Array) -> Array:
    """Do the same with a tool that is 0.3 mm further in y and 0.4 mm in z."""
    return q + np.array([0.0, 0.3e-3, 0.4e-3])


def measured(up: float, tool: object, offsets: list[float]) -> TruePositioning | None:
    """Compare a real side that is ``up`` [m] too high with its twin."""
    compared = compare(one_move("real", up=up), one_move("twin"), sliding, SETTINGS, "real", TARGET)
    arm = TrueArm(tool, np.array(offsets))  # type: ignore[arg-type]
    return true_positioning(compared, sliding, arm, TARGET, SETTINGS)


def test_true_lengths_add_their_error_and_calibration_removes_it() -> None:
    """0.3 and 0.4 mm at a right angle are 0.5 mm; both sides agree on their joints."""
    found = measured(0.0, longer, [0.0, 0.0, 0.0])
    assert found is not None
    assert (found.max_mm, found.calibrated_mm) == pytest.approx((0.5, 0.0), abs=1e-9)
    assert found.removable_mm == pytest.approx(0.5)


def test_a_zero_offset_is_removed_by_calibration_too() -> None:
    """0.1 of 0.3 mm are a zero offset; with its true lengths the tool is 0.3 and 0.7 mm off."""
    found = measured(0.3e-3, longer, [0.0, 0.0, 0.1e-3])
    assert found is not None
    assert found.max_mm == pytest.approx(np.hypot(0.3, 0.7))
    assert found.calibrated_mm == pytest.approx(0.2)


def test_without_a_rest_there_is_no_figure() -> None:
    """A side that never stands still has no position at rest."""
    turning = np.column_stack([np.sin(STAMPS)] * 3)
    speeds = np.column_stack([np.cos(STAMPS) + 2.0] * 3)
    sides = [Motion(side, STAMPS, turning, speeds) for side in ("real", "twin")]
    compared = compare(sides[0], sides[1], sliding, SETTINGS, "real", TARGET)
    arm = TrueArm(longer, np.zeros(3))
    assert true_positioning(compared, sliding, arm, TARGET, SETTINGS) is None
