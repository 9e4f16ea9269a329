"""Node ``joint_pose_controller``: joint moves and streamed set points for the twin.

Parameters: ``~config_dir`` (robot.yaml, motion.yaml; default: the package scara_config).
Services: ``joint_pose_controller/move`` (scara_msgs/MoveJoints).
Subscribes: ``joint_pose_controller/target`` (JointState), ``joint_pose_controller/follow``
(JointTrajectory), ``joint_pose_controller/speed_limit_percent`` (Float64), ``motion_command``,
``twin/joint_states``, ``twin/controller_modes``, ``twin/payload`` (what motion is planned for),
``twin_controller/state`` (how late the real robot follows, if there is a twin controller),
``joint_vel_controller/command`` (somebody else's jog ends a trim).
Publishes: ``twin/joint_setpoints`` (JointTrajectory), ``joint_pose_controller/state``
(scara_msgs/MotionState), ``what_if/gate`` (scara_msgs/Audit: what the judge said of each move),
``joint_vel_controller/command`` (JointJog: the trim at the end of a move that asks for it).
Calls: ``what_if/judge`` (scara_msgs/JudgeMotion) before each move; a stop never waits for it;
``twin_controller/control`` (for whom it moves the twin).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import rospy
from scara_config import Robot
from scara_ros.pacing import Pace
from scara_ros.process.memory_io import keep_for_good
from scara_ros.process.scheduling_io import go_first
from scara_ros.standstill import said
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String
from trajectory_msgs.msg import JointTrajectory

from control_msgs.msg import JointJog
from scara_control.config import MotionConfig
from scara_control.dynamics.effort import Load
from scara_control.dynamics.payload_listener_node import PayloadListener
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.tool_path import MoveWay, check_way
from scara_control.motion.command_listener_node import CommandListener, Lending, told_movers
from scara_control.motion.commands import Command, CommandInbox, parse_modes
from scara_control.motion.epoch import Epoch
from scara_control.motion.idle_node import Attention, IdleWait
from scara_control.motion.jogging.jog import TRIM
from scara_control.motion.pose_control import PoseController
from scara_control.motion.requests import Outcome
from scara_control.motion.setpoint_messages_node import due_times, to_message, to_setpoints
from scara_control.motion.wiring_node import (
    CallbackGuard,
    JointStateReader,
    MotionClock,
    offer,
    start_node,
    subscribe,
    subscribe_attentively,
)
from scara_control.trajectory.gating_node import move_request, open_gate
from scara_msgs.msg import MotionCommand, MotionState, PayloadState, TwinControllerState
from scara_msgs.srv import MoveJoints, MoveJointsRequest, MoveJointsResponse

_LOG_PERIOD = 1.0
_SHUTDOWN_POLL = 0.2
_JOINT_MOVE = MoveJointsRequest()


class JointPoseController:
    """Converts, asks the core under one lock, converts."""

    def __init__(self, robot: Robot, config: MotionConfig) -> None:
        """Open topics and service."""
        self._clock = MotionClock()
        self._lock = threading.Lock()
        self._joints = robot.twin_joints
        self._core = PoseController(robot, config, self._clock.now())
        self._inbox = CommandInbox(config.command_memory)
        self._epoch = Epoch(time.monotonic())
        self._movers = told_movers()
        self._lending = Lending()
        self._gate = open_gate()
        self._measured: JointMotion | None = None
        self._rest = IdleWait(self._is_idle)
        self._reader = JointStateReader(
            robot.twin_joints, config, self._clock, self._measure, self._is_idle
        )
        self._config = config
        self._waiting: dict[int, Callable[[Outcome], None]] = {}
        # Half a period less: a tick that is a little early would leave it to the next one.
        self._state_pace = Pace(1.0 / config.state_rate_hz - 0.5 * config.period)
        self._setpoints = rospy.Publisher(
            "twin/joint_setpoints", JointTrajectory, queue_size=10, tcp_nodelay=True
        )
        self._state = rospy.Publisher(
            "joint_pose_controller/state", MotionState, queue_size=10, tcp_nodelay=True
        )
        # A trim's jogs are as old as the move, or as whoever let it go on: a stop refuses them.
        self._asked = 0.0
        self._jog = rospy.Publisher(
            "joint_vel_controller/command", JointJog, queue_size=1, tcp_nodelay=True
        )
        guard = CallbackGuard()
        subscribe("twin/joint_states", JointState, self._reader, guard)
        subscribe("twin/controller_modes", String, self._on_modes, guard, queue_size=10)
        self._commands = CommandListener(
            self._on_command, guard, self._epoch, self._lock, self._core.stood_still
        )
        subscribe("joint_vel_controller/command", JointJog, self._on_jog, guard)
        subscribe("joint_pose_controller/follow", JointTrajectory, self._on_follow, guard)
        subscribe("joint_pose_controller/target", JointState, self._on_target, guard, queue_size=10)
        subscribe(
            "joint_pose_controller/speed_limit_percent",
            Float64,
            self._on_speed_limit,
            guard,
            queue_size=10,
        )
        self._payload = PayloadListener(robot, config, self._carry)
        subscribe("twin/payload", PayloadState, self._payload, guard, queue_size=10)
        self._delays = Attention(self._is_idle)
        subscribe_attentively(
            "twin_controller/state", TwinControllerState, self._on_mode, guard, self._delays
        )
        offer("joint_pose_controller/move", MoveJoints, self._on_move)

    def run(self) -> None:
        """Publish set points and state until shut down."""
        self._clock.run(self._config.period, self._tick, self._rest)

    def _is_idle(self) -> bool:
        return self._core.is_idle

    def _rouse(self, now: float) -> None:
        """Be awake before a request is taken in. The lock is held."""
        if self._core.is_idle:
            self._core.tick(now)

    def _go_on(self) -> None:
        """Let the loop see what was begun."""
        if not self._core.is_idle:
            self._rest.wake()
            self._reader.rouse()
            self._delays.rouse()

    def _tick(self, now: float) -> None:
        if not self._core.is_idle:
            self._commands.hear_first()
        with self._lock:
            self._epoch.ran(time.monotonic())
            setpoints = self._core.tick(now)
            if setpoints is not None:
                self._setpoints.publish(to_message(setpoints, self._clock.offset()))
            jog = self._core.take_jog()
            if jog is not None:
                message = JointJog(joint_names=jog.names, velocities=jog.velocities)
                message.header.frame_id = TRIM
                message.header.stamp = self._clock.stamp(self._asked)
                self._jog.publish(message)
            self._settle(now)

    def _measure(self, measured: JointMotion) -> None:
        with self._lock:
            self._core.measure(measured)
            self._measured = measured

    def _on_modes(self, message: String) -> None:
        with self._lock:
            self._core.update_modes(parse_modes(message.data))
            self._settle(self._clock.now())
        self._reader.rouse()  # another controller may move a joint now

    def _on_command(self, message: MotionCommand) -> None:
        try:
            command = Command(message.command)
        except ValueError:
            rospy.logwarn(
                "motion_command: unknown command %d of %r", message.command, message.header.frame_id
            )
            return
        with self._lock:
            now = self._clock.now()
            fresh = self._inbox.accept(message.header.frame_id, message.id, now)
            heard = time.monotonic()
            if fresh and self._epoch.hear(command, message.reason, message.asked, heard):
                self._core.command(command, message.reason, now)
                if command is Command.RESUME:
                    self._asked = message.asked if said(message.asked, heard) else heard
                rospy.loginfo("%s (id %d)", command.text(message.reason), message.id)
                self._movers.stopped(message)
            self._settle(now)
            self._go_on()

    def _on_jog(self, message: JointJog) -> None:
        # Our own jogs are heard back.
        if message.header.frame_id == TRIM:
            return
        with self._lock:
            self._core.jogged()
            self._settle(self._clock.now())

    def _on_follow(self, message: JointTrajectory) -> None:
        self._commands.hear_first()
        with self._lock:
            now, offset = self._clock.now(), self._clock.offset()
            if not message.points:
                # A message without points says that its sender has ended the stream.
                self._core.end_follow(now)
                self._settle(now)
                return
            setpoints = to_setpoints(message, due_times(message, offset))
            try:
                if not self._core.is_following:
                    # What was due before a stop was sent before it.
                    due = self._clock.asked(message.header.stamp)
                    self._epoch.begin(due, time.monotonic(), stream=True)
                self._rouse(now)
                passed = self._core.follow(setpoints, now)
                self._movers.asked("joint_pose_controller/follow", message)
            except ScaraControlError as error:
                rospy.logwarn_throttle(_LOG_PERIOD, f"follow: refused: {error}")
                self._settle(now)
                return
            # What passed whole goes on as it came: it is not built again.
            whole = passed is setpoints
            self._setpoints.publish(message if whole else to_message(passed, offset))
            self._settle(now)
            self._go_on()

    def _on_speed_limit(self, message: Float64) -> None:
        with self._lock:
            try:
                self._core.limit_speed(message.data, self._clock.now())
            except ScaraControlError as error:
                rospy.logwarn("%s", error)
            self._settle(self._clock.now())

    def _carry(self, load: Load | None) -> None:
        with self._lock:
            self._core.carry(load)

    def _on_mode(self, message: TwinControllerState) -> None:
        with self._lock:
            self._core.look_ahead(message.follower_lag, message.setpoints_ahead)

    def _on_target(self, message: JointState) -> None:
        speed = message.velocity[0] if message.velocity else 0.0

        def log(outcome: Outcome) -> None:
            (rospy.loginfo if outcome.success else rospy.logwarn)("target: %s", outcome.message)

        asked = self._clock.asked(message.header.stamp)
        begun = time.monotonic()
        refusal = self._begin(message, message.name, message.position, speed, asked, log)
        with self._lock:
            # Its sender's next target lies in the socket until we return.
            self._epoch.blocked(begun, time.monotonic())
            if not refusal:
                self._movers.asked("joint_pose_controller/target", message)
        if refusal:
            rospy.logwarn("target: refused: %s", refusal)

    def _on_move(self, request: Any) -> MoveJointsResponse:
        ended = threading.Event()
        outcomes: list[Outcome] = []

        def answer(outcome: Outcome) -> None:
            outcomes.append(outcome)
            ended.set()

        self._reader.wait_for_first(self._config.move.settle_timeout)
        refusal = self._begin(
            request,
            request.joint_names,
            request.joint_positions,
            request.speed_percent,
            request.asked,
            answer,
            request,
        )
        if refusal:
            return MoveJointsResponse(False, refusal, (), 0.0)
        with self._lock:
            self._movers.asked("joint_pose_controller/move", request)
        # At a shutdown the loop ends, and nobody sets the event any more.
        while not ended.wait(_SHUTDOWN_POLL):
            if rospy.is_shutdown():
                return MoveJointsResponse(False, "joint_pose_controller is shutting down", (), 0.0)
        outcome = outcomes[0]
        return MoveJointsResponse(
            outcome.success, outcome.message, outcome.positions, outcome.duration
        )

    def _begin(
        self,
        message: Any,
        names: Any,
        positions: Any,
        speed_percent: float,
        asked: float,
        ended: Callable[[Outcome], None],
        how: Any = _JOINT_MOVE,
    ) -> str:
        """Begin a move that was asked for at ``asked``; return why not, or an empty text.

        ``how`` has the fields of a MoveJoints request that say how it goes and ends.
        """
        self._commands.hear_first()
        for listener in (self._reader, self._delays):
            listener.catch_up()
        try:
            way = check_way(self._joints, how.path, how.via, how.speed_mm_s, how.corner_mm)
            with self._lock:
                request = self._epoch.begin(asked, time.monotonic())
        except ScaraControlError as error:
            return str(error)
        # Nothing is locked meanwhile: a stop is obeyed, and ends what is only being judged.
        refusal = self._judged(names, positions, speed_percent, way)
        if refusal:
            return refusal
        # Judge and controller take their time: a stop that came meanwhile is heard right after.
        self._lending.say(message)
        self._commands.hear_first()
        with self._lock:
            now = self._clock.now()
            try:
                self._epoch.check(request)
                self._rouse(now)
                move_id = self._core.move(names, positions, speed_percent, now, how.trims, way)
                self._asked = request.at
            except ScaraControlError as error:
                self._settle(now)
                return str(error)
            self._waiting[move_id] = ended
            self._settle(now)
            self._go_on()
            return ""

    def _judged(self, names: Any, positions: Any, speed_percent: float, way: MoveWay | None) -> str:
        """Ask the gate; return why it refuses, or an empty text."""
        with self._lock:
            measured = self._measured
        if measured is None:
            # The first may come before the move begins, which nobody would have judged then.
            return "no twin/joint_states yet"
        request = move_request(self._core.names, measured, names, positions, speed_percent, way)
        if request is None:
            return ""
        target = ", ".join(f"{value:.4g}" for value in request["joint_positions"])
        found = self._gate.ask(f"move to ({target})", **request)
        return "" if found.allowed else found.text

    def _settle(self, now: float) -> None:
        """Answer the moves that have ended; publish the state if it has changed or is due.

        The lock is held.
        """
        for outcome in self._core.take_outcomes():
            self._waiting.pop(outcome.move_id)(outcome)
        report = self._core.report(now)
        shown = (
            report.state,
            report.move_id,
            report.speed_limit_percent,
            report.standing_still,
            report.message,
            self._inbox.last_id,
        )
        if not self._state_pace.is_due(now, shown):
            return
        state = MotionState(
            state=report.state,
            move_id=report.move_id,
            last_command_id=self._inbox.last_id,
            name=self._core.names,
            setpoint=report.setpoint,
            target=report.target,
            way=[q for corner in report.way for q in corner],
            speed_requested_percent=report.speed_requested_percent,
            peak_percent=report.peak_percent,
            speed_applied_percent=report.speed_applied_percent,
            speed_limit_percent=report.speed_limit_percent,
            standing_still=report.standing_still,
            message=report.message,
        )
        state.header.stamp = rospy.Time.from_sec(now + self._clock.offset())
        self._state.publish(state)


def main() -> None:
    """Run the node until it is told to end."""
    robot, config = start_node("joint_pose_controller")
    controller = JointPoseController(robot, config)
    keep_for_good()
    go_first()
    rospy.loginfo("joint_pose_controller is ready")
    controller.run()
