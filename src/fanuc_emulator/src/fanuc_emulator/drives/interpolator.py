"""Plan a joint move along its path.

All axes start and end together, the speed may change while it runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence


def stopping_speed(distance: float, deceleration: float, dt: float) -> float:
    r"""Compute the largest speed from which a stop within ``distance`` is possible.

    In steps of ``dt`` a ramp of ``n`` steps from ``v`` covers :math:`n v\,dt - a\,dt^2 n(n-1)/2`;
    ``n`` is the least that reaches ``d``, and the speed is the one that ends exactly there. Braking
    from it by ``a dt`` a step is therefore always possible.

    Args:
        distance: What is left, in any unit u; negative counts as zero.
        deceleration: Ramp [u/s^2].
        dt: Step [s].

    Returns:
        Speed [u/s], not negative.
    """
    if distance <= 0.0:
        return 0.0
    change = deceleration * dt
    steps = max(1, math.ceil(0.5 * (math.sqrt(1.0 + 8.0 * distance / (change * dt)) - 1.0)))
    return distance / (steps * dt) + 0.5 * change * (steps - 1)


class JointMove:
    """Follow the straight joint path by a trapezoid in the path parameter.

    The axis that needs longest moves at ``speed`` of its greatest speed times the override; the
    others keep pace. The path depends on nothing else, so hold, resume and override change the time
    on it but never its shape.

    Args:
        start: Joint positions at the start [rad or m], shape ``(n,)``.
        target: Joint positions at the end, shape ``(n,)``.
        speed: Programmed speed as a fraction of the greatest one, 0..1.
        velocities: Greatest joint speeds [rad/s or m/s], shape ``(n,)``.
        accelerations: Joint accelerations of planned moves, shape ``(n,)``.

    Source:
        Motion instruction ``J P[n] v%`` of the real controller; the trapezoid is our choice.
    """

    def __init__(
        self,
        start: Sequence[float],
        target: Sequence[float],
        speed: float,
        velocities: Sequence[float],
        accelerations: Sequence[float],
    ) -> None:
        self._start = tuple(start)
        self._target = tuple(target)
        distances = [abs(end - begin) for begin, end in zip(start, target)]
        moving = [i for i, distance in enumerate(distances) if distance > 0.0]
        self.progress = 1.0 if not moving else 0.0
        self.rate = 0.0
        self._rate_limit = min((speed * velocities[i] / distances[i] for i in moving), default=0.0)
        self._rate_change = min((accelerations[i] / distances[i] for i in moving), default=0.0)

    @property
    def done(self) -> bool:
        """The end of the path is reached."""
        return self.progress >= 1.0

    def advance(self, override: float, dt: float) -> tuple[float, ...]:
        """Go on for ``dt`` and return the joint positions.

        Args:
            override: Fraction 0..1 of the programmed speed; 0 decelerates along the path and holds
                there.
            dt: Step [s].
        """
        if not self.done:
            change = self._rate_change * dt
            wanted = min(
                self._rate_limit * override,
                stopping_speed(1.0 - self.progress, self._rate_change, dt),
            )
            self.rate = min(max(wanted, self.rate - change), self.rate + change)
            self.progress = min(self.progress + self.rate * dt, 1.0)
            if 1.0 - self.progress < 1e-12:
                self.progress, self.rate = 1.0, 0.0
        return self.positions()

    def positions(self) -> tuple[float, ...]:
        """Return the joint positions on the path now; the exact target at its end."""
        if self.done:
            return self._target
        s = self.progress
        return tuple([begin + s * (end - begin) for begin, end in zip(self._start, self._target)])
