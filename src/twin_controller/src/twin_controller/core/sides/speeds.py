r"""The speeds of a side that tells positions alone: differences of them, over its own clock.

A parabola or a cubic goes through the newest readings by least squares; its slope at the newest of
them is the speed. With the readings' instants :math:`s_i` counted from the newest one it is a
weighted sum of the positions, so noise of standard deviation :math:`\sigma` becomes

.. math:: v = \sum_i w_i q_i, \qquad \sigma_v = \sigma \sqrt{\sum_i w_i^2}.

Few readings follow a motion closely, many average its noise away. A jerk :math:`j` that began a
time :math:`a` ago makes the slope wrong by

.. math:: \frac{j}{6} \sum_i w_i \max(0, s_i + a)^3 - \frac{j}{2} a^2.

A cubic follows a jerk that lasts, and is noisier. That curve and as many readings are taken as make
noise and the worst :math:`a` together least (Savitzky and Golay 1964, at the end of the stretch).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scara_control.joint_motion import JointMotion

from twin_controller.core.events import Joints

FEWEST, MOST = 3, 16
"""So many readings are taken; our choice."""
PARABOLA, CUBIC = 2, 3
LONGEST_S = 0.15
"""Readings older than this say nothing of the speed now [s]; our choice."""
ROUNDED_S = 0.1
"""A drive takes about so long to its greatest acceleration [s]: that tells its jerk; our choice."""
STILL = 5.5
"""A joint stands whose readings lie no further apart than this times their standard deviation: of
16 of one joint that stands, 1 in 100 does. Our choice."""


def speeds(
    history: Sequence[JointMotion],
    newest: JointMotion,
    noise: Joints,
    velocity: Joints,
    acceleration: Joints,
    age_doubt: float = 0.0,
) -> Joints:
    """Return the speed of each joint at the newest reading, SI.

    A joint that stands while others move has none: its noise would make its follower tremble.

    Args:
        history: The readings before it, oldest first.
        newest: The newest one.
        noise: Standard deviation of each joint's readings, SI.
        velocity: Largest speed of each joint, SI.
        acceleration: Largest acceleration of each joint, SI.
        age_doubt: Standard deviation of a reading from its stamp [s].
    """
    recent = [each for each in history[1 - MOST :] if newest.time - each.time <= LONGEST_S]
    rows = [*recent, newest]
    if len(rows) < 2:
        return (0.0,) * len(newest.q)
    q = np.array([row.q for row in rows])
    s = np.array([row.time - newest.time for row in rows])
    # In parts of the greatest speed, of the joint that is worst: what a reading's age hides grows
    # with the speed, so a motion that only begins is seen by the few newest of them.
    share = float(np.max(np.abs(q[-1] - q[-FEWEST:][0]) / velocity)) / -float(s[-FEWEST:][0])
    noisy = max(one / most for one, most in zip(noise, velocity)) + min(share, 1.0) * age_doubt
    jerk = max(a / (ROUNDED_S * most) for a, most in zip(acceleration, velocity))
    weights, least = slope_weights(s[-FEWEST:], PARABOLA), np.inf
    # What is not known of the readings' age is no noise that a finer curve could average away.
    for degree in (PARABOLA,) if age_doubt else (PARABOLA, CUBIC):
        best = np.inf
        for count in range(degree + 1, len(rows) + 1):
            part = s[-count:]
            tried = slope_weights(part, degree)
            # A jerk that began at one of the readings, the worst of them.
            seen = np.maximum(0.0, part - part[:, np.newaxis]) ** 3 @ tried
            late = jerk / 6.0 * float(np.max(np.abs(seen - 3.0 * part**2)))
            wrong = math.hypot(noisy * np.linalg.norm(tried), late)
            if wrong >= best:
                break
            best = wrong
            if wrong < least:
                weights, least = tried, wrong
    moves = np.ptp(q, axis=0) > STILL * np.array(noise)
    # Where a motion turns a parabola goes too far: no drive is faster than it can be.
    return tuple(
        [
            min(max(float(v), -most), most)
            for v, most in zip(moves * (weights @ q[-len(weights) :]), velocity)
        ]
    )


def slope_weights(s: np.ndarray, degree: int) -> np.ndarray:
    """Return by what positions at ``s`` [s], shape (n,), count for the slope at 0, shape (n,).

    Of a curve of this degree by least squares, or of the highest that so few points allow.
    """
    powers = np.vander(s, min(degree + 1, len(s)), increasing=True)
    weights: np.ndarray = np.linalg.pinv(powers)[1]
    return weights
