"""PID control of one joint, with the gains and the semantics of ROS' control_toolbox.

Plain floats on purpose: for four joints at 1 kHz plain Python is faster than arrays.
"""

from __future__ import annotations

from math import isfinite
from typing import Annotated

import msgspec
from msgspec import Meta

Gain = Annotated[float, Meta(ge=0.0, le=1e9)]


class PidGains(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Gains of one loop; the names are control_toolbox's.

    ``i_clamp`` bounds the integral term symmetrically. ``i_clamp_min`` and ``i_clamp_max`` (both or
    none) replace it. With ``antiwindup`` the integrated error itself is bounded, so that the term
    leaves its bound as soon as the error changes sign; without it only the term is bounded and the
    integrated error goes on growing.
    """

    p: Gain = 0.0
    i: Gain = 0.0
    d: Gain = 0.0
    i_clamp: Gain = 0.0
    antiwindup: bool = True
    i_clamp_min: Annotated[float, Meta(ge=-1e9, le=0.0)] | None = None
    i_clamp_max: Gain | None = None

    def __post_init__(self) -> None:
        """Refuse one bound without the other.

        Raises:
            ValueError: Only one of ``i_clamp_min`` and ``i_clamp_max`` is given.
        """
        if (self.i_clamp_min is None) != (self.i_clamp_max is None):
            raise ValueError("i_clamp_min and i_clamp_max are given together or not at all")

    @property
    def lower(self) -> float:
        """Smallest integral term [N m] or [N]."""
        return -self.i_clamp if self.i_clamp_min is None else self.i_clamp_min

    @property
    def upper(self) -> float:
        """Largest integral term [N m] or [N]."""
        return self.i_clamp if self.i_clamp_max is None else self.i_clamp_max


def compute_command(
    gains: PidGains, integral: float, error: float, error_dot: float, dt: float
) -> tuple[float, float]:
    r"""Compute the effort of one step.

    .. math:: u = p\,e + i \int e\,dt + d\,\dot e, \qquad e = setpoint - measured

    Args:
        gains: Gains of the loop.
        integral: Integrated error before the step [rad s] or [m s] (position loop).
        error: Set point minus measured value.
        error_dot: Its time derivative.
        dt: Time since the last step [s].

    Returns:
        The effort [N m] or [N] and the integrated error after the step. Without a step (``dt`` <=
        0) or with an error that is not finite the effort is 0 and the integrated error stays.

    Source:
        ROS control_toolbox, control_toolbox::Pid::computeCommand (semantics).
    """
    if not (
        dt > 0.0 and isfinite(error + error_dot)
    ):  # 8000 times a second: each call that is saved counts
        return 0.0, integral
    upper, lower, i = gains.i_clamp_max, gains.i_clamp_min, gains.i
    if upper is None or lower is None:
        upper = gains.i_clamp
        lower = -upper
    integral += error * dt
    i_term = i * integral
    if i_term > upper:
        i_term = upper
    elif i_term < lower:
        i_term = lower
    else:
        return gains.p * error + i_term + gains.d * error_dot, integral
    if gains.antiwindup:
        # i is not 0 here: the term would be 0, and no bound cuts that.
        integral = i_term / i
    return gains.p * error + i_term + gains.d * error_dot, integral


def integral_for_effort(gains: PidGains, effort: float) -> float:
    """Return the integrated error that makes the integral term ``effort``.

    It goes as far as the clamp allows.

    Used to switch from one loop to another without a jump of the effort.
    """
    if gains.i <= 0.0:
        return 0.0
    return min(max(effort, gains.lower), gains.upper) / gains.i


def saturate(effort: float, limit: float) -> tuple[float, bool]:
    """Limit an effort to ``[-limit, limit]``.

    Returns:
        What is let through, and whether that is less than asked for.
    """
    if effort > limit:
        return limit, True
    if effort < -limit:
        return -limit, True
    return effort, False
