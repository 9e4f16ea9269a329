"""Servo model of one axis.

It has moving-average filters, a command limiter, a second-order position loop, an encoder.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from itertools import zip_longest

import msgspec

from fanuc_emulator.drives.backlash import Backlash
from fanuc_emulator.drives.interpolator import stopping_speed

_REST_TIME = 0.02
"""Within one encoder count for so long is rest [s]: a motor may creep, or a command round [our]."""
_EXACT_POSITION, _EXACT_VELOCITY = 1e-9, 1e-7
"""A motor that comes so near its command is there."""


class Friction(msgspec.Struct, frozen=True):
    r"""What brakes an axis, as an acceleration; u is rad or m.

    .. math:: f(v) = c + (s - c) e^{-(v / v_s)^2} + b |v|

    Attributes:
        static: s, holds the axis at rest [u/s^2].
        coulomb: c [u/s^2], at most ``static``.
        viscous: b [1/s].
        stribeck: v_s [u/s].

    Source:
        Stribeck curve as in Bittencourt & Gunnarsson, Static friction in a robot joint (2012).
    """

    static: float
    coulomb: float
    viscous: float
    stribeck: float

    def at(self, speed: float) -> float:
        """Return the friction at a speed that is not negative [u/s]."""
        ratio = speed / self.stribeck
        boundary = (self.static - self.coulomb) * math.exp(-ratio * ratio)
        return self.coulomb + boundary + self.viscous * speed


class AxisParameters(msgspec.Struct, frozen=True, kw_only=True):
    """Limits and dynamics of one axis in SI: u is rad or m.

    Attributes:
        held: Friction that the drive's integral part overcomes: it shows in the torque alone.
        backlash: Play between motor and joint [u].
    """

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
    friction: Friction | None = None
    held: Friction | None = None
    backlash: float = 0.0


class MovingAverage:
    """Mean of the last ``length`` values; a step at its input becomes a ramp."""

    def __init__(self, length: int, value: float) -> None:
        self._values = deque([value] * length, maxlen=length)
        self._length = length

    def step(self, value: float) -> float:
        """Take one value and return the mean."""
        self._values.append(value)
        # Summed anew each time: a running sum keeps the rounding errors of all that has passed.
        return sum(self._values) / self._length

    def reset(self, value: float) -> None:
        """Forget the past: as if ``value`` had been there for ever."""
        self._values.extend([value] * self._length)


class Standstill:
    """Judge whether values rest: they stay within a window for a time. No speed is ever nothing.

    Args:
        window: So far from where they were first [u].
        steps: For more looks than these.
    """

    def __init__(self, window: float, steps: int) -> None:
        self._window, self._steps = window, steps
        self._first: tuple[float, ...] = ()
        self._looks = 0

    @property
    def rests(self) -> bool:
        """They have stayed there for so long."""
        return self._looks > self._steps

    def look(self, *values: float) -> None:
        """Take the values of one step, always as many."""
        self._looks += 1
        # The first look compares with infinity, and NaN fails any comparison: both begin anew.
        for first, value in zip_longest(self._first, values, fillvalue=math.inf):
            if not abs(value - first) <= self._window:
                self._first, self._looks = values, 0
                return


class CommandLimiter:
    """Follow a smoothed set point exactly while it keeps the axis' limits.

    When it does not, follow it as near as they allow.

    Whatever comes in, the command stays inside the position range, its speed changes by at most
    ``command_acceleration dt`` a step, and it can always stop before the end of the range.
    """

    def __init__(self, parameters: AxisParameters, position: float, dt: float) -> None:
        self._p = parameters
        self._dt = dt
        self._change = parameters.command_acceleration * dt
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
        p, dt, change = self._p, self._dt, self._change
        acceleration = p.command_acceleration
        position, velocity = self.position, self.velocity
        reference = min(max(reference, p.lower), p.upper)
        behind = self._reference - position
        catch_up = math.copysign(stopping_speed(abs(behind), acceleration, dt), behind)
        # The set point's own speed, and what makes up for what limits have held back so far.
        wanted = (reference - self._reference) / dt + catch_up
        self._reference = reference
        limit = p.velocity * speed
        wanted = min(max(wanted, -limit), limit)
        # Only the end of the range that lies ahead matters.
        if wanted > 0.0:
            wanted = min(wanted, stopping_speed(p.upper - position, acceleration, dt))
        elif wanted < 0.0:
            wanted = max(wanted, -stopping_speed(position - p.lower, acceleration, dt))
        self.velocity = min(max(wanted, velocity - change), velocity + change)
        self.position = min(max(position + self.velocity * dt, p.lower), p.upper)


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
        self,
        parameters: AxisParameters,
        filter_lengths: Sequence[int],
        position: float,
        dt: float,
        substeps: int,
    ) -> None:
        self.parameters = parameters
        self.position = position
        self.velocity = 0.0
        self._filters = [MovingAverage(length, position) for length in filter_lengths]
        self._limiter = CommandLimiter(parameters, position, dt)
        self._target, self._speed = position, 0.0
        # A step with the same target and speed would change nothing.
        self._still = False
        # For so many steps the target has been the same: longer, and the filters know no other.
        self._same_steps = 0
        self._drain = sum(filter_lengths)
        rest = max(self._drain, math.ceil(_REST_TIME / dt))
        self._standstill = Standstill(parameters.resolution, rest)
        # What the drive asks of the motor, as an acceleration.
        self._pushes = 0.0
        held, play = parameters.held, parameters.backlash
        drag = held.coulomb if held else 0.01 * parameters.program_acceleration
        self._gap = Backlash(play, drag, position) if play else None
        self._h = dt / substeps
        self._substeps = range(1, substeps + 1)
        omega = parameters.natural_frequency
        self._stiffness, self._friction = omega * omega, 2.0 * parameters.damping * omega

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
    def torque_percent(self) -> float:
        """Motor torque: 100 is the largest that the drive gives, of either sign."""
        p, pushes = self.parameters, self._pushes
        if p.held is not None and self.velocity:
            pushes += math.copysign(p.held.at(abs(self.velocity)), self.velocity)
        if self._gap is not None:
            pushes = self._gap.pushes(pushes)
        return 100.0 * pushes / p.servo_acceleration

    @property
    def joint_position(self) -> float:
        """Where the joint is, behind the play of its gear [u]."""
        return self.position if self._gap is None else self._gap.load

    @property
    def resting(self) -> bool:
        """Target, filters, command and motor have come to rest.

        Perhaps apart: the command may be held back.
        """
        return self._standstill.rests

    def step(self, target: float, speed: float) -> bool:
        """Go on for one interpolation period with the drive on.

        Args:
            target: Position that the path or the stream asks for [u].
            speed: Fraction 0..1 of the greatest speed that the command may use.

        Returns:
            Whether the axis is still: this step changed nothing, nor will others with the same
            arguments.
        """
        if self._still and target == self._target and speed == self._speed:
            return True
        limiter, command = self._limiter, self._limiter.position
        before = (self.position, self.velocity, command, limiter.velocity)
        same = target == self._target
        self._same_steps = self._same_steps + 1 if same else 0
        self._target, self._speed = target, speed
        # Another speed changes nothing of an axis that is there, or is held.
        self._still = self._still and same and (speed == 0.0 or command == target)
        if self._still:
            return True
        reference = target
        for smoothing in self._filters:
            reference = smoothing.step(reference)
        limiter.step(reference, speed)
        self._servo(command)
        self._standstill.look(self.position, target, limiter.position)
        # The filters have forgotten other targets, and command and motor stay as they were. The
        # command need not be the target: a mean of equal numbers may differ from them in the last
        # bit.
        after = (self.position, self.velocity, limiter.position, limiter.velocity)
        self._still = self.resting and self._same_steps > self._drain and before == after
        return self._still

    def brake(self) -> bool:
        """Go on for one interpolation period with the drive off.

        The brake stops the axis where it can.

        Returns:
            Whether the axis stood already: this step changed nothing.
        """
        before = (self.position, self.velocity, self.joint_position)
        self._pushes = 0.0
        h = self._h
        change = self.parameters.estop_deceleration * h
        for _ in self._substeps:
            velocity = math.copysign(max(abs(self.velocity) - change, 0.0), self.velocity)
            acceleration, self.velocity = (velocity - self.velocity) / h, velocity
            self.position += velocity * h
            if self._gap is not None:
                self._gap.step(self.position, velocity, acceleration, h)
        self._bound()
        # Command and filters go along: nothing may jump when the drives are on again.
        self.rest()
        self._standstill.look(self.position, self._target, self.command)
        return before == (self.position, self.velocity, self.joint_position)

    def rest(self) -> None:
        """Make the place where the axis is its command, and forget what was asked for."""
        held = self.position if abs(self.position - self.command) > 1e-6 else self.command
        for smoothing in self._filters:
            smoothing.reset(held)
        self._limiter.reset(held)
        self._target = held
        self._same_steps = 0
        self._still = False

    def _servo(self, before: float) -> None:
        """Let the motor follow the command.

        The command goes in a straight line from ``before`` to now.
        """
        p, h = self.parameters, self._h
        stiffness, friction = self._stiffness, self._friction
        limit, fastest, rubs = p.servo_acceleration, p.velocity, p.friction
        command, command_velocity = self._limiter.position, self._limiter.velocity
        increment = (command - before) / len(self._substeps)
        feed = p.velocity_feedforward * command_velocity
        position, velocity = self.position, self.velocity
        for i in self._substeps:
            acceleration = stiffness * (before + i * increment - position) + friction * (
                feed - velocity
            )
            # Not by min and max: this is the inmost loop, and calls cost more than comparisons.
            if acceleration > limit:
                acceleration = limit
            elif acceleration < -limit:
                acceleration = -limit
            if rubs is None:
                velocity += acceleration * h
            else:
                velocity = _rubbed(rubs, velocity, acceleration, h)
            if velocity > fastest:
                velocity = fastest
            elif velocity < -fastest:
                velocity = -fastest
            # By the new speed (semi-implicit Euler): the old one would take damping from the loop.
            position += velocity * h
            if self._gap is not None:
                self._gap.step(position, velocity, acceleration, h)
        self.position, self.velocity, self._pushes = position, velocity, acceleration
        self._bound()
        # The motor would come nearer for ever, and the axis would never count as still.
        if (
            abs(command_velocity) < _EXACT_VELOCITY
            and abs(self.position - command) < _EXACT_POSITION
            and abs(self.velocity) < _EXACT_VELOCITY
        ):
            self.position, self.velocity = command, 0.0

    def _bound(self) -> None:
        """Stop at the mechanical end of the range."""
        p = self.parameters
        if not p.lower <= self.position <= p.upper:
            self.position = min(max(self.position, p.lower), p.upper)
            self.velocity = 0.0


def _rubbed(friction: Friction, velocity: float, acceleration: float, h: float) -> float:
    """Return the speed after ``h`` [s]; friction never moves anything, it only ends motion."""
    brake = friction.at(abs(velocity))
    if velocity == 0.0:
        if abs(acceleration) <= brake:
            return 0.0
        return (acceleration - math.copysign(brake, acceleration)) * h
    # Whether the drive breaks loose the other way is decided at rest, in the next step.
    after = velocity + (acceleration - math.copysign(brake, velocity)) * h
    return after if after * velocity > 0.0 else 0.0
