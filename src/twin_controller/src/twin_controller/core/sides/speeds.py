r"""The speeds of a side that tells positions alone: differences of them, over its own clock.

A parabola goes through the newest readings by least squares; its slope at the newest of them is
the speed. With the readings' instants :math:`s_i` counted from the newest one it is a weighted sum
of the positions, so noise of standard deviation :math:`\sigma` becomes

.. math:: v = \sum_i w_i q_i, \qquad \sigma_v = \sigma \sqrt{\sum_i w_i^2}.

Few readings follow a motion closely, many average its noise away: as many are taken as bring
:math:`\sigma_v` below what a speed may be wrong by (Savitzky and Golay 1964, at the end of the
stretch).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scara_control.joint_motion import JointMotion

from twin_controller.core.events import Joints

FEWEST, MOST = 4, 16
"""So many readings are taken; our choice: four of 8 ms span the filters of a drive by half."""
LONGEST_S = 0.15
"""Readings older than this say nothing of the speed now [s]; our choice."""
WRONG_PERCENT = 0.25
"""Of its greatest speed a joint's may be wrong by so much, one standard deviation; our choice:
over a delay of 30 ms the tool of a SCARA strays by 0.4 mm for it."""

WRONG_BY_AGE = 0.15
"""A speed may be wrong by this part of itself while nobody knows how old the readings are; our
choice: over a delay of 15 ms the joint strays by that as much as by the age itself."""


def speeds(
    history: Sequence[JointMotion],
    newest: JointMotion,
    noise: Joints,
    velocity: Joints,
    age_doubt: float = 0.0,
) -> Joints:
    """Return the speed of each joint at the newest reading, SI.

    Args:
        history: The readings before it, oldest first.
        newest: The newest one.
        noise: Standard deviation of each joint's readings, SI.
        velocity: Largest speed of each joint, SI.
        age_doubt: Standard deviation of a reading from its stamp [s].
    """
    recent = [each for each in history[1 - MOST :] if newest.time - each.time <= LONGEST_S]
    rows = [*recent, newest]
    if len(rows) < 2:
        return (0.0,) * len(newest.q)
    q = np.array([row.q for row in rows])
    s = np.array([row.time - newest.time for row in rows])
    worst = max(one / (1e-2 * WRONG_PERCENT * most) for one, most in zip(noise, velocity))
    worst = max(worst, age_doubt / WRONG_BY_AGE)
    weights = slope_weights(s[-FEWEST:])
    for count in range(FEWEST + 1, len(rows) + 1):
        if worst * float(np.linalg.norm(weights)) <= 1.0:
            break
        weights = slope_weights(s[-count:])
    return tuple([float(v) for v in weights @ q[-len(weights) :]])


def slope_weights(s: np.ndarray) -> np.ndarray:
    """Return by what positions at ``s`` [s], shape (n,), count for the slope at 0, shape (n,).

    Of a parabola by least squares; two points make a line.
    """
    powers = np.vander(s, min(3, len(s)), increasing=True)
    weights: np.ndarray = np.linalg.pinv(powers)[1]
    return weights
