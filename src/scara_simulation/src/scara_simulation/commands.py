"""What the simulator lets in.

A command is taken whole or refused with joint, value and allowed range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from scara_config import Joint, Robot
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.joint_track import JointTrack, SetpointError

from scara_simulation.config import SimulationConfig


class CommandError(ValueError):
    """A command that moves nothing; the text says why."""


class CommandGate:
    """Checks commands against robot.yaml and the tolerances of simulation.yaml."""

    def __init__(self, robot: Robot, config: SimulationConfig) -> None:
        """Remember the limits of the twin's joints."""
        self._joints: dict[str, Joint] = {joint.name: joint for joint in robot.twin_joints}
        self._tolerance = {
            joint.name: config.position_tolerance(joint) for joint in robot.twin_joints
        }
        self._velocity_factor = 1.0 + config.velocity_tolerance_percent / 100.0
        self._acceleration_factor = 1.0 + config.acceleration_tolerance_percent / 100.0
        self._extrapolation_limit = config.extrapolation_limit_ms / 1e3
        self._lead_limit = config.setpoint_lead_limit_ms / 1e3

    def position(self, name: str, value: float) -> float:
        """Return the position set point of one joint.

        One that passes a limit by less than the tolerance is pulled to it.

        Raises:
            CommandError: Unknown joint, not finite, or outside the joint's limits.
        """
        joint = self._joint(name)
        _check_range(joint, "", value, joint.lower, joint.upper, self._tolerance[name])
        return min(max(value, joint.lower), joint.upper)

    def velocity(self, name: str, value: float) -> float:
        """Return the velocity set point of one joint.

        Raises:
            CommandError: Unknown joint, not finite, or faster than the joint's limit.
        """
        joint = self._joint(name)
        _check_range(joint, " velocity", value, -joint.velocity, joint.velocity, 1e-9)
        return value

    def track(self, setpoints: Setpoints, now: float) -> JointTrack:
        """Return the set points of a message as a track of its joints.

        Velocities or accelerations may be left out: they count as zero.

        Args:
            setpoints: As they came; the times are on the simulation's axis.
            now: Nominal time of the simulation [s], on the same axis.

        Raises:
            CommandError: Unknown joint or one named twice, no points, a wrong count, a value that
                is not finite or outside the limits, times that do not increase, all points past, or
                the first too far ahead.
        """
        names, points = setpoints.names, setpoints.points
        joints = [self._joint(name) for name in names]
        if len(set(names)) != len(names) or not names:
            raise CommandError(f"joints {list(names)}: name each joint once")
        zeros = [0.0] * len(joints)
        try:
            track = JointTrack(
                setpoints.times,
                [point.q for point in points],
                [point.qdot or zeros for point in points],
                [point.qddot or zeros for point in points],
                extrapolation_limit=self._extrapolation_limit,
                stop_accelerations=[joint.acceleration for joint in joints],
            )
        except SetpointError as error:
            raise CommandError(str(error)) from error
        for point in points:
            self._check_point(joints, point)
        late = now - track.last_time
        if late > self._extrapolation_limit:
            raise CommandError(
                f"stale: the last point was due {late:.3f} s ago, allowed are "
                f"{self._extrapolation_limit:g} s"
            )
        early = track.first_time - now
        if early > self._lead_limit:
            raise CommandError(
                f"the first point is due in {early:.3f} s, allowed are {self._lead_limit:g} "
                "s: wrong clock?"
            )
        return track

    def _check_point(self, joints: Sequence[Joint], point: JointMotion) -> None:
        for joint, q in zip(joints, point.q):
            _check_range(joint, "", q, joint.lower, joint.upper, self._tolerance[joint.name])
        for joint, v in zip(joints, point.qdot):
            limit = joint.velocity * self._velocity_factor
            if not -limit <= v <= limit:
                _check_range(joint, " velocity", v, -limit, limit, 0.0)
        for joint, a in zip(joints, point.qddot):
            limit = joint.acceleration * self._acceleration_factor
            if not -limit <= a <= limit:
                _check_range(joint, " acceleration", a, -limit, limit, 0.0)

    def _joint(self, name: str) -> Joint:
        if name not in self._joints:
            raise CommandError(f"unknown joint {name!r}: the twin has {', '.join(self._joints)}")
        return self._joints[name]


def _check_range(
    joint: Joint, what: str, value: float, lower: float, upper: float, tolerance: float
) -> None:
    """Refuse a value that is not finite, or outside its range by over ``tolerance``."""
    if lower - tolerance <= value <= upper + tolerance:
        return
    unit = joint.si_unit + {"": "", " velocity": "/s", " acceleration": "/s^2"}[what]
    if not math.isfinite(value):
        raise CommandError(f"{joint.name}{what} = {value}: not finite")
    raise CommandError(
        f"{joint.name}{what} = {value:.6g} {unit} is outside [{lower:.6g}, {upper:.6g}] {unit}"
    )
