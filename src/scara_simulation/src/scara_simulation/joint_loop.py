"""One joint's control loop: the last command wins, and switching makes no jump of the effort."""

from __future__ import annotations

import math
from typing import Literal

import msgspec
from scara_control.pid import PidGains, compute_command, integral_for_effort, saturate
from scara_control.setpoints import Sample, SetpointTrack

from scara_simulation.config import LoopGains

Mode = Literal["trajectory", "position", "velocity"]

_BRAKING_LAG = 0.05
"""[s] Three time constants of the velocity loop: how late it may follow a braking command. Our choice."""


class JointModel(msgspec.Struct, frozen=True):
    """What the loop knows of its joint, in SI: limits of robot.yaml, damping and friction of the URDF.

    ``standstill`` is the speed that counts as none, ``tolerance`` how far a set point may pass a limit unnoticed.
    """

    name: str
    lower: float
    upper: float
    velocity: float
    acceleration: float
    effort: float
    standstill: float
    tolerance: float = 0.0
    damping: float = 0.0
    friction: float = 0.0

    def friction_effort(self, velocity: float) -> float:
        """Return the effort that overcomes damping and dry friction at ``velocity``, without a jump at rest."""
        return self.damping * velocity + self.friction * min(max(velocity / self.standstill, -1.0), 1.0)


class LoopState(msgspec.Struct, frozen=True):
    """The loop that is closed: what control_msgs/JointControllerState tells."""

    joint: str
    kind: Literal["position", "velocity"]
    set_point: float
    process_value: float
    process_value_dot: float
    error: float
    command: float
    gains: PidGains


class JointLoop:
    """Set point, mode and integral of one joint.

    Each step is two calls: :meth:`reference` (what shall be, for the inverse dynamics) and :meth:`effort`.
    """

    __slots__ = (
        "_friction_effort",
        "_gains",
        "_integral",
        "_queue",
        "_velocity_command",
        "applied_effort",
        "error",
        "holding",
        "limited_steps",
        "mode",
        "model",
        "position_setpoint",
        "saturated_steps",
        "velocity_setpoint",
    )

    def __init__(self, model: JointModel, gains: LoopGains, position: float) -> None:
        """Hold ``position``."""
        self.model = model
        self._gains = gains
        self.saturated_steps = 0
        self.limited_steps = 0
        self.reset(position)

    def reset(self, position: float) -> None:
        """Forget every command and hold ``position``; the counters stay."""
        self.mode: Mode = "position"
        self.holding = True
        self.position_setpoint = position
        self.velocity_setpoint = 0.0
        self.error = 0.0
        self.applied_effort = 0.0
        self._velocity_command = 0.0
        self._friction_effort = 0.0
        self._integral = 0.0
        self._queue: list[tuple[SetpointTrack, int, float]] = []

    @property
    def gains(self) -> PidGains:
        """Gains of the loop that is closed now."""
        return self._gains.position if self.holding else self._gains.velocity

    def command_position(self, position: float) -> None:
        """Go to ``position`` with zero velocity reference."""
        self._close_loop("position", holding=True)
        self.position_setpoint = position
        self.velocity_setpoint = 0.0

    def command_velocity(self, velocity: float) -> None:
        """Move with ``velocity``; 0 holds the position as soon as the joint stands still."""
        if self.mode != "velocity":
            self._close_loop("velocity", holding=False)
        self._velocity_command = velocity

    def command_track(self, track: SetpointTrack, column: int) -> None:
        """Follow a column of ``track`` from its first point on; what was sent for earlier stays."""
        earlier = [entry for entry in self._queue if entry[0].first_time + entry[2] < track.first_time]
        self._close_loop("trajectory", holding=True)
        self._queue = earlier + [(track, column, 0.0)]

    def postpone(self, duration: float) -> None:
        """Let all set points be due ``duration`` [s] later."""
        self._queue = [(track, column, delay + duration) for track, column, delay in self._queue]

    def reference(self, t: float, q: float, qdot: float, dt: float) -> Sample:
        """Return the motion at time ``t`` that the inverse dynamics shall be computed for.

        A set point with a time is met in position, velocity and acceleration. Without one only gravity and the
        velocity coupling at the measured state are wanted, and the braking in front of a limit.
        """
        if self.mode == "trajectory":
            position, velocity, acceleration = self._sample(t)
            # The integrator's velocity belongs to the middle of the last step, so the reference does too.
            self.position_setpoint = position
            self.velocity_setpoint = velocity - 0.5 * dt * acceleration
            self._friction_effort = self.model.friction_effort(velocity)
            return position, velocity, acceleration
        acceleration = self._limit_velocity(q, qdot) if self.mode == "velocity" else 0.0
        self._friction_effort = self.model.friction_effort(self.velocity_setpoint)
        return q, qdot, acceleration

    def effort(self, q: float, qdot: float, feed_forward: float, dt: float) -> float:
        """Return the effort for this step [N m] or [N], within the joint's limit."""
        if self.holding:
            self.error = self.position_setpoint - q
            gains, error_dot = self._gains.position, self.velocity_setpoint - qdot
        else:
            self.error = self.velocity_setpoint - qdot
            gains, error_dot = self._gains.velocity, 0.0
        command, integral = compute_command(gains, self._integral, self.error, error_dot, dt)
        self.applied_effort, saturated = saturate(command + feed_forward + self._friction_effort, self.model.effort)
        if saturated:
            self.saturated_steps += 1
        else:
            self._integral = integral
        return self.applied_effort

    def state(self, q: float, qdot: float) -> LoopState:
        """Return what the loop did in the last step; in velocity mode the velocity loop, also while it holds."""
        if self.mode == "velocity":
            value, value_dot, set_point, gains = qdot, 0.0, self.velocity_setpoint, self._gains.velocity
            return LoopState(
                self.model.name, "velocity", set_point, value, value_dot, set_point - value, self.applied_effort, gains
            )
        return LoopState(
            self.model.name, "position", self.position_setpoint, q, qdot, self.error, self.applied_effort, self._gains.position
        )

    def _sample(self, t: float) -> Sample:
        """Sample the set points that are due, kept inside the joint's limits."""
        queue = self._queue
        while len(queue) > 1 and queue[1][0].first_time + queue[1][2] <= t:
            queue.pop(0)
        track, column, delay = queue[0]
        sample = track.sample_joint(column, t - delay)
        model = self.model
        if model.lower - model.tolerance <= sample[0] <= model.upper + model.tolerance:
            return sample
        self.limited_steps += 1
        return min(max(sample[0], model.lower), model.upper), 0.0, 0.0

    def _limit_velocity(self, q: float, qdot: float) -> float:
        """Brake in front of the joint's limit and hold there; hold at standstill when the command is 0.

        Returns:
            The acceleration of the braking.
        """
        model, wanted = self.model, self._velocity_command
        limit, room = (model.upper, model.upper - q) if wanted > 0.0 else (model.lower, q - model.lower)
        lag = model.acceleration * _BRAKING_LAG
        allowed = math.sqrt(lag * lag + 2.0 * model.acceleration * max(0.0, room)) - lag
        if abs(wanted) <= allowed:
            self._drive(wanted, q, qdot)
            return 0.0
        self.limited_steps += 1
        if allowed > model.standstill * (2.0 if self.holding else 1.0):  # once held, it stays held
            self._drive(math.copysign(allowed, wanted), q, qdot)
            return -model.acceleration * self.velocity_setpoint / (allowed + lag)
        self._hold(limit)
        return 0.0

    def _drive(self, velocity: float, q: float, qdot: float) -> None:
        """Close the velocity loop, or the position loop once 0 is wanted and reached."""
        if velocity != 0.0:
            if self.holding:
                self._close_loop("velocity", holding=False)
            self.velocity_setpoint = velocity
        elif not self.holding:
            self.velocity_setpoint = 0.0
            if abs(qdot) <= self.model.standstill:
                self._hold(q)

    def _hold(self, position: float) -> None:
        """Close the position loop at ``position``, still in velocity mode."""
        self._close_loop("velocity", holding=True)
        self.position_setpoint = position
        self.velocity_setpoint = 0.0

    def _close_loop(self, mode: Mode, *, holding: bool) -> None:
        """Change the mode; the effort of the integral is carried over to the other loop."""
        if holding != self.holding:
            effort = min(max(self.gains.i * self._integral, self.gains.lower), self.gains.upper)
            self.holding = holding
            self._integral = integral_for_effort(self.gains, effort)
        self.mode = mode
        if mode != "trajectory":
            self._queue = []
