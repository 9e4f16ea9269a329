r"""The time base of a path.

A cap of the program speed stretches it and PAUSE freezes it; the path stays the same.

With path time :math:`\tau`, scale :math:`s = \dot\tau` and a path :math:`P`:
:math:`q = P(\tau)`, :math:`\dot q = P' s`, :math:`\ddot q = P'' s^2 + P' \dot s`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scara_config import Joint

from scara_control.joint_motion import JointMotion
from scara_control.motion.plan import Path

_THERE = 0.13
"""Nearer than this share of the step that the jerk makes in one period, the scale is what is
wanted. Above 1/8: up to there, at :math:`e = r^2 / 2 j`, the rate could change its sign with each
step for ever, and a pause would creep on."""

SAME_TIME = 1e-6
"""Times of the grid that are no further apart are the same, in seconds and in periods."""


@dataclass(frozen=True, slots=True)
class TimeBase:
    """Where on a path and how fast through it.

    Attributes:
        tau: Path time [s].
        scale: d tau / dt, 0 (frozen) to 1 (as planned).
        rate: d scale / dt [1/s].
    """

    tau: float = 0.0
    scale: float = 1.0
    rate: float = 0.0


@dataclass(frozen=True, slots=True)
class ScaleBounds:
    """How fast the scale may change: ``ramp`` [1/s] and ``jerk`` [1/s^2]."""

    ramp: float
    jerk: float


class SpeedCap:
    """The caps that were given, and from when on each holds.

    A robot that follows was sent where the path leads up to its delay from now. A cap that changed
    the path before that would find the robot ahead of it.
    """

    def __init__(self, percent: float = 100.0) -> None:
        """Begin with a cap [percent] that holds at any time."""
        self._rows = [(-math.inf, percent)]

    @property
    def newest(self) -> float:
        """The cap that was given last [percent]."""
        return self._rows[-1][1]

    def set(self, percent: float, due: float) -> None:
        """Let a cap [percent] hold from ``due`` [s] on, whatever was to come after that."""
        self._rows = [*(row for row in self._rows if row[0] < due), (due, percent)]

    def at(self, time: float) -> float:
        """Return the cap that holds at ``time`` [s], in percent."""
        return next(percent for due, percent in reversed(self._rows) if due <= time + SAME_TIME)

    def forget(self, before: float) -> None:
        """Forget what does not hold any more at ``before`` [s]."""
        while len(self._rows) > 1 and self._rows[1][0] <= before:
            del self._rows[0]


def motion_at(path: Path, base: TimeBase) -> JointMotion:
    """Return the joints' motion in real time."""
    planned = path.at(base.tau)
    if base.scale == 1.0 and base.rate == 0.0:
        return planned
    return JointMotion(
        planned.q,
        tuple(v * base.scale for v in planned.qdot),
        tuple(a * base.scale**2 + v * base.rate for v, a in zip(planned.qdot, planned.qddot)),
    )


def advance(
    path: Path,
    base: TimeBase,
    wanted: float,
    bounds: ScaleBounds,
    joints: Sequence[Joint],
    dt: float,
) -> TimeBase:
    """Go on by ``dt`` while the scale approaches ``wanted``.

    The scale changes within ``bounds``, and no faster than the joints' accelerations leave room
    for.

    Args:
        path: The path.
        base: Where we are.
        wanted: Scale to approach, 0 to 1.
        bounds: Of the scale's change.
        joints: Limits of acceleration.
        dt: [s]
    """
    if base.scale == wanted and base.rate == 0.0:
        return TimeBase(base.tau + wanted * dt, wanted)
    rate = _approach(base, wanted, bounds, dt)
    scale = base.scale + 0.5 * (base.rate + rate) * dt
    # At the end of the step, where the new rate holds.
    here = path.at(base.tau + base.scale * dt)
    low, high = _room(here, max(scale, 0.0), joints, path.share)
    rate = min(max(rate, low), high)
    scale = base.scale + 0.5 * (base.rate + rate) * dt
    if abs(wanted - scale) <= _THERE * bounds.jerk * dt * dt and abs(rate) <= bounds.jerk * dt:
        scale, rate = wanted, 0.0
    elif not 0.0 < scale < 1.0:
        scale, rate = min(max(scale, 0.0), 1.0), 0.0
    # The integral of the cubic that has both scales and both rates at the step's ends.
    tau = base.tau + 0.5 * (base.scale + scale) * dt + (base.rate - rate) * dt * dt / 12.0
    return TimeBase(max(tau, base.tau), scale, rate)


def _approach(base: TimeBase, wanted: float, bounds: ScaleBounds, dt: float) -> float:
    r"""Return the rate after ``dt`` that reaches ``wanted`` soonest without running past it.

    What is missing covers this step and the braking after it: :math:`e = (r_0 + r) dt / 2 + r^2 / 2
    j`.
    """
    missing = wanted - base.scale
    sign, jerk, half = math.copysign(1.0, missing), bounds.jerk, 0.5 * bounds.jerk * dt
    room = half * half + 2.0 * jerk * abs(missing) - jerk * dt * base.rate * sign
    rate = sign * min(bounds.ramp, math.sqrt(max(room, 0.0)) - half)
    return min(max(rate, base.rate - jerk * dt), base.rate + jerk * dt)


def _room(
    planned: JointMotion, scale: float, joints: Sequence[Joint], share: float
) -> tuple[float, float]:
    """Return the rates between which every joint keeps the share of its acceleration that it got.

    0 is always allowed.
    """
    low, high = -math.inf, math.inf
    for v, a, joint in zip(planned.qdot, planned.qddot, joints):
        if abs(v) < 1e-12:
            continue
        most = joint.acceleration * share
        first = (-most - a * scale * scale) / v
        second = (most - a * scale * scale) / v
        low, high = max(low, min(first, second)), min(high, max(first, second))
    return min(low, 0.0), max(high, 0.0)
