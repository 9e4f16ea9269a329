"""Step responses are judged as the textbook says."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from scara_control.pid import PidGains
from scara_simulation.joints.loop import LoopState
from twin_analysis.step.response import StepResponseError, measure, step_of

GAINS = PidGains(p=1.0)


def record(curve, start=0.2, target=0.7, seconds=2.0, before=0.3, dt=1e-3, effort=lambda t: 0.0):
    """Sample ``curve`` (0 before the step, 1 at the target) as a controller would tell it."""
    samples = []
    for t in map(float, np.arange(-before, seconds, dt)):
        set_point, share = (target, curve(t)) if t > 0.5 * dt else (start, 0.0)
        value = start + (target - start) * share
        state = LoopState("j", "position", set_point, value, 0.0, 0.0, effort(t), GAINS)
        samples.append((10.0 + t, state))
    return samples


def second_order(zeta, omega):
    """Return the closed form of a damped oscillator's step response."""
    damped = omega * math.sqrt(1.0 - zeta**2)
    return lambda t: (
        1.0
        - math.exp(-zeta * omega * t)
        * (math.cos(damped * t) + zeta / math.sqrt(1.0 - zeta**2) * math.sin(damped * t))
    )


@pytest.mark.parametrize(("start", "target"), [(0.2, 0.7), (0.7, 0.2), (-0.1, 0.0)])
@pytest.mark.parametrize("zeta", [0.3, 0.5, 0.8])
def test_overshoot_of_an_oscillator_is_the_closed_form(zeta, start, target):
    """exp(-pi zeta / sqrt(1 - zeta^2)), upwards and downwards."""
    step = step_of(record(second_order(zeta, 20.0), start, target), target, 0.1)
    closed_form = 100.0 * math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))
    assert measure(step, 1.0).overshoot_percent == pytest.approx(closed_form, rel=1e-3)


def test_first_order_lag_has_its_known_rise_and_settling_time():
    """Rise is ln 9 time constants, within 2 % after ln 50, no overshoot."""
    tau = 0.1
    response = measure(step_of(record(lambda t: 1.0 - math.exp(-t / tau)), 0.7, 0.1), 1.0)
    assert response.rise_time == pytest.approx(tau * math.log(9.0), abs=1e-3)
    assert response.settling_time == pytest.approx(tau * math.log(50.0), abs=1.5e-3)
    assert response.overshoot_percent == 0.0


def test_steady_state_error_is_the_largest_of_the_last_part():
    """With its sign: set point minus measured."""
    response = measure(step_of(record(lambda t: 0.99), 0.7, 0.1), 1.0)
    assert response.steady_state_error == pytest.approx(0.5 * 0.01)
    assert response.settling_time == pytest.approx(1e-3, abs=1e-6)
    over = measure(step_of(record(lambda t: 1.01), 0.7, 0.1), 1.0)
    assert over.steady_state_error == pytest.approx(-0.5 * 0.01)


def test_joint_that_never_arrives_has_no_rise_and_no_settling_time():
    """None, not a number that looks like one."""
    response = measure(step_of(record(lambda t: 0.8), 0.7, 0.1), 1.0)
    assert (response.rise_time, response.settling_time) == (None, None)


@pytest.mark.parametrize(("peak", "saturated"), [(9.9, False), (10.0, True)])
def test_effort_at_its_limit_is_saturation(peak, saturated):
    """In either direction."""
    response = measure(
        step_of(record(lambda t: 1.0, effort=lambda t: -peak if 0.1 < t < 0.2 else 1.0), 0.7, 0.1),
        10.0,
    )
    assert (response.peak_effort, response.saturated) == (peak, saturated)


def test_record_keeps_what_was_asked_for_before_the_command():
    """Time 0 is the last state under the old set point."""
    step = step_of(record(lambda t: 1.0), 0.7, 0.1)
    assert step.times[0] == pytest.approx(-0.1, abs=1.1e-3)
    assert step.set_points[step.times <= 1e-9] == pytest.approx(0.2)
    assert step.set_points[step.times > 1e-9] == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("samples", "target", "text"),
    [
        (record(lambda t: 1.0), 0.9, "the set point 0.9 is not in the record of 2300 states"),
        (record(lambda t: 1.0)[400:], 0.7, "nothing was recorded before the step"),
    ],
)
def test_record_without_a_step_is_refused(samples, target, text):
    """The reason says what is missing."""
    with pytest.raises(StepResponseError, match=text):
        step_of(samples, target, 0.1)


def test_step_without_height_is_refused():
    """Shares of nothing are no numbers."""
    flat = msgspec.structs.replace(step_of(record(lambda t: 1.0), 0.7, 0.1), start=0.7)
    with pytest.raises(StepResponseError, match="the step has no height"):
        measure(flat, 1.0)
