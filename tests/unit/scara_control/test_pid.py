"""PID: control_toolbox's arithmetic, clamps and anti-windup."""

from __future__ import annotations

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scara_control.pid import PidGains, compute_command, integral_for_effort, saturate

FINITE = st.floats(-1e3, 1e3)


@pytest.mark.parametrize(
    ("gains", "integral", "error", "error_dot", "dt", "effort", "integral_after"),
    [
        (PidGains(p=2.0), 0.0, 1.5, 9.0, 0.1, 3.0, 0.15),
        (PidGains(d=0.5), 0.0, 9.0, -4.0, 0.1, -2.0, 0.9),
        (PidGains(i=4.0, i_clamp=10.0), 1.0, 5.0, 0.0, 0.1, 6.0, 1.5),
        (PidGains(p=1.0, i=4.0, d=2.0, i_clamp=10.0), 1.0, 5.0, 3.0, 0.1, 17.0, 1.5),
        (PidGains(i=4.0, i_clamp=2.0, antiwindup=True), 0.0, 10.0, 0.0, 1.0, 2.0, 0.5),
        (PidGains(i=4.0, i_clamp=2.0, antiwindup=False), 0.0, 10.0, 0.0, 1.0, 2.0, 10.0),
        (PidGains(i=4.0, i_clamp_min=-3.0, i_clamp_max=1.0), 0.0, 10.0, 0.0, 1.0, 1.0, 0.25),
        (PidGains(i=4.0, i_clamp_min=-3.0, i_clamp_max=1.0), 0.0, -10.0, 0.0, 1.0, -3.0, -0.75),
        (PidGains(p=2.0, i=4.0), 0.0, 1.0, 0.0, 0.0, 0.0, 0.0),
        (PidGains(p=2.0, i=4.0), 0.3, math.nan, 0.0, 0.1, 0.0, 0.3),
        (PidGains(p=2.0, i=4.0), 0.3, 1.0, math.inf, 0.1, 0.0, 0.3),
    ],
)
def test_one_step_gives_the_effort_worked_out_by_hand(
    gains, integral, error, error_dot, dt, effort, integral_after
):
    """U = p e + clamp(i * sum of e dt) + d de/dt; no step and no number give no effort."""
    assert compute_command(gains, integral, error, error_dot, dt) == pytest.approx(
        (effort, integral_after)
    )


def test_antiwindup_leaves_the_clamp_as_soon_as_the_error_changes_sign():
    """With anti-windup the integrated error is bounded, without it the term stays at its clamp."""
    efforts = {}
    for antiwindup in (True, False):
        gains = PidGains(i=1.0, i_clamp=1.0, antiwindup=antiwindup)
        integral = 0.0
        for error in [1.0] * 100 + [-1.0]:
            effort, integral = compute_command(gains, integral, error, 0.0, 0.1)
        efforts[antiwindup] = effort
    assert efforts[True] == pytest.approx(0.9)
    assert efforts[False] == 1.0


def test_loop_follows_the_closed_form_of_a_damped_oscillator():
    """With p = J w^2 and d = 2 zeta w J a step answer is the textbook one."""
    inertia, omega, zeta, dt = 2.0, 20.0, 0.7, 1e-5
    gains = PidGains(p=inertia * omega**2, d=2.0 * zeta * omega * inertia)
    q = qdot = integral = 0.0
    for _ in range(10_000):
        effort, integral = compute_command(gains, integral, 1.0 - q, -qdot, dt)
        qdot += effort / inertia * dt
        q += qdot * dt
    t, damped = 0.1, omega * math.sqrt(1.0 - zeta**2)
    closed_form = 1.0 - math.exp(-zeta * omega * t) * (
        math.cos(damped * t) + zeta / math.sqrt(1.0 - zeta**2) * math.sin(damped * t)
    )
    assert q == pytest.approx(closed_form, abs=1e-3)


@given(FINITE, FINITE, st.floats(1e-4, 1.0), st.booleans())
def test_integral_term_never_leaves_its_clamp(integral, error, dt, antiwindup):
    """The clamp holds for whatever went before."""
    effort, _ = compute_command(
        PidGains(i=3.0, i_clamp=0.7, antiwindup=antiwindup), integral, error, 0.0, dt
    )
    assert abs(effort) <= 0.7 * (1.0 + 1e-12)


@given(FINITE)
def test_switching_loops_keeps_the_integral_effort_as_far_as_the_clamp_allows(effort):
    """The integrated error taken over makes the same effort in the new loop."""
    gains = PidGains(i=5.0, i_clamp=30.0)
    after, _ = compute_command(gains, integral_for_effort(gains, effort), 0.0, 0.0, 1e-3)
    assert after == pytest.approx(min(max(effort, -30.0), 30.0))


def test_loop_without_integral_gain_takes_over_nothing():
    """Without an integral gain there is no integral effort to keep."""
    assert integral_for_effort(PidGains(p=1.0), 5.0) == 0.0


@pytest.mark.parametrize(
    ("effort", "through"),
    [(5.0, (5.0, False)), (10.0, (10.0, False)), (10.5, (10.0, True)), (-99.0, (-10.0, True))],
)
def test_saturation_is_reported(effort, through):
    """What is cut off is told, never silently lost."""
    assert saturate(effort, 10.0) == through


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"p": -1.0}, r">= 0\.0.*\$\.p"),
        ({"p": math.nan}, r"\$\.p"),
        ({"i_clamp": -1.0}, r"\$\.i_clamp"),
        ({"i_clamp_min": -1.0}, "given together"),
        ({"kp": 1.0}, "unknown field `kp`"),
    ],
)
def test_wrong_gains_are_refused(fields, why):
    """Negative gains, half a clamp and unknown names do not pass."""
    with pytest.raises(msgspec.ValidationError, match=why):
        msgspec.convert(fields, PidGains)
