"""The last hundredths of a millimetre of move_to, and the bookkeeping of its requests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scara_control.config import MotionConfig
from scara_control.scara import Scara, Triple, tool_position
from scara_control.scara_velocity import joint_velocities, tool_velocity


@dataclass(frozen=True, slots=True)
class TrimStep:
    """What to do now: joint velocities, shape (3,), and how far the tool is from the point [m]."""

    qdot: Triple
    error: float


def tool_error(scara: Scara, q: Sequence[float], point: Sequence[float]) -> float:
    """Return the distance of the tool from ``point`` [m]."""
    return math.dist(tool_position(scara, *q), point)


def trim_step(
    scara: Scara, q: Sequence[float], target: Sequence[float], point: Sequence[float], config: MotionConfig
) -> TrimStep:
    r"""Compute small joint velocities towards the point.

    .. math:: \dot q = J^{-1} k (p - p(q)), \quad \text{near the straight arm } \dot q = k (q_{target} - q)

    There the tool's error says little about the joints, so theirs is used instead.

    Args:
        scara: The arm.
        q: Measured joint positions, shape ``(3,)``.
        target: Joint positions of the point, shape ``(3,)``.
        point: Where the tool shall be [m].
        config: Gain, largest speed, tolerance.

    Returns:
        No velocity once within the tolerance; never faster than the trim's tool speed and the jog's joint speeds.
    """
    trim = config.trim
    error = tool_error(scara, q, point)
    if error <= trim.tolerance_mm * 1e-3:
        return TrimStep((0.0, 0.0, 0.0), error)
    wanted = joint_velocities(scara, q, [trim.gain * (p - here) for p, here in zip(point, tool_position(scara, *q))])
    qdot = wanted.qdot
    if wanted.damped:
        qdot = (trim.gain * (target[0] - q[0]), trim.gain * (target[1] - q[1]), trim.gain * (target[2] - q[2]))
    slower = [trim.speed_mm_s * 1e-3 / max(math.hypot(*tool_velocity(scara, q, qdot)), 1e-12)]
    for joint, velocity in zip(scara.joints, qdot):
        slower.append(joint.velocity * config.jog.speed_percent / 100.0 / max(abs(velocity), 1e-12))
    share = min(1.0, *slower) * (1.0 - 1e-9)
    return TrimStep((qdot[0] * share, qdot[1] * share, qdot[2] * share), error)


class Requests:
    """At most one running request: a newer one cancels the older, STOP cancels it too."""

    def __init__(self) -> None:
        """Start without any."""
        self._newest = 0
        self._cancelled: dict[int, str] = {}

    def begin(self) -> int:
        """Begin a request; the older ones are cancelled."""
        self.cancel("replaced by a newer request")
        self._newest += 1
        self._cancelled[self._newest] = ""
        return self._newest

    @property
    def oldest(self) -> int | None:
        """The oldest request that still runs."""
        return min(self._cancelled, default=None)

    def cancel(self, why: str) -> None:
        """Cancel all running requests; the first reason stays."""
        self._cancelled = {request: text or why for request, text in self._cancelled.items()}

    def why_cancelled(self, request: int) -> str:
        """Return why a running request was cancelled, or an empty text."""
        return self._cancelled[request]

    def end(self, request: int) -> None:
        """Forget a request."""
        del self._cancelled[request]
