r"""The time base of a path: stretched by a cap of the program speed, frozen by PAUSE, on the same path.

With path time :math:`\tau`, scale :math:`s = \dot\tau` and a path :math:`P`:
:math:`q = P(\tau)`, :math:`\dot q = P' s`, :math:`\ddot q = P'' s^2 + P' \dot s`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from scara_config import Joint

from scara_control.motion.plan import JointMotion, Path

_SAME_TIME = 1e-6


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


def advance(path: Path, base: TimeBase, wanted: float, bounds: ScaleBounds, joints: Sequence[Joint], dt: float) -> TimeBase:
    """Go on by ``dt`` while the scale approaches ``wanted``.

    The scale changes within ``bounds``, and no faster than the joints' accelerations leave room for.

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
    low, high = _room(path.at(base.tau + base.scale * dt), max(scale, 0.0), joints)
    rate = min(max(rate, low), high)
    scale = base.scale + 0.5 * (base.rate + rate) * dt
    if abs(wanted - scale) <= bounds.jerk * dt * dt and abs(rate) <= bounds.jerk * dt:
        scale, rate = wanted, 0.0
    elif not 0.0 < scale < 1.0:
        scale, rate = min(max(scale, 0.0), 1.0), 0.0
    tau = base.tau + 0.5 * (base.scale + scale) * dt + (base.rate - rate) * dt * dt / 12.0
    return TimeBase(max(tau, base.tau), scale, rate)


def _approach(base: TimeBase, wanted: float, bounds: ScaleBounds, dt: float) -> float:
    """Return the rate that reaches ``wanted`` soonest without running past it."""
    missing = wanted - base.scale
    half = 0.5 * bounds.jerk * dt
    fastest = min(bounds.ramp, math.sqrt(half * half + 2.0 * bounds.jerk * abs(missing)) - half)
    rate = math.copysign(fastest, missing)
    return min(max(rate, base.rate - bounds.jerk * dt), base.rate + bounds.jerk * dt)


def _room(planned: JointMotion, scale: float, joints: Sequence[Joint]) -> tuple[float, float]:
    """Return the rates between which every joint keeps its acceleration; 0 is always allowed."""
    low, high = -math.inf, math.inf
    for v, a, joint in zip(planned.qdot, planned.qddot, joints):
        if abs(v) < 1e-12:
            continue
        first = (-joint.acceleration - a * scale * scale) / v
        second = (joint.acceleration - a * scale * scale) / v
        low, high = max(low, min(first, second)), min(high, max(first, second))
    return min(low, 0.0), max(high, 0.0)


@dataclass(frozen=True, slots=True)
class Drive:
    """A path being driven, at one point of the time grid. Never changes: :meth:`step` returns the next.

    Attributes:
        path: Where it leads.
        time: When it is here [s].
        go_at: When the first motion is due [s]; until then it stands at the start.
        base: Path time, scale and rate at ``time``.
    """

    path: Path
    time: float
    go_at: float
    base: TimeBase

    @property
    def motion(self) -> JointMotion:
        """The joints' motion at ``time``."""
        return motion_at(self.path, self.base)

    @property
    def announcing(self) -> bool:
        """Whether it waits for ``go_at``."""
        return self.time < self.go_at - _SAME_TIME

    @property
    def done(self) -> bool:
        """Whether the end of the path is reached."""
        return not self.announcing and self.base.tau >= self.path.duration

    @property
    def frozen(self) -> bool:
        """Whether the scale is 0, so that nothing moves until it is raised."""
        return self.base.scale == 0.0 and self.base.rate == 0.0

    def step(self, dt: float, wanted: float, bounds: ScaleBounds, joints: Sequence[Joint]) -> Drive:
        """Return this drive ``dt`` later; see :func:`advance`."""
        time = self.time + dt
        if self.announcing:
            return replace(self, time=time, base=TimeBase(0.0, wanted))
        return replace(self, time=time, base=advance(self.path, self.base, wanted, bounds, joints, dt))
