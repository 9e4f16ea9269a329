"""Servo model of one axis: moving-average filters, a command limiter, a second-order position loop, an encoder."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import msgspec

from fanuc_emulator.interpolator import stopping_speed

_REST_POSITION = 1e-9
_REST_VELOCITY = 1e-7


class AxisParameters(msgspec.Struct, frozen=True, kw_only=True):
    """Limits and dynamics of one axis in SI: u is rad or m."""

    lower: float
    upper: float
    velocity: float
    program_acceleration: float
    command_acceleration: float
    servo_acceleration: float
    estop_deceleration: float
    natural_frequency: float
    damping: float
    velocity_feedforward: float
    resolution: float
    tolerance: float


class MovingAverage:
    """Mean of the last ``length`` values; a step at its input becomes a ramp."""

    def __init__(self, length: int, value: float) -> None:
        self._values = deque([value] * length, maxlen=length)
        self._length = length

    def step(self, value: float) -> float:
        """Take one value and return the mean."""
        self._values.append(value)
        return sum(self._values) / self._length

    def reset(self, value: float) -> None:
        """Forget the past: as if ``value`` had been there for ever."""
        self._values.extend([value] * self._length)


class CommandLimiter:
    """Follow a smoothed set point exactly while it keeps the axis' limits, and as near as they allow when it does not.

    Whatever comes in, the command stays inside the position range, its speed changes by at most ``command_acceleration dt``
    a step, and it can always stop before the end of the range.
    """

    def __init__(self, parameters: AxisParameters, position: float, dt: float) -> None:
        self._p = parameters
        self._dt = dt
        self.reset(position)

    def reset(self, position: float) -> None:
        """Stand still at ``position``."""
        self.position = position
        self.velocity = 0.0
        self._reference = position

    def step(self, reference: float, speed: float) -> None:
        """Follow ``reference`` for one step.

        Args:
            reference: Set point [u]; outside the range it counts as the range's end.
            speed: Fraction 0..1 of the axis' greatest speed; lowering it brakes, 0 stops.
        """
        p, dt = self._p, self._dt
        acceleration = p.command_acceleration
        reference = min(max(reference, p.lower), p.upper)
        behind = self._reference - self.position
        catch_up = math.copysign(stopping_speed(abs(behind), acceleration, dt), behind)
        wanted = (reference - self._reference) / dt + catch_up
        self._reference = reference
        limit = p.velocity * speed
        wanted = min(max(wanted, -limit), limit)
        wanted = min(wanted, stopping_speed(p.upper - self.position, acceleration, dt))
        wanted = max(wanted, -stopping_speed(self.position - p.lower, acceleration, dt))
        change = acceleration * dt
        self.velocity = min(max(wanted, self.velocity - change), self.velocity + change)
        self.position = min(max(self.position + self.velocity * dt, p.lower), p.upper)


class Axis:
    """One axis of the robot, stepped once per interpolation period.

    Args:
        parameters: Limits and dynamics.
        filter_lengths: Moving averages after the path, in interpolation periods.
        position: Where it stands at first [u].
        dt: Interpolation period [s].
        substeps: Servo steps in one interpolation period.
    """

    def __init__(
        self, parameters: AxisParameters, filter_lengths: Sequence[int], position: float, dt: float, substeps: int
    ) -> None:
        self.parameters = parameters
        self.position = position
        self.velocity = 0.0
        self._filters = [MovingAverage(length, position) for length in filter_lengths]
        self._limiter = CommandLimiter(parameters, position, dt)
        self._target = position
        self._settled_steps = 0
        self._drain = sum(filter_lengths)
        self._h = dt / substeps
        self._substeps = substeps

    @property
    def command(self) -> float:
        """What the position loop is told [u]."""
        return self._limiter.position

    @property
    def command_velocity(self) -> float:
        """Speed of the command [u/s]."""
        return self._limiter.velocity

    @property
    def measured_position(self) -> float:
        """Position in whole encoder counts [u]."""
        resolution = self.parameters.resolution
        return round(self.position / resolution) * resolution

    @property
    def measured_velocity(self) -> float:
        """Speed in whole counts per servo period, as the drive's observer gives it [u/s]."""
        resolution = self.parameters.resolution / self._h
        return round(self.velocity / resolution) * resolution

    @property
    def resting(self) -> bool:
        """Target, filters, command and motor have come to rest (perhaps apart: the command may be held back)."""
        return self._settled_steps > self._drain and self.velocity == 0.0

    def step(self, target: float, speed: float) -> None:
        """Go on for one interpolation period with the drive on.

        Args:
            target: Position that the path or the stream asks for [u].
            speed: Fraction 0..1 of the greatest speed that the command may use.
        """
        before = self.command
        if target == self._target and self.command_velocity == 0.0:
            self._settled_steps += 1
        else:
            self._settled_steps = 0
        self._target = target
        if self.resting and (speed == 0.0 or before == target):
            return
        for smoothing in self._filters:
            target = smoothing.step(target)
        self._limiter.step(target, speed)
        self._servo(before)

    def brake(self) -> None:
        """Go on for one interpolation period with the drive off: the brake stops the axis where it can."""
        change = self.parameters.estop_deceleration * self._h
        for _ in range(self._substeps):
            self.velocity = math.copysign(max(abs(self.velocity) - change, 0.0), self.velocity)
            self.position += self.velocity * self._h
        self._bound()
        self.rest()

    def rest(self) -> None:
        """Make the place where the axis is its command, and forget what was asked for."""
        held = self.position if self.velocity != 0.0 or abs(self.position - self.command) > 1e-6 else self.command
        for smoothing in self._filters:
            smoothing.reset(held)
        self._limiter.reset(held)
        self._target = held
        self._settled_steps = 0

    def _servo(self, before: float) -> None:
        """Let the motor follow the command, which goes in a straight line from ``before`` to now."""
        p, h, n = self.parameters, self._h, self._substeps
        omega = p.natural_frequency
        stiffness, friction, limit = omega * omega, 2.0 * p.damping * omega, p.servo_acceleration
        increment = (self.command - before) / n
        feed = p.velocity_feedforward * self.command_velocity
        for i in range(1, n + 1):
            acceleration = stiffness * (before + i * increment - self.position) + friction * (feed - self.velocity)
            acceleration = min(max(acceleration, -limit), limit)
            self.velocity = min(max(self.velocity + acceleration * h, -p.velocity), p.velocity)
            self.position += self.velocity * h
        self._bound()
        if (
            self.command_velocity == 0.0
            and abs(self.position - self.command) < _REST_POSITION
            and abs(self.velocity) < _REST_VELOCITY
        ):
            self.position, self.velocity = self.command, 0.0

    def _bound(self) -> None:
        """Stop at the mechanical end of the range."""
        p = self.parameters
        if not p.lower <= self.position <= p.upper:
            self.position = min(max(self.position, p.lower), p.upper)
            self.velocity = 0.0
