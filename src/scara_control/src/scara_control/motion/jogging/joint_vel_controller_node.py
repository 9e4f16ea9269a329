"""Node ``joint_vel_controller``: jogs single joints of the twin at given velocities.

Parameters: ``~config_dir`` (robot.yaml, motion.yaml; default: the package scara_config).
Subscribes: ``joint_vel_controller/command`` (control_msgs/JointJog),
``joint_pose_controller/speed_limit_percent`` (the cap of all motion), ``motion_command``,
``twin/joint_states``, ``twin/controller_modes``, ``twin/payload`` (the accelerations it leaves);
``twin_controller/state``, if jogs wait for the real robot (motion.yaml).
Publishes: ``twin/<joint>_velocity_controller/command`` (Float64), ``joint_vel_controller/state``
(String, latched), ``joint_vel_controller/ahead`` (trajectory_msgs/JointTrajectory) while a jog
waits for the real robot. Calls: ``twin_controller/control`` (for whom it moves the twin).
"""

from __future__ import annotations

import threading
import time

import rospy
from scara_config import Robot
from scara_ros.process.memory_io import keep_for_good
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String
from trajectory_msgs.msg import JointTrajectory

from control_msgs.msg import JointJog
from scara_control.config import MotionConfig
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion
from scara_control.motion.command_listener_node import CommandListener, Lending, told_movers
from scara_control.motion.commands import Command, CommandInbox, parse_modes
from scara_control.motion.epoch import Epoch
from scara_control.motion.idle_node import QUIET_S, IdleWait
from scara_control.motion.jogging.jog import TRIM, JogController
from scara_control.motion.setpoint_messages_node import to_message
from scara_control.motion.wiring_node import (
    CallbackGuard,
    JointStateReader,
    MotionClock,
    start_node,
    subscribe,
)
from scara_msgs.msg import MotionCommand, PayloadState, TwinControllerState

_LOG_PERIOD = 1.0
FOLLOWED = (
    TwinControllerState.IDLE,
    TwinControllerState.TWIN_LEADS,
    TwinControllerState.OPERATOR_LEADS,
)
"""Modes in which the real robot follows a jog."""


class JointVelController:
    """Converts, asks the core under one lock, converts."""

    def __init__(self, robot: Robot, config: MotionConfig) -> None:
        """Open the topics."""
        names = [joint.name for joint in robot.twin_joints]
        self._clock = MotionClock()
        self._period = config.period
        self._lock = threading.Lock()
        self._core = JogController(robot, config, self._clock.now())
        self._inbox = CommandInbox(config.command_memory)
        self._epoch = Epoch(time.monotonic())
        self._movers = told_movers()
        self._lending = Lending()
        self._rest = IdleWait(self._is_idle)
        self._reader = JointStateReader(
            robot.twin_joints, config, self._clock, self._measure, self._is_idle
        )
        self._shown = ""
        self._state = rospy.Publisher(
            "joint_vel_controller/state", String, queue_size=10, latch=True, tcp_nodelay=True
        )
        self._commands = {
            name: rospy.Publisher(
                f"twin/{name}_velocity_controller/command", Float64, queue_size=1, tcp_nodelay=True
            )
            for name in names
        }
        self._ahead = rospy.Publisher(
            "joint_vel_controller/ahead", JointTrajectory, queue_size=10, tcp_nodelay=True
        )
        guard = CallbackGuard()
        self._announce = config.move.announce
        if config.jog.waits_for_robot:
            subscribe("twin_controller/state", TwinControllerState, self._on_mode, guard)
        subscribe("twin/joint_states", JointState, self._reader, guard)
        subscribe("twin/controller_modes", String, self._on_modes, guard, queue_size=10)
        self._stops = CommandListener(
            self._on_command, guard, self._epoch, self._lock, self._core.stood_still
        )
        subscribe("joint_vel_controller/command", JointJog, self._on_jog, guard)
        subscribe("twin/payload", PayloadState, self._on_payload, guard, queue_size=10)
        subscribe(
            "joint_pose_controller/speed_limit_percent",
            Float64,
            self._on_speed_limit,
            guard,
            queue_size=10,
        )

    def run(self) -> None:
        """Publish velocities until shut down."""
        self._clock.run(self._period, self._tick, self._rest, QUIET_S)

    def _is_idle(self) -> bool:
        return self._core.is_idle

    def _tick(self, now: float) -> None:
        if not self._core.is_idle:
            self._stops.hear_first()
        with self._lock:
            self._epoch.ran(time.monotonic())
            for name, velocity in self._core.tick(now).items():
                self._commands[name].publish(velocity)
            ahead = self._core.ahead(now)
            if ahead is not None:
                self._ahead.publish(to_message(ahead, self._clock.offset()))
            self._show()

    def _measure(self, measured: JointMotion) -> None:
        with self._lock:
            self._core.measure(measured)

    def _on_modes(self, message: String) -> None:
        with self._lock:
            self._core.update_modes(parse_modes(message.data))
        self._reader.rouse()  # another controller may move a joint now

    def _on_command(self, message: MotionCommand) -> None:
        with self._lock:
            now = self._clock.now()
            if message.command in list(Command) and self._inbox.accept(
                message.header.frame_id, message.id, now
            ):
                command = Command(message.command)
                if self._epoch.hear(command, message.reason, message.asked, time.monotonic()):
                    self._core.obey(command, message.reason, now)
                    self._movers.stopped(message)
            self._show()

    def _on_jog(self, message: JointJog) -> None:
        try:
            self._take_jog(message)
        except ScaraControlError as error:
            with self._lock:
                self._core.refuse(error, self._clock.now())
                self._show()
            rospy.logwarn_throttle(_LOG_PERIOD, f"jog: refused: {error}")

    def _take_jog(self, message: JointJog) -> None:
        """Jog, unless a stop is heard before the jog begins."""
        self._stops.hear_first()
        with self._lock:
            asked = self._clock.asked(message.header.stamp)
            request = self._epoch.begin(asked, time.monotonic())
        # The answer takes a while: a stop that comes meanwhile is heard right after.
        self._lending.say(message, goes_on=not self._core.is_idle)
        self._stops.hear_first()
        if self._core.is_idle:
            # A reading of a node at rest may be HOLD_S old.
            self._reader.catch_up()
        with self._lock:
            self._epoch.check(request)
            now = self._clock.now()
            if self._core.is_idle:
                self._core.tick(now)  # the loop rests: the ramp begins now
            self._core.command(
                message.joint_names,
                message.velocities,
                message.displacements,
                message.duration,
                now,
                prompt=message.header.frame_id == TRIM,
            )
            self._movers.asked("joint_vel_controller/command", message)
            self._rest.wake()
            self._reader.rouse()
            self._show()

    def _on_mode(self, message: TwinControllerState) -> None:
        follows = message.mode in FOLLOWED
        with self._lock:
            # As a move does: it is announced for so long before it begins.
            self._core.wait_for(message.follower_lag + self._announce if follows else 0.0)

    def _on_payload(self, message: PayloadState) -> None:
        percents = zip(message.name, message.acceleration_percent)
        with self._lock:
            self._core.permit({name: percent / 100.0 for name, percent in percents})

    def _on_speed_limit(self, message: Float64) -> None:
        with self._lock:
            try:
                self._core.limit_speed(message.data)
            except ScaraControlError as error:
                rospy.logwarn("%s", error)
            self._show()

    def _show(self) -> None:
        """Publish the state if it has changed. The lock is held."""
        text = self._core.report()
        if text != self._shown:
            self._shown = text
            self._state.publish(text)


def main() -> None:
    """Run the node until it is told to end."""
    robot, config = start_node("joint_vel_controller")
    controller = JointVelController(robot, config)
    # Only when all is built: what comes later is for the garbage collector.
    keep_for_good()
    rospy.loginfo("joint_vel_controller is ready")
    controller.run()
