r"""The time on a line or an arc: the tool goes with one speed between its two ramps.

With the way :math:`s`: :math:`\dot q = q' \dot s`, :math:`\ddot q = q'' \dot s^2 + q' \ddot s` and
:math:`\dddot q = q''' \dot s^3 + 3 q'' \dot s \ddot s + q' \dddot s`. So with one speed, one
acceleration and one jerk of the tool no joint exceeds its own anywhere if

.. math:: |q'| v \le \dot q_{max}, \quad |q''| v^2 + |q'| a \le \ddot q_{max}, \quad
          |q'''| v^3 + 3 |q''| v a + |q'| j \le \dddot q_{max}

at all places. Of the speeds that can be had the one is taken that ends soonest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import ruckig
from scara_config import Joint

from scara_control.joint_motion import Vector
from scara_control.kinematics.tool_path import SolvedPath
from scara_control.motion.plan import PlanError, calculate

_SPEEDS = tuple(0.94**k for k in range(48))
"""Parts of the largest speed that are tried (our choice: down to a twentieth)."""
_RAMPS = (1.0, 0.7, 0.5, 0.35)
"""Parts of the acceleration that a speed leaves: a gentler one leaves more jerk (our choice)."""


class ToolMove:
    """A segment of a path in which the tool goes along its curve."""

    __slots__ = ("_law", "_path", "speed")

    def __init__(self, path: SolvedPath, law: ruckig.Trajectory, speed: float) -> None:
        """Go along ``path`` by ``law``, no faster than ``speed`` [m/s] of the tool."""
        self._path, self._law, self.speed = path, law, speed

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return float(self._law.duration)

    def at_time(self, time: float) -> tuple[Vector, Vector, Vector]:
        """Return positions, velocities and accelerations."""
        (s,), (v,), (a,) = self._law.at_time(time)
        track = self._path.track
        # ruckig may end a rounding error beyond its target, where the track would ramp down.
        q, first, second = track.sample(min(max(s, 0.0), track.last_time * (1.0 - 1e-12)))
        return (
            tuple(q),
            tuple([slope * v for slope in first]),
            tuple([bend * v * v + slope * a for slope, bend in zip(first, second)]),
        )


def plan_tool_move(
    joints: Sequence[Joint], path: SolvedPath, speed_percent: float, share: float = 1.0
) -> ToolMove:
    """Plan the time on a path of the tool, from rest to rest.

    Args:
        joints: Limits of velocity, acceleration and jerk.
        path: Solved.
        speed_percent: Share of the joints' velocities, (0, 100].
        share: Of their accelerations, (0, 1].

    Raises:
        PlanError: No speed that is tried leaves acceleration and jerk to reach it.
    """
    slope, bend, twist = (np.abs(table) for table in path.rows)
    fastest = _least(np.array([joint.velocity for joint in joints]) * speed_percent / 100.0, slope)
    if path.speed_mm_s:
        fastest = min(fastest, 1e-3 * path.speed_mm_s)
    accelerations = np.array([joint.acceleration * share for joint in joints])
    jerks = np.array([joint.jerk for joint in joints])
    best: tuple[ruckig.Trajectory, float] | None = None
    for part in _SPEEDS:
        speed = part * fastest
        # The way alone takes longer than the best law, and what follows is slower still.
        if best is not None and path.track.last_time / speed > best[0].duration:
            break
        most = _least(accelerations - bend * speed**2, slope)
        # The bends of the way take all that the joints have at this speed.
        if most <= 0.0:
            continue
        for acceleration in (ramp * most for ramp in _RAMPS):
            left = jerks - twist * speed**3 - 3.0 * bend * speed * acceleration
            jerk = _least(left, slope)
            if jerk <= 0.0:
                continue
            wanted = ruckig.InputParameter(1)
            wanted.current_position, wanted.target_position = [0.0], [path.track.last_time]
            wanted.max_velocity = [speed]
            wanted.max_acceleration, wanted.max_jerk = [acceleration], [jerk]
            law = calculate(wanted)
            if best is None or law.duration < best[0].duration:
                best = law, speed
    if best is None:
        slowest = 1e3 * _SPEEDS[-1] * fastest
        raise PlanError(
            f"no path: the line bends the joints' way too sharply, even at {slowest:.3g} mm/s"
        )
    return ToolMove(path, *best)


def _least(limits: np.ndarray, by: np.ndarray) -> float:
    """Return the least quotient of limits, shape (n,) or (m, n), by rates, shape (m, n)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        # A joint that turns back there limits nothing, unless its bend alone takes too much.
        return float(np.nanmin(limits / by))
