"""The preview of gains, held against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from harness.workspace import ROOT
from harness.yaml_files import shipped
from operator_panel.config import load_panel
from operator_panel.step_response import describe, step_response
from scara_config import load, load_robot
from scara_description.inertia import largest_inertia

ROBOT = load_robot(ROOT / "config")
PREVIEW = load_panel(ROOT / "config").preview
SHIPPED = load(shipped("pid_gains.yaml"), dict)


def gains(p: float, d: float, i: float = 0.0, i_clamp: float = 0.0) -> dict[str, float]:
    """Write gains by name."""
    return {"p": p, "i": i, "d": d, "i_clamp": i_clamp}


def test_critically_damped_step_follows_its_closed_form() -> None:
    """Gains p = J w^2 and d = 2 J w give 1 - (1 + w t) exp(-w t)."""
    inertia, w = 2.0, 30.0
    response = step_response(gains(inertia * w * w, 2 * inertia * w), inertia, 1e9, 0.01, 0.5)
    t = np.array(response.times)
    np.testing.assert_allclose(response.values, 1 - (1 + w * t) * np.exp(-w * t), atol=0.012)


@pytest.mark.parametrize("damping", [0.2, 0.5, 0.7])
def test_overshoot_of_an_underdamped_step_is_that_of_its_damping(damping: float) -> None:
    """100 exp(-pi z / sqrt(1 - z^2)) percent."""
    inertia, w = 1.0, 30.0
    response = step_response(
        gains(inertia * w * w, 2 * damping * inertia * w), inertia, 1e9, 0.01, 2.0
    )
    expected = 100 * math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
    assert response.overshoot_percent == pytest.approx(expected, abs=1.5)


@pytest.mark.parametrize("joint", SHIPPED)
def test_shipped_gains_settle_within_the_window(joint: str) -> None:
    """The page shows a whole response for what is shipped."""
    profile = ROBOT.joint(joint)
    ranges = {each.name: (each.lower, each.upper) for each in ROBOT.twin_joints}
    inertia = largest_inertia(ROBOT.description.read_text(), ranges, joint)
    step = (PREVIEW.step_deg if profile.unit == "deg" else PREVIEW.step_mm) * profile.scale
    response = step_response(
        SHIPPED[joint]["position"], inertia, profile.effort, step, PREVIEW.duration_s
    )
    assert response.settling_s < PREVIEW.duration_s
    assert describe(response).startswith("overshoot")


def test_undamped_gains_are_said_not_to_settle() -> None:
    """An operator sees it before the robot feels it."""
    response = step_response(gains(900.0, 0.0), 1.0, 1e9, 0.01, 1.0)
    assert math.isinf(response.settling_s) and "does not settle" in describe(response)


def test_gains_that_run_away_end_the_simulation_early() -> None:
    """No overflow reaches the chart."""
    response = step_response(gains(100.0, -500.0), 1.0, 1e9, 0.01, 2.0)
    assert math.isinf(response.settling_s) and all(map(math.isfinite, response.values))


def test_weak_motor_is_slower() -> None:
    """The effort is bounded, as in the simulator."""
    strong, weak = (
        step_response(gains(900.0, 60.0), 1.0, effort, 0.1, 1.0) for effort in (1e9, 5.0)
    )
    assert weak.settling_s > 1.3 * strong.settling_s


@pytest.mark.parametrize("missing", ["p", "i", "d", "i_clamp"])
def test_missing_or_infinite_gain_is_named(missing: str) -> None:
    """Each gain is needed."""
    for wrong in ({}, {missing: math.inf}):
        with pytest.raises(ValueError, match=f"gain {missing} is missing or not finite"):
            step_response(
                {k: v for k, v in gains(1.0, 1.0).items() if k != missing} | wrong,
                1.0,
                1.0,
                1.0,
                0.1,
            )
