r"""How late a joint did what it was told, and how it rounded it off.

For motion that is slow against its filters and drives:

.. math:: q(t) = u(t - \tau) + s\,\ddot u(t - \tau)

where :math:`\tau` is the mean and :math:`s` half the variance of the filters' weights. Both follow
by least squares, around the best of all delays: one that has jumped is found as well as one that
creeps.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GRID_S = 0.005
"""Between two delays that are tried [s]."""
STEP_S = 0.02
"""Velocities and accelerations of what was told are differences over this time [s]."""
ROUNDS = 3
"""From the best delay that was tried to the best one."""
CORRELATED = 8.0
"""So many readings in a row are wrong in the same way: they count as one. Our choice."""
SMOOTHING_SD, SMOOTHING_SHARE = 150e-6, 0.03
"""By so much a smoothing may differ from what it was [s^2], or by this part of the delay's square:
a window often says little of it. Two equal filters have a twelfth of the square."""
BESIDE = 0.01
"""A robot at rest may stand so far from what it was told, border units: half
of what counts as standing."""


class Fit(NamedTuple):
    """Delay [s], smoothing [s^2], and the standard deviation of the delay [s]."""

    delay: float
    smoothing: float
    doubt: float


def fit_joint(
    told_at: Array, told: Array, seen_at: Array, seen: Array, smoothing: float, longest: float
) -> Fit | None:
    """Fit the delay and the smoothing of one joint.

    Args:
        told_at: When it was told a position [s], increasing, shape ``(m,)``.
        told: Positions, border units, shape ``(m,)``; before the first it stood there.
        seen_at: When it was seen [s], shape ``(n,)``.
        seen: Where, border units, shape ``(n,)``.
        smoothing: What the smoothing was before [s^2].
        longest: The longest delay that is looked for [s].

    Returns:
        None if no delay fits.
    """
    delays = np.arange(0.0, longest, GRID_S)
    late = np.interp(seen_at[:, None] - delays[None, :], told_at, told)
    delay = float(delays[np.argmin(((late - seen[:, None]) ** 2).sum(axis=0))])
    found = np.array([0.0, smoothing])
    deviation = np.inf
    for _ in range(ROUNDS):
        at = seen_at - delay
        after, here, before = (
            np.interp(at + step, told_at, told) for step in (STEP_S, 0.0, -STEP_S)
        )
        rows = np.stack(
            [(before - after) / (2.0 * STEP_S), (after - 2.0 * here + before) / STEP_S**2], axis=1
        )
        rest = seen - here
        variance = CORRELATED * max(float(np.mean((rest - rows[:, 1] * found[1]) ** 2)), 1e-10)
        # What the window does not tell of the smoothing is what it was before.
        spread = max(SMOOTHING_SD, SMOOTHING_SHARE * delay**2)
        weight = np.diag([0.0, variance / spread**2])
        normal = rows.T @ rows + weight
        if normal[0, 0] <= 0.0:
            return None
        found = np.linalg.solve(normal, rows.T @ rest + weight @ [0.0, smoothing])
        delay += float(found[0])
        variance = CORRELATED * max(float(np.mean((rest - rows @ found) ** 2)), 1e-10)
        deviation = float(np.sqrt(variance * np.linalg.inv(normal)[0, 0]))
    # A robot that stands stands a little beside what it was told: slow motion tells no delay.
    rate = float(np.sqrt(np.mean(rows[:, 0] ** 2)))
    deviation = math.hypot(deviation, BESIDE / max(rate, 1e-9))
    if not 0.0 <= delay <= longest:
        return None
    return Fit(delay, float(found[1]), deviation)
