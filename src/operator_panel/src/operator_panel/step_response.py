r"""What a joint would do with other gains: a mass on a motor under PID control, for a preview only.

.. math:: J \ddot q = p e + I - d \dot q, \quad \dot I = i e, \quad |I| \le c, \quad e = q_{set} - q

Gravity, friction and the feed-forward of the simulator are left out; the joint starts at rest and
the set point jumps.
Source: control_toolbox's gain names; semi-implicit Euler integration at the simulator's 1 kHz.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

STEP_S = 1e-3
SHOWN_EVERY = 5


class Response(NamedTuple):
    """A step response.

    Attributes:
        times: [s]
        values: Position over the step's height, 1 is the set point.
        overshoot_percent: Of the step.
        settling_s: From when on it stays within 2 %; inf if it does not.
    """

    times: tuple[float, ...]
    values: tuple[float, ...]
    overshoot_percent: float
    settling_s: float


def step_response(
    gains: Mapping[str, float], inertia: float, effort: float, step: float, duration: float
) -> Response:
    """Simulate a jump of the set point.

    Args:
        gains: p, i, d and i_clamp.
        inertia: J [kg m^2] or [kg].
        effort: Largest motor effort [N m] or [N].
        step: Height [rad] or [m].
        duration: How long to look [s].

    Raises:
        ValueError: A gain is missing or not finite.
    """
    for name in ("p", "i", "d", "i_clamp"):
        if not math.isfinite(gains.get(name, math.nan)):
            raise ValueError(f"gain {name} is missing or not finite")
    p, i, d, clamp = (float(gains[name]) for name in ("p", "i", "d", "i_clamp"))
    q = qdot = integral = 0.0
    times, values, settled = [0.0], [0.0], 0.0
    for k in range(1, round(duration / STEP_S) + 1):
        error = step - q
        # The integral itself is held, and not its effect alone, as in the simulator's loops.
        integral = min(max(integral + i * error * STEP_S, -clamp), clamp)
        wanted = p * error + integral - d * qdot
        qdot += min(max(wanted, -effort), effort) / inertia * STEP_S
        q += qdot * STEP_S
        # Gains by which it runs away end it here, before a number overflows.
        if not math.isfinite(q) or abs(q) > 1e3 * step:
            break
        settled = k * STEP_S if abs(q - step) > 0.02 * step else settled
        if k % SHOWN_EVERY == 0:
            times.append(round(k * STEP_S, 4))
            values.append(q / step)
    ran_away = len(values) <= duration / STEP_S / SHOWN_EVERY
    unsettled = ran_away or settled > duration - 2 * STEP_S
    return Response(
        tuple(times),
        tuple(values),
        100.0 * max(0.0, max(values) - 1.0),
        math.inf if unsettled else settled,
    )


def describe(response: Response) -> str:
    """Return overshoot and settling time in words."""
    if not math.isfinite(response.settling_s):
        return "does not settle: these gains are unstable or too weak"
    settling_ms = response.settling_s * 1e3
    return f"overshoot {response.overshoot_percent:.1f} %, within 2 % after {settling_ms:.0f} ms"
