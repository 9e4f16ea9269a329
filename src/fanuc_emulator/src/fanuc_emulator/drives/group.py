"""The motion group: all axes of the robot, with what they are doing together."""

from __future__ import annotations

from collections.abc import Sequence

from scara_config import Robot
from scara_config.programs.steps import MoveStep, PathStep

from fanuc_emulator.drives.axis import Axis
from fanuc_emulator.drives.interpolator import Trapezoid
from fanuc_emulator.drives.planner import Limits, Planner
from fanuc_emulator.plant.config import Plant, axes_of
from fanuc_emulator.plant.interpreter import StreamInterpreter, interpreter_of


class MotionGroup:
    """Drive the axes along a planned move, after a stream of set points, or hold them.

    Args:
        axes: In the order of robot.yaml.
        dt: Servo period [s].
        every: Servo periods in an interpolation period; the drives go straight between two points.
        interpreter: Carries out the stream; None: each set point counts at once.
        planner: Plans moves.
        phase: So many servo periods of the first interpolation period are over.

    Attributes:
        positions: True joint positions [rad or m], shape ``(n,)``.
        velocities: True joint speeds [rad/s or m/s].
        measured_positions: In whole encoder counts.
        measured_velocities: In whole counts per servo period.
        torques: Of the motors [percent].
        slow: Moves that begin now, and a stream, are kept to the speed of T1; no corner is rounded.
    """

    def __init__(
        self,
        axes: Sequence[Axis],
        dt: float,
        every: int,
        interpreter: StreamInterpreter | None,
        planner: Planner,
        phase: int = 0,
    ) -> None:
        self.axes = tuple(axes)
        self.powered, self.slow = True, False
        self._dt, self._every, self._interpreter = dt, every, interpreter
        self._planner = planner
        self._targets: tuple[float, ...] = tuple(axis.command for axis in axes)
        self._move: Trapezoid | None = None
        # Moves that the newest began before the end of: they go on to their own ends.
        self._rounded: tuple[Trapezoid, ...] = ()
        self._stream_speed: float | None = None
        # PR[1] as the stream program sees it; None while it is not valid.
        self._wanted: tuple[float, ...] | None = None
        # How many servo periods of the interpolation period are over, and where it began.
        self._phase = phase
        self._from = self._targets
        # What the axes were told while all of them are still; None: one of them moves.
        self._still_at: tuple[tuple[float, ...], float] | None = None
        self._look()

    @property
    def commands(self) -> tuple[float, ...]:
        """Where the drives hold the axes, or bring them now [rad or m]."""
        return tuple([axis.command for axis in self.axes])

    @property
    def targets(self) -> tuple[float, ...]:
        """Where what is planned or streamed wants the axes now [rad or m]."""
        return self._targets

    @property
    def standing(self) -> bool:
        """No axis moves and none is about to, unless it is let go on."""
        for axis in self.axes:
            if not axis.resting:
                return False
        plans = self._rounded if self._move is None else (self._move, *self._rounded)
        # A plan is not measured: its rate is exactly 0 where it is held or has ended.
        return not any([plan.rate for plan in plans])

    @property
    def path_done(self) -> bool:
        """No planned move is unfinished (filters and motors may still come after)."""
        return self._move is None or (self._move.done and not self._phase and not self._rounded)

    def nears_end(self, share: float) -> bool:
        """Return whether so much of the planned move's deceleration is left, 0..1, or less."""
        if self._move is None or self.slow:
            # Two moves at once would be as fast as both together.
            return self.path_done
        return not self._phase and self._move.nears_end(share)

    @property
    def arrived(self) -> bool:
        """FINE: the planned move is done, each motor is at its end within the tolerance."""
        if not self.path_done:
            return False
        for axis, target in zip(self.axes, self._targets):
            tolerance = axis.parameters.tolerance
            if not (
                abs(axis.position - target) <= tolerance
                and abs(axis.velocity) * self._dt <= tolerance
                and abs(axis.command - target) <= tolerance
            ):
                return False
        return True

    def at(self, positions: Sequence[float]) -> bool:
        """Return whether each axis is there within its tolerance [rad or m]."""
        for axis, q, there in zip(self.axes, self.positions, positions):
            if not abs(q - there) <= axis.parameters.tolerance:
                return False
        return True

    def start(self, step: MoveStep | PathStep) -> None:
        """Go on by the move of a program's line, which begins where the last one ends.

        That one may not have ended yet.

        Raises:
            RefusedError: The tool cannot go there, or not on this way.
        """
        # Before anything is changed: a refused move leaves what is under way as it is.
        move = self._planner.plan(step, self.planned_end)
        if self.slow:
            self._planner.slow_down(move, step)
        self._end_stream()
        if self._move is not None and not self._move.done:
            self._rounded += (self._move,)
        self._move = move

    @property
    def planned_end(self) -> tuple[float, ...]:
        """Where what is planned ends [rad or m]."""
        return self._targets if self._move is None else self._move.end

    def stream(self, target: Sequence[float] | None, speed: float) -> None:
        """Follow set points.

        ``target`` is the latest one (None: stay), ``speed`` the fraction of the greatest speed.
        """
        self._move, self._rounded = None, ()
        # A stream that begins knows nothing of what an earlier one had planned.
        if self._stream_speed is None and self._interpreter is not None:
            self._interpreter.reset(self._targets)
        self._stream_speed = speed
        self._wanted = tuple(target) if target is not None else None

    def clear(self) -> None:
        """Give up what was planned and stay where the axes stand; for use at standstill."""
        for axis in self.axes:
            axis.rest()
        self._still_at = None
        self._targets = self._from = tuple(axis.command for axis in self.axes)
        self._phase = 0
        self._move, self._rounded = None, ()
        self._end_stream()

    def power_off(self) -> None:
        """Cut the drives: each axis brakes by itself, what was planned is gone."""
        self.powered = False
        self._move, self._rounded = None, ()
        self._end_stream()

    def power_on(self) -> None:
        """Hold the axes where they stand."""
        self.powered = True
        self.clear()

    def step(self, override: float, hold: bool) -> None:
        """Go on for one servo period.

        Args:
            override: Fraction 0..1 of every programmed speed.
            hold: Decelerate (a planned move: along its path) and stay.
        """
        # Lists: each axis has to go on, whatever the one before it says.
        if not self.powered:
            self._still_at = None
            if not all([axis.brake() for axis in self.axes]):
                self._look()
            return
        factor = 0.0 if hold else override
        # A planned move keeps its speed by itself; a set point may jump, so the axes' limiters keep
        # it.
        limit = 1.0 if self._stream_speed is None else factor * self._stream_speed
        if self._phase == 0:
            self._from = self._targets
            self._interpolate(factor)
        self._phase = (self._phase + 1) % self._every
        told = self._targets
        if self._phase:
            # What the drives are told now: a point between the last two.
            part = self._phase / self._every
            told = tuple([a + part * (b - a) for a, b in zip(self._from, self._targets)])
        if self._still_at == (told, limit):
            return
        if all([axis.step(at, limit) for axis, at in zip(self.axes, told)]):
            self._still_at = told, limit
        else:
            self._still_at = None
            self._look()

    def _interpolate(self, factor: float) -> None:
        """Find where the axes should be at the end of this interpolation period."""
        if self._move is not None:
            self._targets = self._move.advance(factor, self._dt * self._every)
            if self._rounded:
                self._add_rounded(factor)
        elif self._stream_speed is None:
            return
        elif self._interpreter is not None:
            self._targets = self._interpreter.step(self._wanted, factor * self._stream_speed)
        elif self._wanted is not None:
            self._targets = self._wanted
        if self.slow and self._move is None:
            period = self._dt * self._every
            self._targets = self._planner.toward(self._from, self._targets, factor, period)

    def _add_rounded(self, factor: float) -> None:
        """Add what the earlier moves still have to go: that rounds the corner."""
        for move in self._rounded:
            rest = move.advance(factor, self._dt * self._every)
            parts = zip(self._targets, rest, move.end)
            self._targets = tuple([target + here - end for target, here, end in parts])
        self._rounded = tuple([move for move in self._rounded if not move.done])

    def _end_stream(self) -> None:
        self._stream_speed = self._wanted = None

    def _look(self) -> None:
        """Note where the axes are: several ask for it in each period, and it seldom changes."""
        axes = self.axes
        self.positions = tuple([axis.joint_position for axis in axes])
        self.velocities = tuple([axis.velocity for axis in axes])
        self.measured_positions = tuple([axis.measured_position for axis in axes])
        self.measured_velocities = tuple([axis.measured_velocity for axis in axes])
        self.torques = tuple([axis.torque_percent for axis in axes])


def motion_of(plant: Plant, robot: Robot, home: Sequence[float]) -> tuple[MotionGroup, Planner]:
    """Return the axes of a plant at ``home`` [rad or m], and what plans their moves."""
    axes = axes_of(plant, robot.joints, home)
    of_axes = [axis.parameters for axis in axes]
    planner = Planner(robot, [Limits(p.velocity, p.program_acceleration) for p in of_axes])
    motion = MotionGroup(
        axes,
        plant.dt,
        plant.interpolation_period_ms // plant.servo_period_ms,
        interpreter_of(plant, robot.joints),
        planner,
        plant.interpolation_phase_ms // plant.servo_period_ms,
    )
    return motion, planner
