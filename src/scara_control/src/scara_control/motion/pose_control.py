"""The core of joint_pose_controller.

It does moves, streamed set points, STOP PAUSE RESUME ESTOP RESET YIELD. One clock: every ``now`` is
on the same axis [s]. Set points lie on a grid of that axis, one per period.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from scara_config import Robot

from scara_control.config import MotionConfig
from scara_control.dynamics.effort import Load
from scara_control.dynamics.planner import Planner
from scara_control.joint_motion import JointMotion, Setpoints, Vector
from scara_control.kinematics.tool import tool_kinematics
from scara_control.kinematics.tool_path import MoveWay
from scara_control.motion.commands import (
    Command,
    MotionRefusedError,
    Ownership,
    Phase,
    State,
    taken_text,
)
from scara_control.motion.drive import PathDriver, believed, went_back
from scara_control.motion.feedback import Feedback
from scara_control.motion.following.stream import SetpointStream
from scara_control.motion.requests import (
    Jog,
    MoveLedger,
    MoveRequest,
    Outcome,
    PoseReport,
    check_move,
)
from scara_control.motion.time_scaling import SpeedCap

_LATCHED = "emergency stop is latched: RESET first"


class PoseController:
    """Turns requests into set points. Not thread-safe: its owner holds one lock."""

    def __init__(self, robot: Robot, config: MotionConfig, now: float) -> None:
        """Start idle, without a set point of its own."""
        self._joints = robot.twin_joints
        self.names = tuple(joint.name for joint in self._joints)
        self._config = config
        self._ownership = Ownership("trajectory")
        self._driver = PathDriver(self._joints, config, now)
        self._planner = Planner(self._joints, tool_kinematics(robot))
        self._feedback = Feedback(self._joints, config)
        self._setpoint: Vector | None = None
        self._stream = SetpointStream(self._joints, config.follow)
        self._ledger = MoveLedger(robot, config)
        self._commanded = self.names
        # Before this time who takes a joint from us does so by what is late [s].
        self._ours_from = now
        self._phase = Phase.GOING
        # Latched until RESET, and until RESUME or a stop; whatever moves meanwhile.
        self._estopped = self._paused = False
        self._requested, self._cap = config.move.default_speed_percent, SpeedCap()
        self._peak, self._message = 0.0, ""

    def measure(self, measured: JointMotion) -> None:
        """Take in what the joints were measured to do."""
        self._feedback.measured = measured

    def move(
        self,
        names: Sequence[str],
        positions: Sequence[float],
        speed_percent: float,
        now: float,
        trims: bool = False,
        way: MoveWay | None = None,
    ) -> int:
        """Begin a joint move; return its id, with which its outcome will come.

        Args:
            names: Joints to move, the others hold; empty: all.
            positions: [rad] or [m].
            speed_percent: 1 to 100; 0: the default.
            now: [s]
            trims: Its end is the tool's, not the joints': see :meth:`take_jog`.
            way: How it goes there; None: straight to the joints' targets.

        Raises:
            ScaraControlError: The move is not possible, or not now; the text says why.
        """
        try:
            move = self._config.move
            request = check_move(self._joints, names, positions, speed_percent, move, way)
            return self._move(request, now, trims)
        except ValueError as error:
            self._message = f"refused: {error}"
            raise

    def follow(self, packet: Setpoints, now: float) -> Setpoints:
        """Judge a streamed packet; return what is to be forwarded at once.

        Raises:
            ScaraControlError: The packet is refused; this is counted and reported.
        """
        try:
            begins = self._stream.take(packet, self._feedback, self._other_command(), now)
        except MotionRefusedError as error:
            # What comes late of a stream that was stopped does not hide why it was.
            if not (self._estopped or self._phase is Phase.STOPPING or self._stream.barred):
                self._message = f"follow: refused {self._stream.refused}: {error}"
            raise
        if begins:
            # The last jogs of a trim may be late.
            late = self._config.move.announce if self._ledger.trimming else 0.0
            self._end_move("aborted: replaced by a stream")
            self._ledger.begin(now, is_move=False)
            self._begin(packet.names, now + late)
        return packet.select(self._commanded) if self._commanded != packet.names else packet

    def end_follow(self, now: float) -> None:
        """End the stream by its source: what still moves stops, and a move is possible at once."""
        if self._stream.session is not None:
            self._driver.advance(now, self._wanted_scale)
            self._stop("follow: ended by its source")

    def jogged(self) -> None:
        """Note that somebody else jogs the joints: a trim gives way."""
        if self._ledger.trimming:
            self._stop("aborted: replaced by a jog")

    def stood_still(self, gap: float) -> None:
        """Note that nobody listened for ``gap`` [s]: that was no pause of a stream."""
        if not self.is_idle:
            self._stream.forgive(gap)

    def command(self, command: Command, reason: str, now: float) -> None:
        """Obey a command."""
        if command is Command.STOP or command is Command.ESTOP:
            if self._driver.is_spent(now):
                # The joints have had no set points for a while and stand: a ramp would move them.
                self._driver.drive, self._phase = None, Phase.GOING
            # From where the last tick was, the ramp would pull back what has gone on since.
            self._driver.advance(now, self._wanted_scale)
            self._estopped = self._estopped or command is Command.ESTOP
            self._paused = False
            self._stream.bar(now)
            self._stop(f"aborted by {command.text(reason)}")
            if self._driver.drive is None and self._feedback.stop(now):
                # A jog, or a joint that is commanded past us: whoever listens hears of the stop.
                self._phase = Phase.STOPPING
        elif command is Command.YIELD:
            self._paused = False
            if self._stream.session is None:
                self._stop(f"aborted by {command.text(reason)}")
        elif command is Command.RESET:
            self._estopped, self._message = False, ""
        elif command is Command.PAUSE:
            # Of a stream its source decides; once that has ended, no move begins before RESUME.
            self._paused = True
            if self._stream.session is not None:
                self._message = "PAUSE: following a stream, which decides; pause its source"
        else:
            self._paused = False
            if self._phase is Phase.PARKED:
                self._phase = Phase.GOING

    def limit_speed(self, percent: float, now: float) -> None:
        """Cap the program speed of this and all coming moves.

        A move that runs slows down where the follower has not been sent yet. One that replaced a
        running one goes no faster than the cap of then, even if the cap is raised later.

        Raises:
            MotionRefusedError: Outside 1 to 100.
        """
        if not 1.0 <= percent <= 100.0:
            self._message = f"speed_limit_percent = {percent:g} is outside [1, 100]"
            raise MotionRefusedError(self._message)
        follower, due = self._driver.follower, now + self._driver.follower.delay
        # What it was given ahead of its time is slower: a controller that stands still meanwhile
        # cannot take it back. A lower cap never waits for that.
        later = follower.ahead if percent > self._cap.newest else 0.0
        self._cap.set(float(percent), due + later)

    def carry(self, load: Load | None) -> None:
        """Plan from now on for what hangs at the tool; None: nothing."""
        self._planner.load = load

    def look_ahead(self, delay: float, ahead: float = 0.0) -> None:
        """Announce set points for a follower; see :class:`scara_control.motion.drive.Follower`."""
        self._driver.follower = believed(delay, ahead)

    def update_modes(self, modes: Mapping[str, str]) -> None:
        """Take in which controller each joint obeys.

        A joint taken from us ends the motion of all, but not right at its beginning: what takes the
        joint is late then, as the last jog of a trim before, and our next set points take it back.
        """
        lost = self._ownership.update(modes)
        if self._ledger.trimming:  # its jogs may take our joints, and nobody else
            lost = {name: mode for name, mode in modes.items() if mode == "position"}
        elif self._driver.drive is None and self._stream.session is None:
            return
        if not lost or self._driver.time < self._ours_from:
            return
        self._commanded = tuple(name for name in self._commanded if name not in lost)
        self._stop(f"aborted: {taken_text(lost)}")

    @property
    def is_following(self) -> bool:
        """Whether a stream of set points has begun and not ended."""
        return self._stream.session is not None

    @property
    def is_idle(self) -> bool:
        """Whether nothing moves and nothing is waited for: the time may go on without ticks.

        The first request after that needs a tick before it, so that its motion begins now.
        """
        still = self._driver.drive is None and self._phase is not Phase.STOPPING
        return still and not (self.is_following or self._ledger.running)

    def tick(self, now: float) -> Setpoints | None:
        """Go on to ``now``; return the set points to publish, if anything moves."""
        if went_back(self._driver.time, now):
            # The clock went back, as when the simulation is reset: all motion is forgotten.
            self._end_move("aborted: the clock went back")
            self._driver.drive = self._stream.session = None
            self._setpoint = self._feedback.measured = None
            self._phase, self._driver.time, self._cap = Phase.GOING, now, SpeedCap(self._cap.newest)
        elif self._driver.is_past(now):
            return None
        self._driver.advance(now, self._wanted_scale)
        self._cap.forget(self._driver.time)
        self._watch(now)
        return self._setpoints()

    def report(self, now: float) -> PoseReport:
        """Return what the controller does."""
        drive = self._driver.drive if self._phase is not Phase.STOPPING else None
        motion = self._motion(now)
        return PoseReport(
            state=self._state(),
            move_id=self._ledger.move_id,
            setpoint=motion.q if motion is not None else self._setpoint or (),
            target=drive.path.end if drive is not None else (),
            way=drive.path.corners if drive is not None else (),
            speed_requested_percent=self._requested,
            peak_percent=self._peak,
            speed_applied_percent=self._requested * drive.base.scale if drive is not None else 0.0,
            speed_limit_percent=self._cap.newest,
            standing_still=self._standing_still(now),
            message=self._message,
        )

    def take_jog(self) -> Jog | None:
        """Return the velocities that a trim wants joint_vel_controller to jog with, if any."""
        return self._ledger.take_jog()

    def take_outcomes(self) -> list[Outcome]:
        """Return how moves have ended since the last call."""
        return self._ledger.take_outcomes()

    def _move(self, request: MoveRequest, now: float, trims: bool) -> int:
        """Begin a joint move; see :meth:`move`."""
        if self._estopped:
            raise MotionRefusedError(_LATCHED)
        if self._stream.session is not None:
            raise MotionRefusedError(
                "following a stream: it ends by STOP, or when no packet comes any more"
            )
        if self._paused:
            raise MotionRefusedError("paused: RESUME or STOP first")
        start, go_at = self._start(now)
        hold, speed = self._planner.stop(start).end, request.speed_percent
        moves = any(start.qdot) or any(start.qddot)
        if moves:
            # Its scale begins at 1: planned beyond the cap, it would be too fast until that falls.
            speed = min(speed, self._cap.newest)
        target = request.target(self._joints, hold)
        path = self._planner.move(start, target, speed, request.way)
        self._end_move(f"aborted: replaced by move {self._ledger.move_id + 1}")
        self._ledger.begin(now, is_move=True, trims_at=target if trims else ())
        self._begin(self.names, go_at)
        self._requested, self._peak = speed, path.peak_percent(self._joints)
        self._driver.start(path, go_at, 1.0 if moves else self._wanted_scale(go_at))
        return self._ledger.move_id

    def _state(self) -> State:
        """Return the state's name."""
        if self._estopped:
            return State.ESTOPPED
        if self._stream.session is not None:
            return State.FOLLOWING
        if self._phase is Phase.STOPPING:
            return State.STOPPING
        if self._driver.drive is None:
            still = State.MOVING if self._ledger.running else State.IDLE
            return State.PAUSED if self._paused else still
        if self._paused:
            return State.PAUSED if self._driver.drive.frozen else State.PAUSING
        return State.ANNOUNCING if self._driver.drive.announcing else State.MOVING

    def _standing_still(self, now: float) -> bool:
        """Say whether the set point rests, no motion is announced and nothing is trimmed."""
        if self._stream.session is not None:
            speeds = zip(self._stream.session.motion(now).qdot, self._feedback.standstill)
            return all(abs(v) <= slow for v, slow in speeds)
        drive = self._driver.drive
        if drive is None:
            return self._paused or not self._ledger.running
        return self._paused and drive.frozen

    def _begin(self, names: tuple[str, ...], ours_from: float) -> None:
        """Begin a move or a stream of ``names``, which nobody takes from us after a time [s]."""
        self._ownership.begin(names)
        self._ours_from = ours_from
        self._commanded, self._message = names, ""
        self._phase = Phase.GOING

    def _start(self, now: float) -> tuple[JointMotion, float]:
        """Return the state from which a move begins, and when it may move: at once if it moves."""
        go_at, drive = self._driver.announced(now), self._driver.drive
        if drive is None:
            trims = self._ledger.trimming
            rest = self._feedback.rest(self._setpoint, self._ownership, now, trims)
            return JointMotion.at_rest(rest), go_at
        self._feedback.fresh(now)
        if self._commanded != self.names:
            raise MotionRefusedError("still stopping after a joint was taken")
        return drive.motion, go_at if drive.announcing else self._driver.time

    def _other_command(self) -> str:
        """Say what has command of the joints, so that a stream has not."""
        if self._estopped or self._driver.drive is None:
            return _LATCHED if self._estopped else ""
        if self._phase is Phase.STOPPING:
            return "still stopping"
        return "a move is running: STOP it first"

    def _wanted_scale(self, at: float) -> float:
        """Return how fast the path shall be driven at a time [s]."""
        if self._phase is Phase.STOPPING:
            return 1.0
        return 0.0 if self._paused else min(1.0, self._cap.at(at) / self._requested)

    def _watch(self, now: float) -> None:
        """Stop when stream or measurements fail to come; see whether the joints have arrived."""
        if self._driver.drive is None and not self._feedback.coasts(now):
            self._phase = Phase.GOING
        if silence := self._stream.silence(now):
            self._stop(silence)
        if trouble := self._feedback.trouble(now) if self._ledger.running else "":
            self._stop(f"aborted: {trouble}")
        elif self._ledger.settling:
            arrived = self._ledger.arrive(self._feedback.fresh(now), now, self._paused)
            self._message = arrived or self._message

    def _stop(self, text: str) -> None:
        """Ramp down whatever moves; ``text`` says why."""
        motion, followed = self._motion(self._driver.time), self._stream.session is not None
        self._end_move(text)
        self._message = text
        already = self._phase is Phase.STOPPING and not followed
        self._stream.session = None
        if motion is None or not self._commanded:
            self._driver.drive, self._phase = None, Phase.GOING
        elif not already:
            self._driver.start(self._planner.stop(motion, followed), self._driver.time, 1.0)
            self._phase = Phase.STOPPING

    def _motion(self, now: float) -> JointMotion | None:
        """Return what the set point does; None: none is sent."""
        if self._stream.session is not None:
            return self._stream.session.motion(now)
        return self._driver.drive.motion if self._driver.drive is not None else None

    def _end_move(self, why: str) -> None:
        """End the running move, if there is one, before it has arrived."""
        self._ledger.end(False, why, self._feedback.measured, self._driver.time)

    def _setpoints(self) -> Setpoints | None:
        """Return the set points from now to the horizon; one last packet at rest, then none."""
        drive = self._driver.drive
        if drive is None:
            return None
        ahead = [drive]
        if drive.done:
            self._ledger.settle(drive.path.end, self._driver.time)
            self._setpoint, self._driver.drive, self._phase = drive.path.end, None, Phase.GOING
        elif self._paused and drive.frozen:
            if self._phase is Phase.PARKED:
                return None
            self._phase = Phase.PARKED
        else:
            ahead = self._driver.ahead(drive, self._wanted_scale)
        packet = Setpoints.due(self.names, (d.time for d in ahead), (d.motion for d in ahead))
        return packet if self._commanded == self.names else packet.select(self._commanded)
