"""Node ``trajectory_server``.

It offers the action ``joint_trajectory_action`` (control_msgs/FollowJointTrajectory) for the twin.

Parameters: ``~config_dir`` (robot.yaml, motion.yaml; default: the package scara_config).
Action: ``joint_trajectory_action``; a plain actionlib client is enough. A goal is rejected with a
reason, or accepted and streamed to ``joint_pose_controller/follow``; a newer goal replaces a
running one, which ramps down on its path first.
Subscribes: ``twin/joint_states``, ``joint_pose_controller/state``, ``motion_command``,
``twin/payload``, ``twin_controller/state`` (if there is a twin controller). Publishes:
``joint_pose_controller/follow`` (JointTrajectory), ``what_if/gate`` (scara_msgs/Audit: what the
judge said of each goal). Calls: ``what_if/judge`` (scara_msgs/JudgeMotion) before each goal,
``twin_controller/control`` (for whom it moves the twin).
"""

from __future__ import annotations

import threading
import time
from typing import Any

import actionlib
import rospy
from scara_config import Robot
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryFeedback,
    FollowJointTrajectoryResult,
)
from scara_control.config import MotionConfig
from scara_control.dynamics.effort import Load
from scara_control.dynamics.payload_listener_node import PayloadListener
from scara_control.joint_motion import JointMotion
from scara_control.motion.command_listener_node import CommandListener, Lending
from scara_control.motion.commands import Command, CommandInbox, MotionRefusedError
from scara_control.motion.epoch import AskedAt, Epoch
from scara_control.motion.idle_node import QUIET_S, Attention, IdleWait
from scara_control.motion.setpoint_messages_node import to_message, to_motion, to_point
from scara_control.motion.wiring_node import (
    CallbackGuard,
    JointStateReader,
    MotionClock,
    start_node,
    subscribe,
    subscribe_attentively,
)
from scara_control.trajectory.execution import Ended, Execution, TrajectoryFeedback
from scara_control.trajectory.gating_node import Turnstile, open_gate, trajectory_request
from scara_control.trajectory.goal import Code, Goal, GoalError
from scara_control.trajectory.goal_queue import GoalQueue, Waiting
from scara_msgs.msg import MotionCommand, MotionState, PayloadState, TwinControllerState

_NAME = "trajectory_server"
_ACTION = "joint_trajectory_action"


class TrajectoryServer:
    """Converts, asks the core under one lock, converts."""

    def __init__(self, robot: Robot, config: MotionConfig) -> None:
        """Open topics and action."""
        self._clock, self._lock, self._config = MotionClock(), threading.Lock(), config
        self._desk = GoalQueue(robot.twin_joints, config)
        self._inbox = CommandInbox(config.command_memory)
        self._epoch = Epoch(time.monotonic())
        self._lending = Lending()
        self._goals: dict[str, Any] = {}
        self._judged: dict[str, Any] = {}
        self._gate, self._judging = open_gate(), Turnstile()
        self._feedback_due = self._clock.now()
        self._follow = rospy.Publisher(
            "joint_pose_controller/follow", JointTrajectory, queue_size=10, tcp_nodelay=True
        )
        guard = CallbackGuard()
        self._rest = IdleWait(self._is_idle)
        self._reader = JointStateReader(
            robot.twin_joints, config, self._clock, self._on_measurement, self._is_idle
        )
        subscribe("twin/joint_states", JointState, self._reader, guard)
        self._states = Attention(self._is_idle)
        self._modes = Attention(self._is_idle)
        subscribe_attentively(
            "joint_pose_controller/state", MotionState, self._on_motion_state, guard, self._states
        )
        self._commands = CommandListener(self._on_command, guard, self._epoch, self._lock)
        subscribe_attentively(
            "twin_controller/state", TwinControllerState, self._on_mode, guard, self._modes
        )
        self._payload = PayloadListener(robot, config, self._carry)
        subscribe("twin/payload", PayloadState, self._payload, guard, queue_size=10)
        goal, cancel = guard(self._on_goal), guard(self._on_cancel)
        # Not started by itself: a goal that came in the constructor would find no server.
        self._server = actionlib.ActionServer(
            _ACTION, FollowJointTrajectoryAction, goal, cancel, auto_start=False
        )
        self._server.start()

    def run(self) -> None:
        """Stream until shut down."""
        self._clock.run(self._config.period, self._tick, self._rest, QUIET_S)

    def _is_idle(self) -> bool:
        return self._desk.is_idle

    def _carry(self, load: Load | None) -> None:
        with self._lock:
            self._desk.carry(load)

    def _tick(self, now: float) -> None:
        if not self._desk.is_idle:
            self._commands.hear_first()
        with self._lock:
            self._epoch.ran(time.monotonic())
            turn = self._desk.tick(now)
            found = self._desk.feedback() if now >= self._feedback_due else None
            told = [(self._goals.pop(str(key)), ended) for key, ended in turn.ended]
            rejected = [(self._goals.pop(str(key)), error) for key, error in turn.rejected]
            heard = self._goals.get(str(found[0])) if found is not None else None
        if turn.packet is not None:
            self._follow.publish(to_message(turn.packet, self._clock.offset()))
        if turn.end_stream:
            self._follow.publish(
                JointTrajectory(header=rospy.Header(stamp=rospy.Time.now(), frame_id=_NAME))
            )
        # actionlib holds its own lock while it calls us, so it is only called without ours
        for handle, ended in told:
            _finish(handle, ended)
        for handle, error in rejected:
            _reject(handle, error)
        if turn.due is not None:
            self._begin_waiting(turn.due)
        if heard is not None and found is not None:
            self._feedback_due = now + 1.0 / self._config.trajectory.feedback_rate_hz
            heard.publish_feedback(_feedback(found[1]))

    def _on_goal(self, handle: Any) -> None:
        goal = to_goal(handle.get_goal(), self._clock.offset())
        key = handle.get_goal_id().id
        # The header's stamp is the sender's. That of the id may be actionlib's own, of now.
        said = self._clock.asked(handle.goal.header.stamp)
        self._commands.hear_first()
        with self._lock:
            try:
                asked = self._epoch.begin(said, time.monotonic())
            except MotionRefusedError as error:
                _reject(handle, GoalError(Code.INVALID_GOAL, str(error)))
                return
            self._judged[key] = handle
        # actionlib holds its lock while it calls us: a cancellation must not wait for the judge.
        self._judging.put(lambda: self._accept(key, handle, goal, asked))

    def _accept(self, key: str, handle: Any, goal: Goal, asked: AskedAt) -> None:
        """Let a goal in once it is judged, or tell its client why not."""
        try:
            begun = self._begin(key, handle, goal, asked)
        except GoalError as error:
            _reject(handle, error)
        except MotionRefusedError as error:
            _reject(handle, GoalError(Code.INVALID_GOAL, str(error)))
        except Exception as error:
            # Its client would wait for ever. Who called us logs where it failed.
            with self._lock:
                self._judged.pop(key, None)
            _reject(handle, GoalError(Code.INVALID_GOAL, f"{_NAME} failed: {error!r}"))
            raise
        else:
            self._rest.wake()
            if begun:
                handle.set_accepted()

    def _begin(self, key: str, handle: Any, goal: Goal, asked: AskedAt) -> bool:
        """Judge a goal and return whether it begins at once; else it waits, or was cancelled.

        Raises:
            GoalError: It cannot be followed now, or the judge refuses it.
            MotionRefusedError: A stop came meanwhile.
        """
        found = self._gate.ask(
            f"trajectory of {len(goal.points)} points", **trajectory_request(goal)
        )
        own = self._lending.say(handle.goal)
        refused = GoalError(Code.INVALID_GOAL, found.text)
        checked = self._checked(goal, own) if found.allowed else refused
        with self._lock:
            if self._judged.pop(key, None) is None:
                return False
            self._epoch.check(asked)
            begun = self._desk.accept(key, checked, self._clock.now(), own)
            self._goals[key] = handle
            return begun

    def _begin_waiting(self, waiting: Waiting) -> None:
        """Begin a goal that has waited; one that a stop or its client ends meanwhile is told so."""
        checked = self._checked(waiting.goal, waiting.own)
        with self._lock:
            begun = self._desk.begin(waiting, checked, self._clock.now())
            handle = self._goals.get(str(waiting.key))
        if begun and handle is not None:
            handle.set_accepted()

    def _checked(self, goal: Goal, own: bool) -> Execution | GoalError:
        """Check a goal without the lock: a stream goes on meanwhile, and a stop is obeyed."""
        self._catch_up()
        try:
            with self._lock:
                draft = self._desk.draft(goal, self._clock.now(), own)
            return draft()
        except GoalError as error:
            return error
        finally:
            self._catch_up()

    def _catch_up(self) -> None:
        """Read what has come by now: where the joints are, what others do, and each stop."""
        for listener in (self._reader, self._states, self._modes):
            listener.catch_up()
        self._commands.hear_first()

    def _on_cancel(self, handle: Any) -> None:
        key = handle.get_goal_id().id
        with self._lock:
            waiting = self._judged.pop(key, None) is not None
            if not waiting:
                waiting = self._desk.cancel(key) and self._goals.pop(key, None) is not None
        if waiting:
            _finish(handle, Ended(Code.SUCCESSFUL, "cancelled before it began", cancelled=True))

    def _on_measurement(self, measured: JointMotion) -> None:
        with self._lock:
            self._desk.measure(measured)

    def _on_motion_state(self, message: MotionState) -> None:
        with self._lock:
            self._desk.hear_motion(
                message.state, message.message, message.speed_limit_percent, self._clock.now()
            )

    def _on_mode(self, message: TwinControllerState) -> None:
        held = message.holder and not message.holder_moves
        others_only = message.not_in_control if held else ""
        why = message.alarm or message.why
        with self._lock:
            self._desk.look_ahead(message.follower_lag, message.setpoints_ahead)
            self._desk.hear_mode(message.mode, why, self._clock.now(), others_only)

    def _on_command(self, message: MotionCommand) -> None:
        with self._lock:
            # Of an unknown one joint_pose_controller warns.
            if message.command in list(Command) and self._inbox.accept(
                message.header.frame_id, message.id, self._clock.now()
            ):
                command = Command(message.command)
                if self._epoch.hear(command, message.reason, message.asked, time.monotonic()):
                    self._desk.command(command, message.reason)
        self._rest.wake()  # a goal that waited is told at once that it never begins


def to_goal(message: Any, offset: float) -> Goal:
    """Convert a FollowJointTrajectoryGoal; ``offset`` is ROS time minus the axis of times [s].

    Nothing is checked here.
    """
    trajectory = message.trajectory
    stamp = trajectory.header.stamp
    return Goal(
        names=tuple(trajectory.joint_names),
        points=tuple(
            to_motion(point, point.time_from_start.to_sec()) for point in trajectory.points
        ),
        start=None if stamp.is_zero() else stamp.to_sec() - offset,
        path_tolerance=tuple(
            (tolerance.name, tolerance.position) for tolerance in message.path_tolerance
        ),
        goal_tolerance=tuple(
            (tolerance.name, tolerance.position) for tolerance in message.goal_tolerance
        ),
        goal_time_tolerance=message.goal_time_tolerance.to_sec(),
    )


def _reject(handle: Any, error: GoalError) -> None:
    """Tell a client why its goal is not accepted."""
    rospy.logwarn("goal rejected: %s", error)
    handle.set_rejected(
        FollowJointTrajectoryResult(error_code=int(error.code), error_string=str(error)), str(error)
    )


def _finish(handle: Any, ended: Ended) -> None:
    """Tell a client how its goal has ended."""
    result = FollowJointTrajectoryResult(error_code=int(ended.code), error_string=ended.text)
    if ended.cancelled:
        handle.set_canceled(result, ended.text)
    elif ended.code is Code.SUCCESSFUL:
        handle.set_succeeded(result, ended.text)
    else:
        rospy.logwarn("goal aborted: %s", ended.text)
        handle.set_aborted(result, ended.text)


def _feedback(found: TrajectoryFeedback) -> FollowJointTrajectoryFeedback:
    """Build the message."""
    elapsed = rospy.Duration.from_sec(found.elapsed)
    desired, actual, error = (
        to_point(motion, elapsed) for motion in (found.desired, found.actual, found.error)
    )
    message = FollowJointTrajectoryFeedback(
        joint_names=found.names, desired=desired, actual=actual, error=error
    )
    message.header.stamp = rospy.Time.now()
    return message


def main() -> None:
    """Run the node until it is told to end."""
    robot, config = start_node(_NAME)
    server = TrajectoryServer(robot, config)
    rospy.loginfo("%s is ready", _NAME)
    server.run()
