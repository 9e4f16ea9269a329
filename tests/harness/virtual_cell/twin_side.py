"""The twin's side in virtual time: simulator, pose and jog controller, move_to, and their reports.

All its nodes run on one machine and one clock; a node's time is the simulation's nominal axis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.kinematics.tool_path import MoveWay, check_way
from scara_control.motion.commands import Command, parse_modes
from scara_control.motion.jogging.jog import JogController
from scara_control.motion.pose_control import PoseController
from scara_control.motion.requests import Outcome
from scara_control.trajectory.execution import Ended as Finished
from scara_control.trajectory.execution import Execution
from scara_control.trajectory.goal import Goal, GoalError
from scara_control.trajectory.goal_queue import GoalQueue
from scara_simulation.command_desk import CommandDesk
from scara_simulation.commands import CommandError, CommandGate
from scara_simulation.simulation import Snapshot
from scara_simulation.world_io import World
from twin_controller.core.actions import Command as CoreCommand
from twin_controller.core.actions import FollowTwin, MoveTwin, SendTwin
from twin_controller.core.events import AnyEvent, ClockProbe, TwinMeasured, TwinMotion
from twin_controller.twin.fields import PacketError
from twin_controller.twin.held_joints import HeldJoints
from twin_controller.twin.packets import plan_of

from harness.virtual_cell.files import CellFiles
from harness.virtual_cell.move_to import Ended, MoveTo
from harness.virtual_cell.schedule import SECOND, Schedule, SideClock, Wire
from harness.virtual_cell.simulator import build_simulation

FIRST_PROBES_S = 0.02
Row = tuple[float, ...]


class TwinSide:
    """Everything behind the gateway: packets come in, inputs of the core go out."""

    def __init__(
        self,
        schedule: Schedule,
        files: CellFiles,
        world: World,
        clock: SideClock,
        topic: Wire,
        report: Wire,
        controller_clock: Callable[[], float],
        put: Callable[[AnyEvent], None],
    ) -> None:
        """Stand at the home pose.

        Args:
            schedule: Virtual time.
            files: The cell.
            world: The physics.
            clock: The twin's ROS clock.
            topic: The way from one node to another.
            report: The way to the controller.
            controller_clock: Its monotonic clock.
            put: Takes what arrives there.
        """
        self._schedule, self._files, self._clock = schedule, files, clock
        self._topic, self._report = topic, report
        self._controller_clock, self._put = controller_clock, put
        self.simulation = build_simulation(world, files, round(clock.offset * SECOND))
        robot, motion, self._offset = files.robot, files.motion, clock.offset
        gate = CommandGate(robot, files.simulation)
        self._desk = CommandDesk(self.simulation.control, gate, files.simulation)
        self._pose = PoseController(robot, motion, 0.0)
        self._jogs = JogController(robot, motion, 0.0)
        self.move_to = MoveTo(robot, self._begin_move)
        self._trajectories = GoalQueue(robot.twin_joints, motion)
        self._held = HeldJoints(robot.twin_joints)
        self._waiting: dict[int, Callable[[Outcome], None]] = {}
        self._modes, self._last_id = "", 0
        self._shown: tuple[object, ...] = ()
        self._state_due = self._plan_due = self._joints_due = 0.0
        self._probes = 0
        self.refused: list[str] = []
        self.ended: list[Finished] = []
        self.truth: list[tuple[float, Row, Row]] = []
        schedule.every(clock.period(files.simulation.dt), self._step, clock.period(1e-3))
        schedule.every(clock.period(motion.period), self._tick_pose, 0.0131)
        schedule.every(clock.period(motion.period), self._tick_jog, 0.0167)
        schedule.every(clock.period(motion.period), self._tick_trajectory, 0.0149)
        schedule.after(0.003, self._probe)
        self._tell_modes()

    @property
    def moves(self) -> str:
        """What commands the joints, in words; empty: nothing does."""
        found = []
        if not self._pose.is_idle:
            found.append(f"the pose controller is {self._pose.report(self._now()).state}")
        if not self._jogs.is_idle:
            found.append(f"the jog controller is {self._jogs.report()}")
        return ", ".join(found)

    @property
    def trims(self) -> bool:
        """Whether the end of a move is trimmed."""
        return self._pose._ledger.trimming

    def follow(self, action: FollowTwin) -> None:
        """Take one set point from the controller."""
        times = tuple(action.stamp - self._offset + point.time for point in action.points)
        self._stream(Setpoints.due(self._pose.names, times, action.points))

    def accept(self, goal: Goal) -> None:
        """Take a trajectory, as trajectory_server does; how it ends comes into ``ended``."""
        self._trajectories.accept("goal", self._checked(goal), self._now())

    def _checked(self, goal: Goal) -> Execution | GoalError:
        try:
            return self._trajectories.draft(goal, self._now())()
        except GoalError as error:
            return error

    def _tick_trajectory(self) -> None:
        turn = self._trajectories.tick(self._now())
        self.ended += [ended for _, ended in turn.ended]
        if turn.packet is not None:
            self._stream(turn.packet)
        if turn.end_stream:
            self.lose_stream()
        if turn.due is not None:
            self._trajectories.begin(turn.due, self._checked(turn.due.goal), self._now())

    def _stream(self, setpoints: Setpoints) -> None:
        """Take a packet of streamed set points."""
        try:
            passed = self._pose.follow(setpoints, self._now())
        except ScaraControlError as error:
            self.refused.append(str(error))
        else:
            self._publish(passed)
        self._settle()

    def perform(self, action: SendTwin) -> None:
        """Obey the end of following or one motion command."""
        if action.command is CoreCommand.RELEASE_TWIN:
            self.lose_stream()
        else:
            command = Command[action.command.name.removesuffix("_TWIN")]
            self.told(command, action.id, action.reason)

    def told(
        self, command: Command, number: int | None = None, reason: str = "another program"
    ) -> None:
        """Obey a motion command, the controller's or that of another program of the twin's side.

        Args:
            command: Which.
            number: Its id, as the pose controller reports it; None: that of the one before.
            reason: Why it is given.
        """
        self._last_id = self._last_id if number is None else number
        self._pose.command(command, reason, self._now())
        self._jogs.obey(command, reason, self._now())
        self._topic.send(partial(self._obey, command))
        self._settle()

    def lose_stream(self) -> None:
        """End the stream of set points as its time-out does, when none comes any more."""
        self._pose.end_follow(self._now())
        self._settle()

    def cap(self, speed_percent: float) -> None:
        """Cap the program speed."""
        self._pose.limit_speed(speed_percent, self._now())
        self._jogs.limit_speed(speed_percent)
        self._topic.send(partial(self._desk.limit_speed, speed_percent))
        self._settle()

    def hear_state(self, follower_delay: float, ahead: float, mode: str, why: str) -> None:
        """Take in the controller's state: how late the real robot follows [s], mode and reason."""
        self._topic.send(partial(self._pose.look_ahead, follower_delay, ahead))
        if self._files.motion.jog.waits_for_robot:
            wait = follower_delay + self._files.motion.move.announce
            self._topic.send(partial(self._jogs.wait_for, wait))
        self._topic.send(partial(self._trajectories.look_ahead, follower_delay, ahead))
        self._topic.send(lambda: self._trajectories.hear_mode(mode, why, self._now()))

    def move(self, action: MoveTwin, ended: Ended) -> None:
        """Start a move; ``ended`` is told how it ended."""
        if action.command == "MOVE":
            way = action.yaw, action.path, action.speed_mm_s
            self.move_to.begin(action.target, action.speed_percent, action.elbow, ended, *way)
        else:
            self._begin_move(
                action.target,
                action.speed_percent,
                lambda outcome: ended(outcome.success, outcome.message),
                self._pose.names,
                way=check_way(
                    self._files.robot.twin_joints,
                    action.path,
                    action.via,
                    action.speed_mm_s,
                    action.corner_mm,
                ),
            )

    def _now(self) -> float:
        """Return the time of the twin's nodes [s]."""
        return self._clock.elapsed()

    def _step(self) -> None:
        for snapshot in self.simulation.advance(1):
            self._show(snapshot)
        self._desk.end_tracks(self.simulation.now)

    def _show(self, snapshot: Snapshot) -> None:
        """Publish the joint states: to the twin's nodes, and less often to the controller."""
        q, qdot = tuple(snapshot.positions), tuple(snapshot.velocities)
        self.truth.append((self._schedule.now, q, qdot))
        measured = JointMotion.measured(q, qdot, self.simulation.axis_time(snapshot.stamp_ns))
        self._topic.send(partial(self._measure, measured))
        period = self._files.controller.twin.state_period_ms * 1e-3
        if self._now() >= self._joints_due - 1e-4:
            self._joints_due = self._now() + period
            stamp = snapshot.stamp_ns / SECOND
            true = JointMotion.measured(q, qdot, stamp)
            self._tell(lambda now: self._heard(TwinMeasured(now, true)))

    def _heard(self, event: TwinMeasured) -> TwinMeasured:
        """Remember at the controller's link what joints hold."""
        self._held.measure(event.motion)
        return event

    def _measure(self, measured: JointMotion) -> None:
        self._pose.measure(measured)
        self._trajectories.measure(measured)
        self._jogs.measure(measured)
        self.move_to.measured = measured

    def _tick_pose(self) -> None:
        setpoints = self._pose.tick(self._now())
        if setpoints is not None:
            self._publish(setpoints)
        trim = self._pose.take_jog()
        if trim is not None:
            self.jog(trim.names, trim.velocities, prompt=True)
        self._settle()

    def _tick_jog(self) -> None:
        for name, velocity in self._jogs.tick(self._now()).items():
            self._topic.send(partial(self.command_velocity, name, velocity))
        ahead = self._jogs.ahead(self._now())
        if ahead is not None:
            self._tell_plan(ahead, jog=True)

    def command_velocity(self, name: str, velocity: float) -> None:
        """Command one joint's velocity loop directly, past all motion nodes [rad/s or m/s]."""
        self._command(partial(self._desk.velocity, name, velocity, self.simulation.now))

    def command_position(self, name: str, position: float) -> None:
        """Command one joint's position loop directly, past all motion nodes [rad or m]."""
        self._command(partial(self._desk.position, name, position))

    def _obey(self, command: Command) -> None:
        self._desk.obey(command, self.simulation.now)
        self._tell_modes()

    def jog(self, names: Sequence[str], velocities: Sequence[float], prompt: bool = False) -> None:
        """Send one jog to its controller; it ends by its time-out [rad/s or m/s].

        One of somebody else, not ``prompt``, ends a trim.
        """

        def arrive() -> None:
            try:
                self._jogs.command(names, velocities, (), 0.0, self._now(), prompt)
            except ScaraControlError as error:
                self.refused.append(f"jog: {error}")
            if not prompt:
                self._pose.jogged()

        self._topic.send(arrive)

    def _publish(self, setpoints: Setpoints) -> None:
        """Send set points to the simulator, and less often to the controller."""
        self._topic.send(partial(self._track, setpoints))
        if self._now() < self._plan_due - 1e-4:
            return
        self._plan_due = self._now() + self._files.controller.twin.plan_period_ms * 1e-3
        self._tell_plan(setpoints)

    def _tell_plan(self, setpoints: Setpoints, jog: bool = False) -> None:
        begin = setpoints.times[0]
        times = (at - begin for at in setpoints.times)
        counted = Setpoints.due(setpoints.names, times, setpoints.points)
        stamp = self._offset + begin
        self._report.send(lambda: self._take_plan(counted, stamp, jog))

    def _take_plan(self, setpoints: Setpoints, stamp: float, jog: bool) -> None:
        """Complete coming set points at the controller's link, which drops what it refuses."""
        now = self._controller_clock()
        try:
            plan = plan_of(self._held.complete(setpoints, now), stamp, now, jog)
        except PacketError:
            return
        self._put(plan)

    def _track(self, setpoints: Setpoints) -> None:
        self._command(partial(self._desk.track, setpoints, self.simulation.now))

    def _command(self, command: Callable[[], None]) -> None:
        """Command the simulator; it may refuse, and its modes may have changed."""
        try:
            command()
        except CommandError as error:
            self.refused.append(str(error))
        self._tell_modes()

    def _tell_modes(self) -> None:
        modes = self.simulation.control.modes
        if modes != self._modes:
            self._modes = modes
            self._topic.send(partial(self._take_modes, modes))

    def _take_modes(self, modes: str) -> None:
        self._pose.update_modes(parse_modes(modes))
        self._jogs.update_modes(parse_modes(modes))
        self._settle()

    def _begin_move(
        self,
        target: Sequence[float],
        speed_percent: float,
        ended: Callable[[Outcome], None],
        names: Sequence[str],
        trims: bool = False,
        way: MoveWay | None = None,
    ) -> None:
        """Begin a move; a refusal is an outcome too."""
        try:
            number = self._pose.move(names, target, speed_percent, self._now(), trims, way)
        except ScaraControlError as error:
            ended(Outcome(0, False, str(error), (), 0.0))
        else:
            self._waiting[number] = ended
        self._settle()

    def _settle(self) -> None:
        """Answer the moves that have ended; report the state when it has changed or is due."""
        now, config = self._now(), self._files.motion
        for outcome in self._pose.take_outcomes():
            self._waiting.pop(outcome.move_id)(outcome)
        report = self._pose.report(now)
        shown = (
            report.state,
            report.move_id,
            report.speed_limit_percent,
            report.standing_still,
            report.message,
            self._last_id,
        )
        if shown == self._shown and now < self._state_due:
            return
        self._shown = shown
        self._trajectories.hear_motion(
            report.state, report.message, report.speed_limit_percent, now
        )
        self._state_due = now + 1.0 / config.state_rate_hz - 0.5 * config.period
        number = self._last_id
        self._tell(
            lambda at: TwinMotion(
                at,
                report.state,
                report.speed_requested_percent,
                report.speed_applied_percent,
                report.speed_limit_percent,
                number,
                report.standing_still,
                report.message,
                tuple(report.target),
                report.peak_percent,
                report.way,
            )
        )

    def _probe(self) -> None:
        """Let the controller ask for the time: quickly at first, then at the configured period."""
        config = self._files.controller.twin
        sent = self._controller_clock()

        def asked() -> None:
            remote = self._clock.now()
            self._tell(lambda now: ClockProbe(now, sent, now, remote))

        self._schedule.after(self._report.delay, asked)
        self._probes += 1
        quick = self._probes < 4 * config.probes
        self._schedule.after(
            FIRST_PROBES_S if quick else config.probe_period_ms * 1e-3, self._probe
        )

    def _tell(self, event: Callable[[float], AnyEvent]) -> None:
        """Send an input of the core, stamped when it arrives."""
        self._report.send(lambda: self._put(event(self._controller_clock())))
