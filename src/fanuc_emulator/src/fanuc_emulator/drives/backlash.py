"""Play between a motor and what it moves: a worn gear, screw or belt."""

from __future__ import annotations

import math

MOTOR_SHARE = 0.4
"""Part of inertia and friction that is the motor's own [asm]."""
KNOCK_S = 0.004
"""The flanks take so long to bring the load to the motor's speed [asm]."""


class Backlash:
    """The load of one axis, between the flanks of the motor's play.

    The motor pushes the load by one flank, until the load needs a force of the other sign; then it
    coasts, braked by its own friction, until it meets the other flank. The drive is stiff: the
    motor's motion is the same, only its torque is less meanwhile, and more when the flanks meet.

    Args:
        play: From flank to flank [u]; u is rad or m.
        drag: What friction brakes the load by [u/s^2].
        position: Of the motor [u].
    """

    def __init__(self, play: float, drag: float, position: float) -> None:
        self._half, self._drag = 0.5 * play, drag
        self._load, self._speed = position, 0.0
        # The flank at which the load is: 1 ahead of it, -1 behind it, 0: it coasts.
        self._side = 0
        self._knock = 0.0

    @property
    def load(self) -> float:
        """Where the load is [u]."""
        return self._load

    def step(self, position: float, velocity: float, acceleration: float, h: float) -> None:
        """Go on for ``h`` [s] with the motor at ``position`` [u], at ``velocity`` [u/s]."""
        self._knock *= max(0.0, 1.0 - h / KNOCK_S)
        if self._side:
            needed = acceleration + (math.copysign(self._drag, velocity) if velocity else 0.0)
            # A flank can push the load but not pull it.
            if needed * self._side < 0.0:
                self._side = 0
            else:
                self._load, self._speed = position - self._side * self._half, velocity
                return
        slower = max(0.0, abs(self._speed) - self._drag * h)
        self._speed = math.copysign(slower, self._speed)
        self._load += self._speed * h
        ahead = position - self._load
        if abs(ahead) >= self._half:
            self._side = 1 if ahead > 0.0 else -1
            # The blow brings the load to the motor's speed, so it grows with the difference of the
            # two.
            self._knock = (1.0 - MOTOR_SHARE) * (velocity - self._speed) / KNOCK_S
            self._load, self._speed = position - self._side * self._half, velocity

    def pushes(self, whole: float) -> float:
        """Return what the motor pushes by [u/s^2], where ``whole`` would move motor and load."""
        return (whole if self._side else MOTOR_SHARE * whole) + self._knock
