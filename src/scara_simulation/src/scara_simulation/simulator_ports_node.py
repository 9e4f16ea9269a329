"""Topics and services of the simulator: messages to core calls and back."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial

import rospy
from rosgraph_msgs.msg import Clock
from scara_control.motion.command_listener_node import CommandListener, told_movers
from scara_control.motion.commands import Command, MotionRefusedError
from scara_control.motion.epoch import Epoch
from scara_control.motion.setpoint_messages_node import to_setpoints
from scara_control.motion.wiring_node import CallbackGuard
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse
from trajectory_msgs.msg import JointTrajectory

from control_msgs.msg import JointControllerState
from scara_msgs.msg import MotionCommand
from scara_msgs.srv import Step, StepRequest, StepResponse
from scara_simulation.command_desk import CommandDesk
from scara_simulation.commands import CommandError
from scara_simulation.joints.loop import LoopState
from scara_simulation.real_time_runner_io import RealTimeRunner
from scara_simulation.simulation import Snapshot

MAX_STEPS = 60_000
DIRECT = "_controller/command"
"""How the topics end on which a joint is commanded past all motion nodes."""


class StatePorts:
    """What the simulator publishes.

    The queues hold a burst after a stall: every 10 ms of the motion is to be recorded.
    """

    def __init__(
        self, joints: Sequence[str], dt: float, factor: float, *, publish_clock: bool
    ) -> None:
        """Advertise everything; ``factor`` is simulated time per real time."""
        self._joints, self._dt = list(joints), dt
        self._joint_states = rospy.Publisher(
            "twin/joint_states",
            JointState,
            queue_size=round(20 * max(1.0, factor)),
            tcp_nodelay=True,
        )
        self._loops = {
            (name, kind): rospy.Publisher(
                f"twin/{name}_{kind}_controller/state", JointControllerState, queue_size=5
            )
            for name in joints
            for kind in ("position", "velocity")
        }
        # As many as fit in the longest catch-up at 20 times real time; nothing of it is to be lost.
        self._each_step = {
            (name, kind): rospy.Publisher(
                f"twin/{name}_{kind}_controller/state_each_step",
                JointControllerState,
                queue_size=1000,
                tcp_nodelay=True,
            )
            for name in joints
            for kind in ("position", "velocity")
        }
        self._modes = rospy.Publisher(
            "twin/controller_modes", String, queue_size=1, latch=True, tcp_nodelay=True
        )
        self._clock = (
            rospy.Publisher("/clock", Clock, queue_size=1, tcp_nodelay=True)
            if publish_clock
            else None
        )

    def publish(self, snapshots: Sequence[Snapshot]) -> None:
        """Publish what fell due."""
        for snapshot in snapshots:
            stamp = _time(snapshot.stamp_ns)
            message = JointState(
                name=self._joints,
                position=snapshot.positions,
                velocity=snapshot.velocities,
                effort=snapshot.efforts,
            )
            message.header.stamp = stamp
            self._joint_states.publish(message)
            for loop in snapshot.loops:
                publisher = self._loops[loop.joint, loop.kind]
                if publisher.get_num_connections():
                    publisher.publish(self._loop_message(loop, stamp))
            for stamp_ns, loop in snapshot.watched:
                self._each_step[loop.joint, loop.kind].publish(
                    self._loop_message(loop, _time(stamp_ns))
                )
        if self._clock is not None and snapshots:
            self._clock.publish(Clock(clock=_time(snapshots[-1].stamp_ns)))

    def watched(self) -> tuple[int, ...]:
        """Return which joints' loops somebody listens to step by step."""
        heard = {
            name
            for (name, _), publisher in self._each_step.items()
            if publisher.get_num_connections()
        }
        return tuple(k for k, name in enumerate(self._joints) if name in heard)

    def publish_modes(self, modes: str) -> None:
        """Publish the modes of all joints; the last ones stay for late listeners."""
        self._modes.publish(String(data=modes))

    def _loop_message(self, loop: LoopState, stamp: rospy.Time) -> JointControllerState:
        message = JointControllerState(
            set_point=loop.set_point,
            process_value=loop.process_value,
            process_value_dot=loop.process_value_dot,
            error=loop.error,
            time_step=self._dt,
            command=loop.command,
            p=loop.gains.p,
            i=loop.gains.i,
            d=loop.gains.d,
            i_clamp=loop.gains.upper,
            antiwindup=loop.gains.antiwindup,
        )
        message.header.stamp = stamp
        return message


class CommandPorts:
    """What the simulator obeys.

    A refused command moves nothing, is counted and said; any other error ends the node.
    """

    def __init__(
        self, joints: Sequence[str], runner: RealTimeRunner, desk: CommandDesk, states: StatePorts
    ) -> None:
        """Subscribe and serve."""
        self._runner, self._desk, self._states = runner, desk, states
        self._control = runner.simulation.control
        self._epoch = Epoch(time.monotonic())
        self._movers = told_movers()
        self._modes = ""
        self._tell_modes()
        for name in joints:
            for kind, take in (("position", self._position), ("velocity", self._velocity)):
                topic = f"twin/{name}_{kind}_controller/command"
                self._listen(topic, Float64, partial(take, name))
        self._listen("twin/joint_setpoints", JointTrajectory, self._setpoints)
        self._stops = CommandListener(
            partial(self._guarded, "motion_command", self._obey),
            CallbackGuard(),
            self._epoch,
            runner.lock,
        )
        self._listen("joint_pose_controller/speed_limit_percent", Float64, self._limit_speed)
        rospy.Service("pause_physics", Empty, partial(self._empty, runner.pause))
        rospy.Service("unpause_physics", Empty, partial(self._empty, runner.unpause))
        rospy.Service("reset_simulation", Empty, partial(self._empty, runner.reset))
        rospy.Service("step", Step, self._step)

    def ran(self) -> None:
        """Note that this node runs, and end what nobody may go on moving."""
        with self._runner.lock:
            self._epoch.ran(time.monotonic())
            self._desk.end_tracks(self._runner.simulation.now)
            self._tell_modes()

    def _listen(self, topic: str, kind: type, take: Callable[[object], None]) -> None:
        # A queue of 10: commands to different joints share a topic, so the newest must not displace
        # the others.
        rospy.Subscriber(
            topic, kind, partial(self._guarded, topic, take), queue_size=10, tcp_nodelay=True
        )

    def _guarded(self, topic: str, take: Callable[[object], None], message: object) -> None:
        try:
            if topic.endswith(DIRECT):
                # A Float64 has no stamp: a stop that came while this node stood still goes first.
                self._stops.hear_first()
                self._movers.asked(topic, message)
            with self._runner.lock:
                take(message)
                self._tell_modes()
        except CommandError as error:
            self._runner.refuse(f"{topic}: {error}")
            rospy.logwarn_throttle_identical(5.0, f"refused: {topic}: {error}")
        except Exception as error:
            self._runner.fail(error)
            raise

    def _begin(self, name: str) -> None:
        """Refuse a command that names no time and may have waited through a stop."""
        try:
            self._epoch.begin(0.0, time.monotonic())
        except MotionRefusedError as stopped:
            raise CommandError(f"{name}: {stopped}") from stopped

    def _position(self, name: str, message: Float64) -> None:
        self._begin(name)
        self._desk.position(name, message.data)

    def _velocity(self, name: str, message: Float64) -> None:
        # A stop must never be refused because of another stop.
        if message.data != 0.0:
            self._begin(name)
        self._desk.velocity(name, message.data, self._runner.simulation.now)

    def _limit_speed(self, message: Float64) -> None:
        self._desk.limit_speed(message.data)

    def _setpoints(self, message: JointTrajectory) -> None:
        simulation = self._runner.simulation
        due = message.header.stamp.to_nsec()
        times = tuple(
            simulation.axis_time(due + point.time_from_start.to_nsec()) for point in message.points
        )
        self._desk.track(to_setpoints(message, times), simulation.now)

    def _obey(self, message: MotionCommand) -> None:
        if message.command in list(Command):
            command, now = Command(message.command), time.monotonic()
            if self._epoch.hear(command, message.reason, message.asked, now):
                self._desk.obey(command, self._runner.simulation.now)
                self._movers.stopped(message)

    def _empty(self, act: Callable[[], None], _: EmptyRequest) -> EmptyResponse:
        act()
        with self._runner.lock:
            self._tell_modes()
        return EmptyResponse()

    def _step(self, request: StepRequest) -> StepResponse:
        if request.steps > MAX_STEPS:
            return StepResponse(
                success=False, message=f"steps = {request.steps} is outside [0, {MAX_STEPS}]"
            )
        count = max(1, request.steps)
        if not self._runner.step(count):
            return StepResponse(
                success=False, message="the simulation is running: call pause_physics first"
            )
        return StepResponse(
            success=True, message=f"{count} steps of {self._runner.simulation.dt * 1e3:g} ms"
        )

    def _tell_modes(self) -> None:
        modes = self._control.modes
        if modes != self._modes:
            self._modes = modes
            self._states.publish_modes(modes)


def _time(stamp_ns: int) -> rospy.Time:
    return rospy.Time(stamp_ns // 1_000_000_000, stamp_ns % 1_000_000_000)
