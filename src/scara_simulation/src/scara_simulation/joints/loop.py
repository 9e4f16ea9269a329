"""One joint's control loop: the last command wins, and switching makes no jump of the effort.

With a model of its joint the loop takes a position command to it along a jerk-limited path, so that
a step of any size stays within the effort, and overcomes friction by the model. Without one (the
article's plain PID) the command itself is the set point, and damping, friction and weight are left
to the gains.
"""

from __future__ import annotations

import math
from typing import Literal

import msgspec
from scara_control.joint_motion import AxisMotion
from scara_control.joint_track import JointTrack
from scara_control.pid import PidGains, compute_command, integral_for_effort, saturate

from scara_simulation.catch_up import catch_up, has_jumped
from scara_simulation.config import LoopGains
from scara_simulation.joints.cells import Cells, Mode
from scara_simulation.joints.model import JointModel
from scara_simulation.track_queue import TrackQueue

_BRAKING_LAG = 0.05
"""[s] Three time constants of the velocity loop: how late it may follow a braking command. Our
choice."""


_NOTICED = 10.0
"""So many tolerances beyond a limit count. Between two set points inside, the smooth path goes over
by less where a robot brakes into its limit. That is kept inside and is nobody's fault."""


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


class JointLoop(Cells):
    """Set point, mode and integral of one joint.

    Each step is two calls: :meth:`reference` (what shall be, for the inverse dynamics) and
    :meth:`effort`. Compiled, both are done in C where nothing but the next set point is due.
    """

    __slots__ = (
        "_full",
        "_next_velocity",
        "_path_time",
        "_speed_limit",
        "_target",
        "_velocity_command",
        "_velocity_until",
        "limited_steps",
    )

    def __init__(
        self, model: JointModel, gains: LoopGains, position: float, *, model_based: bool = True
    ) -> None:
        """Hold ``position``; ``model_based``.

        With it, paths and friction compensation are used, else plain PID.
        """
        # `model` is the full one with the share of acceleration that the payload leaves
        # (`permit`).
        self.model = self._full = model
        self.loop_gains = gains
        self._model_based = model_based
        self.saturated_steps = 0
        self.limited_steps = 0
        self._speed_limit = 100.0
        self.reset(position)

    def reset(self, position: float) -> None:
        """Forget every command and hold ``position``; the counters stay."""
        self.mode = "position"
        self.holding = True
        self.position_setpoint = position
        self.velocity_setpoint = 0.0
        self.applied_effort = self._integral = 0.0
        self._velocity_command = self._last_velocity = self._next_velocity = 0.0
        # After this time a velocity command is over: whoever commands has to come again.
        self._velocity_until = math.inf
        self._queue = TrackQueue()
        self.keep_piece(None)
        # Set from a jump of the set points until the joint has caught up; until then each of them
        # is only a direction.
        self._behind = False
        self._target = position
        # Where the reference is, not where the joint is: a new command begins there, so the effort
        # makes no jump.
        self._wanted = (position, 0.0, 0.0)
        self._path = None
        self._path_time = 0.0

    @property
    def gains(self) -> PidGains:
        """Gains of the loop that is closed now."""
        return self.loop_gains.position if self.holding else self.loop_gains.velocity

    def set_gains(self, gains: LoopGains) -> None:
        """Go on with other gains.

        The effort of the integral stays, as far as the new clamp allows.
        """
        effort = self._integral_effort()
        self.loop_gains = gains
        self._integral = integral_for_effort(self.gains, effort)

    def command_position(self, position: float) -> None:
        """Go to ``position``.

        The joint goes along a path that begins with the present motion, or, without a model, by a
        step.
        """
        self._close_loop("position", holding=True)
        self._target, self._path_time = position, 0.0
        self._path = None
        if self._model_based:
            self._path = self.model.plan(self._wanted, position, self._speed_limit)
        else:
            self._wanted = position, 0.0, 0.0

    def command_velocity(self, velocity: float, until: float = math.inf) -> None:
        """Move with ``velocity`` until the time ``until`` [s].

        0 holds the position as soon as the joint stands still.
        """
        if self.mode != "velocity":
            self._close_loop("velocity", holding=False)
        self._velocity_command, self._velocity_until = velocity, until

    def limit_speed(self, percent: float) -> None:
        """Cap what direct commands may do, now and later [percent of the joint's velocity].

        Set points with a time are capped by who sends them. A plain PID's step of the position
        knows no speed.
        """
        if percent == self._speed_limit:
            return
        self._speed_limit = percent
        if self.mode == "position" and self._path is not None:
            self.command_position(self._target)

    def permit(self, share: float) -> None:
        """Plan direct commands from now on with a share of the joint's acceleration, (0, 1]."""
        acceleration = self._full.acceleration * share
        self.model = msgspec.structs.replace(self._full, acceleration=acceleration)

    def is_moving(self, qdot: float) -> bool:
        """Tell whether the joint moves, measured or by its set point."""
        # In this form a speed that is no number counts as motion.
        return not abs(qdot) <= self.model.standstill or self._wanted[1] != 0.0

    def stop(self) -> None:
        """Come to rest within the joint's acceleration, and hold there.

        A joint that rests stays as it is. Set points with a time end where their sender ends them.
        """
        # A plain PID has no path: it is on its way from its command on until the joint stands.
        by_step = not self._model_based and (
            self._target != self.position_setpoint or self.is_moving(self._last_velocity)
        )
        if self.mode == "velocity":
            self._velocity_command = 0.0
        elif self.mode == "position" and (by_step or self._path is not None):
            self.command_velocity(0.0)

    def end_track(self, t: float) -> None:
        """Come to rest if set points with a time move the joint at ``t`` [s], or will later."""
        if self.mode == "trajectory" and (
            self.is_moving(self._last_velocity) or self._queue.lasts(t)
        ):
            self.command_velocity(0.0)

    def command_track(self, track: JointTrack, column: int) -> None:
        """Follow a column of ``track`` from its first point on; what was sent for earlier stays."""
        self._close_loop("trajectory", holding=True)
        self._queue.add(track, column)
        self.keep_piece(None)

    def postpone(self, duration: float) -> None:
        """Let all set points be due ``duration`` [s] later."""
        self._queue.postpone(duration)
        self.keep_piece(None)
        self._velocity_until += duration

    def reference(self, t: float, q: float, qdot: float, dt: float) -> AxisMotion:
        """Return the motion at time ``t`` that the inverse dynamics shall be computed for.

        A set point with a time and a path are met in position, velocity and acceleration. In
        velocity mode no position is wanted but the measured one; the velocity set point goes to the
        commanded one within the joint's acceleration.
        """
        if self.mode == "trajectory":
            self._wanted = self._catch_up(self._sample(t), dt)
        elif self.mode == "velocity":
            if t > self._velocity_until:
                self._velocity_command = 0.0
            self._limit_velocity(q, qdot)
            if not self.holding:
                self._wanted = self._towards_velocity(q, dt)
                return self._wanted
        elif self._path is not None:
            self._path_time += dt
            motion = self._path.at(self._path_time)
            if self._path_time >= self._path.duration:
                self._path = None
            self._wanted = motion.q[0], motion.qdot[0], motion.qddot[0]
        position, velocity, acceleration = self._wanted
        # The integrator's velocity belongs to the middle of the last step, so the reference does
        # too.
        self.position_setpoint = position
        self.velocity_setpoint = velocity - 0.5 * dt * acceleration
        return self._wanted

    def effort(self, q: float, qdot: float, feed_forward: float, dt: float) -> float:
        """Return the effort for this step [N m] or [N], within the joint's limit."""
        model = self.model
        if self.holding:
            error = self.position_setpoint - q
            command, integral = compute_command(
                self.loop_gains.position, self._integral, error, self.velocity_setpoint - qdot, dt
            )
            if self._model_based:
                feed_forward += model.friction_effort(self._wanted[1], error)
        else:
            # The derivative is of the measured velocity alone: a step of the set point makes no
            # kick.
            error, error_dot = self.velocity_setpoint - qdot, (self._last_velocity - qdot) / dt
            command, integral = compute_command(
                self.loop_gains.velocity, self._integral, error, error_dot, dt
            )
            if self._model_based:
                feed_forward += model.friction_effort(self.velocity_setpoint)
        self._last_velocity = qdot
        self.applied_effort, saturated = saturate(command + feed_forward, model.effort)
        if saturated:
            self.saturated_steps += 1
        else:
            # At rest beside a model the position loop's integral is there for dry friction alone. A
            # larger error is a jump of the set point, as after a stall. Wound up by it, the joint
            # would settle for another second.
            gains = self.loop_gains.position
            by_friction = gains.lower <= gains.p * error <= gains.upper
            if by_friction or not (self.holding and self._model_based):
                self._integral = integral
        return self.applied_effort

    def state(self, q: float, qdot: float) -> LoopState:
        """Return what the loop did in the last step.

        In velocity mode that is the velocity loop, also while it holds.

        The set point of the position and velocity modes is the commanded one, within the limits of
        the joint.
        """
        kind: Literal["position", "velocity"]
        if self.mode == "velocity":
            kind, value, value_dot, set_point, gains = (
                "velocity",
                qdot,
                0.0,
                self._target,
                self.loop_gains.velocity,
            )
        else:
            set_point = self._target if self.mode == "position" else self.position_setpoint
            kind, value, value_dot, gains = "position", q, qdot, self.loop_gains.position
        return LoopState(
            self.model.name,
            kind,
            set_point,
            value,
            value_dot,
            set_point - value,
            self.applied_effort,
            gains,
        )

    def _catch_up(self, wanted: AxisMotion, dt: float) -> AxisMotion:
        """Return the set point that is due, or one on the way to it if it has jumped."""
        model, last = self.model, self._wanted
        if not self._model_based:
            return wanted
        if not self._behind and not has_jumped(last, wanted, model.velocity, dt):
            return wanted
        reached = catch_up(last, wanted, model.velocity, model.acceleration, dt)
        self._behind = reached != wanted
        position, velocity, acceleration = reached
        if not model.lower <= position <= model.upper:
            return min(max(position, model.lower), model.upper), 0.0, 0.0
        return position, velocity, acceleration

    def _sample(self, t: float) -> AxisMotion:
        """Sample the set points that are due, kept inside the joint's limits."""
        sample, model = self._queue.sample(t), self.model
        if model.lower - model.tolerance <= sample[0] <= model.upper + model.tolerance:
            return sample
        over = max(model.lower - sample[0], sample[0] - model.upper)
        self.limited_steps += over > _NOTICED * model.tolerance
        return min(max(sample[0], model.lower), model.upper), 0.0, 0.0

    def _limit_velocity(self, q: float, qdot: float) -> None:
        """Brake in front of the joint's limit and hold there.

        Hold at standstill when the command is 0.
        """
        model, wanted = self.model, self._velocity_command
        limit, room = (
            (model.upper, model.upper - q) if wanted > 0.0 else (model.lower, q - model.lower)
        )
        lag = model.acceleration * _BRAKING_LAG
        # The speed from which the joint stops within the room, though it begins to brake late.
        allowed = math.sqrt(lag * lag + 2.0 * model.acceleration * max(0.0, room)) - lag
        capped = model.velocity * self._speed_limit * 1e-2
        wanted = min(max(wanted, -capped), capped)
        if abs(wanted) <= allowed:
            self._drive(wanted, q, qdot)
            return
        self.limited_steps += 1
        if allowed > model.standstill * (2.0 if self.holding else 1.0):  # once held, it stays held
            self._drive(math.copysign(allowed, wanted), q, qdot)
        else:
            self._hold(limit)

    def _drive(self, velocity: float, q: float, qdot: float) -> None:
        """Close the velocity loop, or the position loop once 0 is wanted and reached."""
        self._target = velocity
        if velocity != 0.0:
            if self.holding:
                self._close_loop("velocity", holding=False)
        elif (
            not self.holding
            and self.velocity_setpoint == 0.0
            and abs(qdot) <= self.model.standstill
        ):
            self._hold(q)

    def _towards_velocity(self, q: float, dt: float) -> AxisMotion:
        """Move the velocity set point on towards the commanded one.

        Without a model it jumps there.
        """
        velocity, most = (
            self._next_velocity,
            self.model.acceleration * dt if self._model_based else math.inf,
        )
        self._next_velocity = min(max(self._target, velocity - most), velocity + most)
        self.velocity_setpoint = velocity
        return q, 0.5 * (velocity + self._next_velocity), (self._next_velocity - velocity) / dt

    def _hold(self, position: float) -> None:
        """Close the position loop at ``position``, still in velocity mode."""
        self._close_loop("velocity", holding=True)
        self._target = 0.0
        self._wanted = position, 0.0, 0.0

    def _integral_effort(self) -> float:
        """Return what the integral term of the closed loop makes now [N m] or [N]."""
        gains = self.gains
        return min(max(gains.i * self._integral, gains.lower), gains.upper)

    def _close_loop(self, mode: Mode, *, holding: bool) -> None:
        """Change the mode; the effort of the integral is carried over to the other loop."""
        if holding != self.holding:
            effort = self._integral_effort()
            self.holding = holding
            self._integral = integral_for_effort(self.gains, effort)
            self._next_velocity = self._wanted[1]
        self.mode = mode
        if mode != "trajectory":
            self._queue.clear()
            self.keep_piece(None)
            self._behind = False
