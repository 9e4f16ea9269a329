"""Node ``motion_server``.

Drives the twin's tool to a point, through both joint controllers, until it is there.

Parameters: ``~config_dir`` (robot.yaml, motion.yaml; default: the package scara_config).
Services: ``move_to`` (scara_msgs/MoveTo). Joints that do not move the tool hold. A newer request
replaces a running one once its point has proved reachable, and stops the twin if it is refused
then; STOP and ESTOP cancel.
Calls: ``joint_pose_controller/move``, ``twin_controller/control`` (for whom it moves the twin).
Subscribes: ``twin/joint_states``, ``motion_command``.
Publishes: ``motion_command`` (a STOP that was overtaken by our own move, or of a move that
was not replaced).
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import rospy
from scara_config import ConfigError, Robot
from scara_config.frames import find_frames
from scara_ros.process.memory_io import keep_for_good
from scara_ros.services.service_client_node import ServiceClient, StartedCall
from scara_ros.services.service_connection_io import ServiceError
from scara_ros.shell.ros_node import config_folder, refusing
from sensor_msgs.msg import JointState

from scara_control.config import MotionConfig
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.base_targets import BaseTargets
from scara_control.kinematics.tool import tool_kinematics
from scara_control.kinematics.tool_path import wanted_elbow
from scara_control.motion.command_listener_node import CommandListener, Lending, told_movers
from scara_control.motion.commands import Command, MotionRefusedError
from scara_control.motion.epoch import AskedAt, Epoch
from scara_control.motion.feedback import Feedback
from scara_control.motion.idle_node import QUIET_S
from scara_control.motion.requests import check_speed
from scara_control.motion.trim import Requests, tool_error, yaw_error
from scara_control.motion.wiring_node import (
    CallbackGuard,
    JointStateReader,
    MotionClock,
    offer,
    start_node,
    subscribe,
)
from scara_msgs.msg import MotionCommand
from scara_msgs.srv import MoveJoints, MoveTo, MoveToResponse

_POLL = 0.02
_REPEAT_STOP = 0.05
_NAME = "motion_server"


@dataclass(frozen=True)
class RunningGoal:
    """One request under way."""

    asked: float
    number: int
    replaces: bool
    target: tuple[float, ...]
    speed_percent: float
    request: Any


class MotionServer:
    """Answers ``move_to``; each request runs in rospy's thread of its caller."""

    def __init__(self, robot: Robot, config: MotionConfig) -> None:
        """Open topics and service."""
        self._config = config
        self._tool = tool_kinematics(robot)
        self._places, self._folder = BaseTargets(robot, self._tool), config_folder()
        joints = self._tool.joints
        self._names = [joint.name for joint in joints]
        self._clock = MotionClock()
        self._calls = 0  # requests that are answered now, refused ones too
        self._reader = JointStateReader(
            joints, config, self._clock, self._measure, lambda: self._calls == 0
        )
        self._feedback = Feedback(joints, config)
        self._lock = threading.Condition()
        self._requests = Requests()
        self._epoch = Epoch(time.monotonic())
        self._movers = told_movers()
        self._lending = Lending()
        self._stops = 0
        # A numeric solution loads a library, and the first caller would wait for it.
        home = [robot.home[joint.name] * joint.scale for joint in joints]
        try:
            self._tool.inverse(*self._tool.position(home), None, home)
        except ScaraControlError as error:
            rospy.logwarn("the home pose has no inverse kinematics: %s", error)
        within = config.trim.service_timeout
        self._move = ServiceClient(
            "joint_pose_controller/move", MoveJoints, within, wait=within, lasting=True
        )
        self._command = rospy.Publisher(
            "motion_command", MotionCommand, queue_size=10, tcp_nodelay=True
        )
        guard = CallbackGuard()
        subscribe("twin/joint_states", JointState, self._reader, guard)
        self._stops_heard = CommandListener(self._on_command, guard, self._epoch, self._lock)
        offer("move_to", MoveTo, self._on_move_to)

    def _measure(self, measured: JointMotion) -> None:
        self._feedback.measured = measured

    def run(self) -> None:
        """Notice when this node stood still; the requests run in threads of their own."""
        while not rospy.is_shutdown():
            with self._lock:
                self._epoch.ran(time.monotonic())
            time.sleep(QUIET_S)

    def _on_command(self, message: MotionCommand) -> None:
        with self._lock:
            # Our own STOP is for a move that was overtaken: it must not end a newer one.
            if message.command in list(Command) and message.header.frame_id != _NAME:
                command, now = Command(message.command), time.monotonic()
                self._epoch.hear(command, message.reason, message.asked, now)
                self._movers.stopped(message)
            if (
                message.command in (Command.STOP, Command.ESTOP, Command.YIELD)
                and message.header.frame_id != _NAME
            ):
                self._requests.cancel(
                    f"cancelled by {Command(message.command).text(message.reason)}"
                )

    def _on_move_to(self, request: Any) -> MoveToResponse:
        started = self._clock.now()
        turned = error = float("nan")
        try:
            with self._attentive():
                error, turned = self._move_to(request)
            success, message = True, f"reached, {error * 1e3:.3f} mm from the point"
            if self._tool.turns:
                message += f" and {math.degrees(abs(turned)):.3f} deg from the yaw"
        except (ScaraControlError, ConfigError, ServiceError, rospy.ROSException) as refusal:
            message, success = str(refusal), False
            rospy.logwarn("move_to (%g, %g, %g): %s", request.x, request.y, request.z, message)
        measured = self._feedback.measured
        q = measured.q if measured is not None else ()
        # A point that is still one of a taught frame has no distance from the tool.
        if measured is not None and not (request.frame or request.tool):
            error = tool_error(self._tool, q, (request.x, request.y, request.z))
        return MoveToResponse(success, message, error, q, self._clock.now() - started, turned)

    @contextmanager
    def _attentive(self) -> Iterator[None]:
        """Read all measured joints meanwhile."""
        with self._lock:
            self._calls += 1
        self._reader.catch_up()
        try:
            yield
        finally:
            with self._lock:
                self._calls -= 1

    def _move_to(self, request: Any) -> tuple[float, float]:
        """Do it all; return how far the tool is from its point [m] and its yaw [rad]."""
        self._stops_heard.hear_first()
        with self._lock:
            asked = self._epoch.begin(request.asked, time.monotonic())
            self._movers.asked("move_to", request)
        self._lending.say(request)
        check_speed(request.speed_percent, self._config.move)
        if request.path == "circular":
            raise MotionRefusedError("path = 'circular': move_to knows joint and linear")
        self._reader.wait_for_first(self._config.trim.service_timeout)
        seed = self._feedback.fresh(self._clock.now()).q
        point = (request.x, request.y, request.z)
        elbow = wanted_elbow(self._tool, request.elbow, request.path, seed)
        yaw = request.yaw if request.has_yaw else None
        if request.frame or request.tool:
            table, frames = find_frames(self._folder), (request.frame, request.tool)
            point, yaw = self._places.in_base(table, point, yaw, frames, seed)
            # From here on it is a request in the base.
            request.x, request.y, request.z = point
            request.frame = request.tool = 0
        target = self._tool.inverse(*point, elbow, seed, yaw).chosen.q
        with self._begun(asked) as (number, replaces):
            goal = RunningGoal(asked.at, number, replaces, target, request.speed_percent, request)
            self._drive(goal)
        q = self._feedback.fresh(self._clock.now()).q
        return tool_error(self._tool, q, point), yaw_error(self._tool, q, target)

    @contextmanager
    def _begun(self, asked: AskedAt) -> Iterator[tuple[int, bool]]:
        """Replace the running request, wait until it has let go, and let go in the end.

        Yield the own number, and whether there was one to replace.
        """
        self._stops_heard.hear_first()
        with self._lock:
            self._epoch.check(asked)
            replaces = self._requests.oldest is not None
            number = self._requests.begin()
            if not self._lock.wait_for(
                lambda: self._requests.oldest == number, self._config.trim.timeout
            ):
                self._requests.end(number)
                raise MotionRefusedError("an older request does not end")
        try:
            yield number, replaces
        finally:
            with self._lock:
                self._requests.end(number)
                self._lock.notify_all()

    def _check(self, goal: RunningGoal) -> None:
        """Raise when the request was cancelled."""
        # Until its end: the twin begins to move when it was judged.
        self._lending.say(goal.request, goes_on=True)
        self._stops_heard.hear_first()
        with self._lock:
            why = self._requests.why_cancelled(goal.number)
        if why:
            raise MotionRefusedError(why)
        if rospy.is_shutdown():
            raise MotionRefusedError(f"{_NAME} is shutting down")

    def _drive(self, goal: RunningGoal) -> None:
        """Have joint_pose_controller make the joint move and its trim."""
        self._check(goal)
        call = self._move.start(
            joint_names=self._names,
            joint_positions=goal.target,
            speed_percent=goal.speed_percent,
            asked=goal.asked,
            trims=True,
            path=goal.request.path,
            speed_mm_s=goal.request.speed_mm_s,
        )
        # The call lasts as long as the move, and a stop must not wait for it.
        while not call.ended.wait(_POLL):
            try:
                self._check(goal)
            except MotionRefusedError as cancelled:
                self._let_go(call, str(cancelled))
                raise
        # A stop that came at the last moment counts, whatever the answer says.
        answer = call.result()
        self._check(goal)
        if not answer.success:
            # Only what has begun answers with positions. A move that is refused ends no older one,
            # whose caller was told by us that it is replaced: nobody would wait for its end.
            if goal.replaces and not answer.joint_positions:
                self._tell_stop(
                    "a move_to that was to replace this one was refused", time.monotonic()
                )
            raise MotionRefusedError(answer.message)

    def _let_go(self, call: StartedCall, why: str) -> None:
        """After a STOP make sure that our move has ended.

        It may reach the controller after the STOP did.
        """
        if not why.startswith("cancelled by"):
            return
        deadline = self._clock.now() + self._config.trim.service_timeout
        # What is asked for from now on is not meant.
        cancelled = time.monotonic()
        while not call.ended.wait(_REPEAT_STOP) and self._clock.now() < deadline:
            self._tell_stop(why, cancelled)

    def _tell_stop(self, why: str, asked: float) -> None:
        """Stop the twin."""
        self._stops += 1
        stop = MotionCommand(command=MotionCommand.STOP, id=self._stops, reason=why, asked=asked)
        stop.header.frame_id = _NAME
        stop.header.stamp = rospy.Time.now()
        self._command.publish(stop)


def main() -> None:
    """Run the node until it is told to end."""
    robot, config = start_node(_NAME)
    with refusing(ScaraControlError):
        server = MotionServer(robot, config)
    keep_for_good()
    rospy.loginfo("%s is ready", _NAME)
    server.run()
