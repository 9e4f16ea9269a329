"""Who may move the twin's joints: every command passes here, and a stop ends what came past others.

The motion nodes ramp their own motion down on STOP, PAUSE and ESTOP. The simulator obeys the same
commands, for whatever reaches it without them: a velocity or a position for a single joint, typed
by hand or sent by a client. After ESTOP nothing moves it until RESET, set points with a time
neither: only while the motion nodes ramp down by them.
"""

from __future__ import annotations

from scara_control.joint_motion import Setpoints
from scara_control.motion.commands import Command

from scara_simulation.commands import CommandError, CommandGate
from scara_simulation.config import SimulationConfig
from scara_simulation.joints.control import JointControl


class CommandDesk:
    """Checks commands, hands them on, obeys stops. Not thread-safe: its owner holds one lock."""

    def __init__(self, control: JointControl, gate: CommandGate, config: SimulationConfig) -> None:
        """Let everything in."""
        self._control, self._gate = control, gate
        self._velocity_timeout = config.velocity_timeout_ms * 1e-3
        self._ramp = config.stop_ramp_ms * 1e-3
        self._paused = False
        self._estopped: float | None = None

    def position(self, name: str, value: float) -> None:
        """Let one joint go to a position [rad] or [m].

        Raises:
            CommandError: It is not possible, or not now; the text says why.
        """
        self._judge_now(name)
        self._control.command_position(name, self._gate.position(name, value))

    def velocity(self, name: str, value: float, now: float) -> None:
        """Let one joint move with a velocity [rad/s] or [m/s], for a while from ``now`` [s] on.

        0 is never refused for a stop.

        Raises:
            CommandError: It is not possible, or not now; the text says why.
        """
        velocity = self._gate.velocity(name, value)
        if velocity != 0.0:
            self._judge_now(name)
        self._control.command_velocity(name, velocity, now + self._velocity_timeout)

    def track(self, setpoints: Setpoints, now: float) -> None:
        """Let joints follow set points with a time.

        Raises:
            CommandError: It is not possible, or not now; the text says why.
        """
        if self._has_ramped(now):
            raise CommandError(LATCHED)
        track = self._gate.track(setpoints, now)
        self._control.command_track(setpoints.names, track)

    def end_tracks(self, now: float) -> None:
        """End set points that would go on behind the ramp of an emergency stop.

        To be called behind each run of steps: they may have been taken long before.
        """
        if self._has_ramped(now):
            self._control.end_tracks(now)

    def limit_speed(self, percent: float) -> None:
        """Cap the speed of direct commands [percent]: the cap of all other motion of the twin.

        Raises:
            CommandError: Outside 1 to 100.
        """
        if not 1.0 <= percent <= 100.0:
            raise CommandError(f"speed_limit_percent = {percent:g} is outside [1, 100]")
        self._control.limit_speed(percent)

    def obey(self, command: Command, now: float) -> None:
        """Obey a motion command at ``now`` [s]; who paused or stopped ends his own motion too."""
        match command:
            case Command.RESUME:
                self._paused = False
                return
            case Command.RESET:
                self._estopped = None
                return
            # The first one counts: repeated, it would let set points in for another ramp.
            case Command.ESTOP if self._estopped is None:
                self._estopped = now
        # All others clear what was paused: from then on a new command counts.
        self._paused = command is Command.PAUSE
        self._control.stop()

    def _has_ramped(self, now: float) -> bool:
        """Return whether an emergency stop is latched, and its ramp over at ``now`` [s]."""
        # The motion nodes bring the twin to rest by set points: they may end their ramp. A clock
        # that is set back gives no second one.
        return self._estopped is not None and not 0.0 <= now - self._estopped <= self._ramp

    def _judge_now(self, name: str) -> None:
        if self._estopped is not None:
            raise CommandError(f"{name}: {LATCHED}")
        if self._paused:
            raise CommandError(f"{name}: the twin is paused: RESUME or STOP first")


LATCHED = "the emergency stop is latched: RESET first"
