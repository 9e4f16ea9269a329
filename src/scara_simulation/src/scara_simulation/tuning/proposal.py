r"""Gains to begin with, from the inertia that each joint sees over the workspace.

.. math::
    p &= J w^2, \quad d = 2 J w, \quad i = p w / 6 && \text{(position)} \\
    p &= J w, \quad i = J w^2 / 80 && \text{(velocity)}

with the largest inertia :math:`J` (the others held): critically damped there. The smallest one (the
others free) bounds the damping at the physics step, so :math:`w` is at most ``BANDWIDTH`` and at
most :math:`1.5 / (2 h \cdot 1.9\, J / J_{min})`: all gains times 1.9 are stable then.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scara_control.pid import PidGains

from scara_simulation.config import LoopGains

BANDWIDTH = 60.0
"""[rad/s] Our choice: ten physics steps of 1 ms fit into the loop's time constant."""
MARGIN = 1.9
CLAMP = 1.5
"""i_clamp in parts of the dry friction: enough to end the stick, too little to overshoot. Our
choice."""


def propose(
    mass_matrices: NDArray[np.float64], friction: list[float], dt: float
) -> list[tuple[float, LoopGains]]:
    """Return the bandwidth [rad/s] and the gains of both loops for each joint.

    Args:
        mass_matrices: Inertia over the workspace, shape (m, n, n).
        friction: Dry friction of each joint, shape (n,): [N m], prismatic [N].
        dt: Physics step [s].
    """
    held = np.diagonal(mass_matrices, axis1=1, axis2=2).max(axis=0)
    free = 1.0 / np.diagonal(np.linalg.inv(mass_matrices), axis1=1, axis2=2).max(axis=0)
    return [
        _for_joint(rounded(j), float(low), f, dt)
        for j, low, f in zip(held.tolist(), free.tolist(), friction, strict=True)
    ]


def rounded(value: float, digits: int = 4) -> float:
    """Return ``value`` with so many digits."""
    return float(f"{value:.{digits}g}")


def _for_joint(
    inertia: float, smallest: float, friction: float, dt: float
) -> tuple[float, LoopGains]:
    w = min(BANDWIDTH, float(math.floor(1.5 / (2.0 * dt * MARGIN * inertia / smallest))))
    clamp = rounded(CLAMP * friction, 3)
    p, d, i = inertia * w * w, 2.0 * inertia * w, inertia * w**3 / 6.0
    position = PidGains(p=rounded(p), i=rounded(i), d=rounded(d), i_clamp=clamp, antiwindup=True)
    velocity = PidGains(
        p=rounded(inertia * w),
        i=rounded(inertia * w * w / 80.0),
        d=0.0,
        i_clamp=clamp,
        antiwindup=True,
    )
    return w, LoopGains(position, velocity)
