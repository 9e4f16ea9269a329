"""Paths of all joints over time.

They are jerk-limited moves that start and end together, and stops from any state.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import ruckig
from scara_config import Joint

from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion, Vector
from scara_control.limits import LIMIT_TOLERANCE

_HARDER = (1.0, 2.0, 4.0, 8.0)
"""Factors on acceleration and jerk that a stop tries before it leaves the limits (our choice)."""


_LOOKS = 32
"""A path is looked at so often for its speed; the middle of a short move is among them."""
_NO_WAY = 1e-9
"""[rad] or [m]: a joint that has no further to go does not slow the others down (our choice, as
LIMIT_TOLERANCE)."""


class PlanError(ScaraControlError):
    """No path leads from the start to the target."""


class Segment(Protocol):
    """A part of a path: a ruckig trajectory, or something alike."""

    @property
    def duration(self) -> float:
        """How long it takes [s]."""

    def at_time(self, time: float) -> tuple[Sequence[float], Sequence[float], Sequence[float]]:
        """Return positions, velocities and accelerations."""


class StraightMove:
    """A straight line in joint space.

    A trajectory of one number, the way of the joint that goes furthest.
    """

    __slots__ = ("_slope", "_start", "_way")

    def __init__(self, start: Vector, slope: Vector, way: ruckig.Trajectory) -> None:
        """Go from ``start``; ``slope`` is how far each joint goes per way."""
        self._start, self._slope, self._way = start, slope, way

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return float(self._way.duration)

    def at_time(self, time: float) -> tuple[Vector, Vector, Vector]:
        """Return positions, velocities and accelerations."""
        (s,), (v,), (a,) = self._way.at_time(time)
        slope = self._slope
        return (
            tuple(q + s * k for q, k in zip(self._start, slope)),
            tuple(v * k for k in slope),
            tuple(a * k for k in slope),
        )


class Path:
    """One or more segments in a row; before the first its start, after the last its end at rest."""

    __slots__ = ("_end", "_segments", "corners", "duration", "share")

    def __init__(
        self,
        segments: Sequence[Segment],
        end: Sequence[float],
        share: float,
        corners: Sequence[Vector] = (),
    ) -> None:
        """Chain ``segments``; ``end`` is where the last one ends, to the last digit.

        ``share`` of the joints' accelerations was given to them. The ``corners`` of a way that is
        not straight in joint space are joint positions on it, straight from one to the next.
        """
        self._segments = tuple(segments)
        self.share, self.corners = share, tuple(corners)
        self._end = JointMotion.at_rest(end)
        self.duration: float = sum(segment.duration for segment in segments)

    @property
    def segments(self) -> tuple[Segment, ...]:
        """Its parts, in order."""
        return self._segments

    @property
    def end(self) -> Vector:
        """Where the joints come to rest."""
        return self._end.q

    def peak_percent(self, joints: Sequence[Joint]) -> float:
        """Return the speed of the fastest joint [percent of its largest], to a percent or so."""
        taus = (self.duration * k / _LOOKS for k in range(1, _LOOKS))
        speeds = (zip(self.at(tau).qdot, joints) for tau in taus)
        return max((100.0 * abs(v) / joint.velocity for row in speeds for v, joint in row))

    def at(self, tau: float) -> JointMotion:
        """Return the motion at path time ``tau`` [s]."""
        if tau >= self.duration:
            return self._end
        tau = max(tau, 0.0)
        for segment in self._segments[:-1]:
            if tau < segment.duration:
                break
            tau -= segment.duration
        else:
            segment = self._segments[-1]
        q, qdot, qddot = segment.at_time(tau)
        return JointMotion(tuple(q), tuple(qdot), tuple(qddot))


def plan_move(
    joints: Sequence[Joint],
    start: JointMotion,
    target: Sequence[float],
    speed_percent: float,
    share: float = 1.0,
) -> Path:
    """Plan a move that all joints end together; from rest it is a straight line in joint space.

    Args:
        joints: Limits of velocity, acceleration and jerk.
        start: Any state; what exceeds the limits is braked first.
        target: Joint positions, within the limits.
        speed_percent: Share of the joints' velocities, (0, 100]; accelerations and jerks stay.
        share: Of the joints' accelerations, (0, 1]; jerks stay.

    Raises:
        PlanError: A value is not finite.

    Source:
        Berscheid & Kroeger, Jerk-limited Real-time Trajectory Generation (ruckig), 2021.
    """
    _check_finite(start, target)
    if not any(start.qdot) and not any(start.qddot):
        return Path([_straight_move(joints, start.q, target, speed_percent, share)], target, share)
    trajectory = calculate(_input(joints, start, target, speed_percent, share))
    # From a motion the shortest way may swing beyond a limit; from a stop it cannot.
    if _within(joints, trajectory, start, target):
        return Path([trajectory], target, share)
    stop = _stop(joints, start, share, at_once=False)
    rest = tuple(stop.at_time(stop.duration)[0])
    on = _straight_move(joints, rest, target, speed_percent, share)
    return Path([stop, on], target, share)


def plan_stop(
    joints: Sequence[Joint], start: JointMotion, share: float = 1.0, at_once: bool = False
) -> Path:
    """Plan the fastest jerk-limited stop of each joint.

    Brake harder rather than run beyond a limit.

    Args:
        joints: Limits.
        start: Any state.
        share: Of the joints' accelerations, (0, 1]; jerks stay.
        at_once: No joint gains speed first, and jerks are the highest. So whoever follows a robot
            that was stopped at once stands no farther on than that.

    Raises:
        PlanError: A value is not finite.
    """
    _check_finite(start, start.q)
    if at_once:
        braked = tuple(0.0 if v * a >= 0.0 else a for v, a in zip(start.qdot, start.qddot))
        start = JointMotion(start.q, start.qdot, braked, start.time)
    trajectory = _stop(joints, start, share, at_once)
    return Path([trajectory], trajectory.at_time(trajectory.duration)[0], share)


def _straight_move(
    joints: Sequence[Joint],
    start: Vector,
    target: Sequence[float],
    speed_percent: float,
    share: float,
) -> StraightMove:
    """Plan a straight line from rest, as fast as the slowest joint allows at any time."""
    delta = [end - q for q, end in zip(start, target)]
    # A move to where the joints are has no way to divide by.
    longest = max(map(abs, delta)) or 1.0
    slope = tuple(d / longest for d in delta)
    parts = [(joint, abs(d) / longest) for joint, d in zip(joints, delta) if abs(d) > _NO_WAY]
    wanted = ruckig.InputParameter(1)
    wanted.current_position, wanted.target_position = [0.0], [max(map(abs, delta))]
    wanted.max_velocity = [
        min((joint.velocity * speed_percent / 100.0 / part for joint, part in parts), default=1.0)
    ]
    wanted.max_acceleration = [
        min((joint.acceleration * share / part for joint, part in parts), default=1.0)
    ]
    wanted.max_jerk = [min((joint.jerk / part for joint, part in parts), default=1.0)]
    return StraightMove(start, slope, calculate(wanted))


def _check_finite(start: JointMotion, target: Sequence[float]) -> None:
    """Refuse what is no number: not all of it is seen by ruckig."""
    for what, values in (
        ("q", start.q),
        ("qdot", start.qdot),
        ("qddot", start.qddot),
        ("target", target),
    ):
        if not all(map(math.isfinite, values)):
            raise PlanError(f"no path: {what} = {list(values)}: not finite")


def _stop(
    joints: Sequence[Joint], start: JointMotion, share: float, at_once: bool
) -> ruckig.Trajectory:
    """Calculate a stop, as hard as needed to stay within the limits."""
    for harder in _HARDER:
        wanted = _input(
            joints, start, start.q, 100.0, share * harder, max(_HARDER) if at_once else harder
        )
        wanted.control_interface = ruckig.ControlInterface.Velocity
        # No joint goes on for longer because another one needs more time.
        wanted.synchronization = ruckig.Synchronization.No
        trajectory = calculate(wanted)
        if _within(joints, trajectory, start, start.q):
            break
    return trajectory


def _input(
    joints: Sequence[Joint],
    start: JointMotion,
    target: Sequence[float],
    speed_percent: float,
    share: float,
    harder: float = 1.0,
) -> ruckig.InputParameter:
    """Fill in ruckig's form; ``share`` is of the accelerations, ``harder`` of the jerks."""
    wanted = ruckig.InputParameter(len(joints))
    wanted.current_position, wanted.current_velocity, wanted.current_acceleration = (
        start.q,
        start.qdot,
        start.qddot,
    )
    wanted.target_position = target
    wanted.max_velocity = [joint.velocity * speed_percent / 100.0 for joint in joints]
    wanted.max_acceleration = [joint.acceleration * share for joint in joints]
    wanted.max_jerk = [joint.jerk * harder for joint in joints]
    wanted.synchronization = ruckig.Synchronization.Phase
    return wanted


def calculate(wanted: ruckig.InputParameter) -> ruckig.Trajectory:
    """Run ruckig and turn its errors into ours."""
    trajectory = ruckig.Trajectory(wanted.degrees_of_freedom)
    try:
        result = ruckig.Ruckig(wanted.degrees_of_freedom).calculate(wanted, trajectory)
    except ruckig.RuckigError as error:
        raise PlanError(f"no path: {str(error).strip()}") from error
    if result not in (ruckig.Result.Working, ruckig.Result.Finished):
        raise PlanError(f"no path: {result.name}")
    return trajectory


def _within(
    joints: Sequence[Joint],
    trajectory: ruckig.Trajectory,
    start: JointMotion,
    target: Sequence[float],
) -> bool:
    """Say whether no joint goes further beyond its limits than its start or target is."""
    return all(
        min(joint.lower, q, end) - LIMIT_TOLERANCE <= bound.min
        and bound.max <= max(joint.upper, q, end) + LIMIT_TOLERANCE
        for joint, bound, q, end in zip(joints, trajectory.position_extrema, start.q, target)
    )
