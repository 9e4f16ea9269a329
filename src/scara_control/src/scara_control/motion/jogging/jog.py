"""The core of joint_vel_controller.

It moves single joints at given velocities, ramped, never beyond a limit, never for long.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from scara_config import Joint, Robot

from scara_control.config import MotionConfig, in_si
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.limits import check_joint_vector
from scara_control.motion.commands import Command, MotionRefusedError, Ownership, taken_text
from scara_control.motion.drive import went_back
from scara_control.motion.epoch import CancelledError
from scara_control.motion.feedback import Feedback
from scara_control.motion.following.stream import StreamGate
from scara_control.motion.jogging.waiting import JogQueue

WITH_ROBOT = "with the real robot"
"""In the state of a jog that waits."""
TRIM = "trim"
"""Sender of jogs that close a loop by what they see: they do not wait for the real robot."""


def braking_speed(
    joint: Joint, q: float, direction: float, deceleration: float, reaction: float
) -> float:
    r"""Return the speed from which a joint still stops before its limit.

    .. math:: v = -b T + \sqrt{(b T)^2 + 2 b d}

    Args:
        joint: Its limits.
        q: Where it is [rad] or [m].
        direction: Sign of the motion.
        deceleration: b, what braking is counted on.
        reaction: T, for how long it goes on before it brakes [s].
    """
    room = max(joint.upper - q if direction > 0.0 else q - joint.lower, 0.0)
    lost = deceleration * reaction
    return math.sqrt(lost * lost + 2.0 * deceleration * room) - lost


class JogController:
    """Turns jog commands into velocities. Not thread-safe: its owner holds one lock."""

    def __init__(self, robot: Robot, config: MotionConfig, now: float) -> None:
        """Start idle."""
        self._joints = robot.twin_joints
        self._columns = {joint.name: k for k, joint in enumerate(self._joints)}
        self._config = config
        self._gate = StreamGate("commands", config.jog.timeout)
        self._ownership = Ownership("velocity")
        self._feedback = Feedback(self._joints, config)
        self._wanted: dict[str, float] = {}
        self._velocity: dict[str, float] = {}
        self._zeros: dict[str, int] = {}
        self._time = self._deadline = now
        # Whether the newest jog is a trim's.
        self._estopped = self._prompt = False
        self._limit = 100.0
        self._shares = {joint.name: 1.0 for joint in self._joints}
        self._message = ""
        # A jog begins so much later than it was asked for [s]; what is told later waits as long.
        self._follower = self._waits = 0.0
        self._queue = JogQueue(config.period)

    def wait_for(self, delay: float) -> None:
        """Let jogs that begin from now on wait for the real robot, which is so late [s]; 0: none.

        The robot is told at once where the twin is going to be, so both move together.
        """
        self._follower = delay

    def permit(self, shares: Mapping[str, float]) -> None:
        """Ramp from now on with shares of the joints' accelerations, (0, 1]; a payload's doing."""
        self._shares.update({name: v for name, v in shares.items() if name in self._shares})

    def measure(self, measured: JointMotion) -> None:
        """Take in what the joints were measured to do."""
        self._feedback.measured = measured

    def command(
        self,
        names: Sequence[str],
        velocities: Sequence[float],
        displacements: Sequence[float],
        duration: float,
        now: float,
        prompt: bool = False,
    ) -> None:
        """Jog ``names``; all other joints ramp down.

        Args:
            names: Joints.
            velocities: One for each, [rad/s] or [m/s].
            displacements: Must be empty.
            duration: Shortens the time-out, if positive [s].
            now: [s]
            prompt: Do not wait for the real robot: the sender closes a loop by what it sees.

        Raises:
            ScaraControlError: The command is wrong or not allowed now; the text says why.
        """
        begins = self.is_idle
        try:
            if prompt and self._wanted and not self._prompt:
                raise MotionRefusedError("somebody else jogs: a trim gives way")
            self._gate.check(now)
            named = self._check(names, velocities, displacements, duration, now)
        except ValueError as error:
            self.refuse(error, now)
            raise
        if begins:
            self._waits = 0.0 if prompt else self._follower
            self._queue.clear()
        new = [joint for joint in named if joint.name not in self._velocity]
        measured, move = self._feedback.measured, self._config.move
        for joint in new:
            # What moves already is taken over with the velocity that it has.
            qdot = measured.qdot[self._columns[joint.name]] if measured else 0.0
            slow = in_si(joint, move.standstill_deg_s, move.standstill_mm_s)
            self._velocity[joint.name] = qdot if abs(qdot) > slow else 0.0
        if new:
            self._ownership.begin(self._velocity.keys() | {joint.name for joint in named})
        self._prompt = prompt
        # A joint with a velocity of 0 ramps down, like those that are not named.
        self._wanted = {joint.name: float(v) for joint, v in zip(named, velocities) if v}
        self._zeros = {name: self._config.jog.final_zeros for name in self._velocity}
        self._deadline = now + min(
            self._config.jog.timeout, duration if duration > 0.0 else math.inf
        )
        self._message = ""

    def limit_speed(self, percent: float) -> None:
        """Cap the speed of every jog [percent of a joint's largest]: the cap of all other motion.

        Raises:
            MotionRefusedError: Outside 1 to 100.
        """
        if not (math.isfinite(percent) and 1.0 <= percent <= 100.0):
            raise MotionRefusedError(f"speed_limit_percent = {percent:g} is outside [1, 100]")
        self._limit = float(percent)
        self._queue.limit(self._joints, percent)

    def stood_still(self, gap: float) -> None:
        """Note that nobody listened for ``gap`` [s]: that was no pause of a stream of jogs."""
        if not self.is_idle:
            self._gate.forgive(gap)

    def obey(self, command: Command, reason: str, now: float) -> None:
        """Obey STOP, PAUSE, ESTOP, RESET; RESUME starts no jogging again."""
        if command is Command.RESUME:
            return
        if command is Command.RESET:
            self._estopped, self._message = False, ""
            return
        self._estopped = self._estopped or command is Command.ESTOP
        self._gate.bar(now)
        self._halt(command.text(reason))
        self._wait_no_longer()

    def update_modes(self, modes: Mapping[str, str]) -> None:
        """Take in which controller each joint obeys; leave those alone that were taken from us."""
        lost = self._ownership.update(modes)
        for name in lost:
            self._velocity.pop(name, None)
            self._wanted.pop(name, None)
        self._queue.drop(list(lost))
        if lost:
            self._message = taken_text(lost)

    @property
    def is_idle(self) -> bool:
        """Whether nothing is jogged: the time may go on without ticks.

        The first command after that needs a tick before it, so that its ramp begins now.
        """
        return not self._velocity and not self._wanted and not self._queue

    def tick(self, now: float) -> dict[str, float]:
        """Go on to ``now``; return the velocities to publish.

        They are those of moving joints, and a few zeros at the end.
        """
        if went_back(self._time, now):
            # No time-out of before ends anything now, nor does a stop of before bar it.
            self._halt("the clock went back")
            self._wait_no_longer()
            self._gate = StreamGate("commands", self._config.jog.timeout)
            self._feedback.measured = None
        # After a loop was held up the ramp goes on from where it was, and makes no step.
        dt = min(max(now - self._time, 0.0), 2.0 * self._config.period)
        self._time = now
        if self._wanted and now > self._deadline:
            self._halt(f"no command for {self._config.jog.timeout * 1e3:.0f} ms")
        # Without readings nobody knows how near a limit is: what waits is not driven any more.
        if self._wanted and self._feedback.trouble(now):
            self._halt(self._feedback.trouble(now))
            self._wait_no_longer()
        velocities = {
            joint.name: self._next(joint, dt, now)
            for joint in self._joints
            if joint.name in self._velocity
        }
        self._velocity.update(velocities)
        for name, velocity in velocities.items():
            if velocity == 0.0 and name not in self._wanted:
                self._zeros[name] -= 1
                if self._zeros[name] <= 0:
                    del self._velocity[name]
        if not self._waits:
            return velocities
        self._queue.put(now + self._waits, velocities)
        return self._queue.take(now)

    def ahead(self, now: float) -> Setpoints | None:
        """Return where the joints are going to be while a jog waits for the real robot."""
        measured = self._feedback.measured
        if not self._queue or measured is None:
            return None
        return self._queue.setpoints(self._joints, measured.extrapolated(now), now)

    def refuse(self, error: ValueError, now: float) -> None:
        """Tell why a command was refused, here or before it came here."""
        if isinstance(error, CancelledError):
            # Its key may still be held, and the stop barred only what had been heard before.
            self._gate.cancel(now)
        self._message = f"refused: {error}"

    def report(self) -> str:
        """Return what the controller does and why, for people."""
        if self._estopped:
            state = "estopped"
        elif self._wanted:
            state = "jogging"
        else:
            state = "stopping" if any(self._velocity.values()) else "idle"
        parts = [
            f"{name} {v:g} {self._joints[self._columns[name]].si_unit}/s"
            for name, v in self._wanted.items()
        ]
        text = f"{state} {', '.join(parts)}" if parts else state
        if self._wanted and self._waits:
            text += f" ({1e3 * self._waits:.0f} ms later, {WITH_ROBOT})"
        if any(
            abs(v) > self._capped(self._joints[self._columns[n]]) for n, v in self._wanted.items()
        ):
            text += f" (capped at {self._limit:g} % of the largest speed)"
        return f"{text}: {self._message}" if self._message else text

    def _wait_no_longer(self) -> None:
        """Forget what waits for the real robot: a stop begins where the joints are."""
        if self._waits:
            told = self._queue.clear()
            moving = {name for name, velocity in told.items() if velocity}
            self._velocity = {name: told.get(name, 0.0) for name in {*self._velocity, *moving}}
            self._zeros = {name: self._config.jog.final_zeros for name in self._velocity}
            self._waits = 0.0

    def _halt(self, why: str) -> None:
        """Ramp all joints down."""
        if self._velocity or self._estopped:
            self._message = why
        self._wanted = {}

    def _check(
        self,
        names: Sequence[str],
        velocities: Sequence[float],
        displacements: Sequence[float],
        duration: float,
        now: float,
    ) -> list[Joint]:
        """Return the joints of a good command."""
        if self._estopped:
            raise MotionRefusedError("emergency stop is latched: RESET first")
        if displacements:
            raise MotionRefusedError("displacements are not supported: give velocities")
        for name in names:
            if name not in self._columns:
                raise MotionRefusedError(
                    f"unknown joint {name!r}: the twin has {', '.join(self._columns)}"
                )
        if len(set(names)) != len(names) or not names:
            raise MotionRefusedError(f"joint names are missing or occur twice: {', '.join(names)}")
        if not (math.isfinite(duration) and duration >= 0.0):
            raise MotionRefusedError(f"duration = {duration} s is no duration")
        named = [self._joints[self._columns[name]] for name in names]
        for joint, velocity in zip(named, check_joint_vector(named, velocities)):
            fastest = joint.velocity * self._config.jog.speed_percent / 100.0
            if abs(velocity) > fastest:
                raise MotionRefusedError(
                    f"{joint.name} = {velocity:.6g} {joint.si_unit}/s is outside "
                    f"[{-fastest:.4g}, {fastest:.4g}], "
                    f"{self._config.jog.speed_percent:g} % of its speed"
                )
        self._feedback.fresh(now)
        return named

    def _capped(self, joint: Joint) -> float:
        """Return the largest speed that a jog of a joint may have now [rad/s] or [m/s]."""
        return joint.velocity * self._limit / 100.0

    def _next(self, joint: Joint, dt: float, now: float) -> float:
        """Return the velocity of a joint ``dt`` later.

        It goes towards what is wanted, and is able to stop before the limit.
        """
        velocity, wanted = self._velocity[joint.name], self._wanted.get(joint.name, 0.0)
        wanted = math.copysign(min(abs(wanted), self._capped(joint)), wanted)
        # A robot that is told ahead of time should be able to do what it is told.
        ramp = self._config.jog.waiting_ramp_percent if self._waits else 100.0
        acceleration = joint.acceleration * self._shares[joint.name] * ramp / 100.0
        measured = self._feedback.measured
        if wanted and measured is not None:
            q = measured.extrapolated(now)[self._columns[joint.name]]
            # What waits is driven before this velocity, and takes room before the limit.
            q += self._queue.travel(joint.name, now)
            counted_on = acceleration * self._config.jog.braking_percent / 100.0
            fastest = braking_speed(joint, q, wanted, counted_on, self._config.jog.reaction)
            wanted = math.copysign(min(abs(wanted), fastest), wanted)
        change = acceleration * dt
        return min(max(wanted, velocity - change), velocity + change)
