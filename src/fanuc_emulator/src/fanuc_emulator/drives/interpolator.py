"""Plan a joint move along its path.

All axes start and end together, the speed may change while it runs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


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


def rate_for(seconds: float, change: float) -> float:
    """Return the rate at which a trapezoid from 0 to 1 takes so long, or the greatest that it has.

    Args:
        seconds: From the beginning to the end [s].
        change: Acceleration and deceleration of the rate [1/s^2].
    """
    # Ramps alone take 2 / sqrt(change): the shortest time.
    twice = max(change * seconds, 2.0 * math.sqrt(change))
    return 0.5 * (twice - math.sqrt(max(twice**2 - 4.0 * change, 0.0)))


class Trapezoid:
    """Go along a path by a trapezoid in its parameter, 0..1.

    The path depends on nothing else, so hold, resume and override change the time on it but never
    its shape.

    Args:
        end: Joint positions at the end [rad or m], shape ``(n,)``.
        rate: Programmed speed of the parameter [1/s].
        change: Its acceleration and deceleration [1/s^2].
        moves: The path leads somewhere.

    Attributes:
        end: As given.
        progress: The parameter now.
        rate: Its speed now [1/s].
    """

    def __init__(self, end: tuple[float, ...], rate: float, change: float, moves: bool) -> None:
        self.end = end
        self.progress = 0.0 if moves else 1.0
        self.rate = 0.0
        self._rate_limit, self._rate_change = rate, change
        # The rate from which it decelerates.
        self._peak = 0.0

    @property
    def law(self) -> tuple[float, float]:
        """Greatest rate of the parameter [1/s] at an override of 1, and how it changes [1/s^2]."""
        return self._rate_limit, self._rate_change

    @property
    def done(self) -> bool:
        """The end of the path is reached."""
        return self.progress >= 1.0

    def slow_down(self, share: float) -> None:
        """Keep to so much of the programmed speed, 0..1."""
        self._rate_limit *= share

    def advance(self, override: float, dt: float) -> tuple[float, ...]:
        """Go on for ``dt`` and return the joint positions.

        Args:
            override: Fraction 0..1 of the programmed speed; 0 decelerates along the path and holds
                there.
            dt: Step [s].
        """
        if not self.done:
            change, before = self._rate_change * dt, self.rate
            wanted = min(
                self._rate_limit * override,
                stopping_speed(1.0 - self.progress, self._rate_change, dt),
            )
            self.rate = min(max(wanted, self.rate - change), self.rate + change)
            if self.rate >= before:
                self._peak = self.rate
            self.progress = min(self.progress + self.rate * dt, 1.0)
            # The last step of the ramp ends at 1 but for rounding, and such a rest would delay the
            # end.
            if 1.0 - self.progress < 1e-12:
                self.progress, self.rate = 1.0, 0.0
        return self.positions()

    def nears_end(self, share: float) -> bool:
        """Tell whether so much of the time of deceleration is left, 0..1, or less."""
        if self.done:
            return True
        return 1.0 - self.progress <= 0.5 * (share * self._peak) ** 2 / self._rate_change

    def positions(self) -> tuple[float, ...]:
        """Return the joint positions on the path now; the exact target at its end."""
        raise NotImplementedError

    def places(self, progress: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the joint positions at values of the parameter, shape (m, n) [rad or m]."""
        raise NotImplementedError


class JointMove(Trapezoid):
    """Follow the straight joint path.

    The axis that needs longest moves at ``speed`` of its greatest speed times the override; the
    others keep pace.

    Args:
        start: Joint positions at the start [rad or m], shape ``(n,)``.
        target: Joint positions at the end, shape ``(n,)``.
        speed: Programmed speed as a fraction of the greatest one, 0..1.
        velocities: Greatest joint speeds [rad/s or m/s], shape ``(n,)``.
        accelerations: Joint accelerations of planned moves, shape ``(n,)``.
        seconds: It takes so long at an override of 1, if it can; None: by its speed.

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
        seconds: float | None = None,
    ) -> None:
        self._start = tuple(start)
        distances = [abs(end - begin) for begin, end in zip(start, target)]
        moving = [i for i, distance in enumerate(distances) if distance > 0.0]
        rate = min((speed * velocities[i] / distances[i] for i in moving), default=0.0)
        change = min((accelerations[i] / distances[i] for i in moving), default=0.0)
        if seconds is not None and moving:
            rate = min(rate, rate_for(seconds, change))
        super().__init__(tuple(target), rate, change, bool(moving))

    def positions(self) -> tuple[float, ...]:
        """Return the joint positions on the path now; the exact target at its end."""
        if self.done:
            return self.end
        s = self.progress
        return tuple([begin + s * (end - begin) for begin, end in zip(self._start, self.end)])

    def places(self, progress: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the joint positions at values of the parameter, shape (m, n) [rad or m]."""
        begin = np.array(self._start)
        found: NDArray[np.float64] = begin + progress[:, None] * (np.array(self.end) - begin)
        return found
