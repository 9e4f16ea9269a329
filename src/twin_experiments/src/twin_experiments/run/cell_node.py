"""The running cell as an experiment sees it.

It sees who is there and who moves, and gives each of its calls a deadline.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from itertools import compress
from pathlib import Path
from typing import Any

import rosgraph
import rospy
from scara_config import Robot
from scara_ros.names import current_line
from scara_ros.services.service_client_node import ServiceClient, is_offered
from scara_ros.services.service_connection_io import ServiceError, ServiceTimeoutError
from scara_ros.starting.xmlrpc_guard_io import harden_process
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from scara_msgs.msg import RobotData, TwinControllerState
from scara_msgs.msg import TwinControllerState as Mode
from scara_msgs.srv import MoveJoints, MoveTo, StartRecording, StopRecording, TwinCommand
from twin_experiments.config import Deadlines
from twin_experiments.run.standstill import Activity, observe, still_for

POLL_S = 0.02
MASTER_POLL_S = 0.5
FRESH_S = 0.5  # our choice: a side that is silent for longer is not "still" but missing
SERVICES = {
    "move_to": MoveTo,
    "recorder/start": StartRecording,
    "recorder/stop": StopRecording,
    "twin_controller/command": TwinCommand,
}
TRUTH, SHOWN = "real/ground_truth", "real/joint_states"
"""Where the real side's joints are. A stand-in alone tells the truth; any robot shows its own."""
TOPICS = {
    SHOWN: JointState,
    "twin/joint_states": JointState,
    "real/robot_data": RobotData,
    "twin_controller/state": TwinControllerState,
}
PARTS_SERVICES = {
    "gripper": SetBool,
    "joint_pose_controller/move": MoveJoints,
    "real/put_parts_back": Trigger,
    "twin/put_parts_back": Trigger,
}
"""For palletising; nobody waits for them in a cell without parts."""
ENDED_MODES = (Mode.STOPPED, Mode.STANDSTILL, Mode.ESTOP, Mode.FAULT, Mode.OFFLINE)
WAYS_OUT = {
    Mode.STOPPED: "ALIGN",
    Mode.PAUSED: "RESUME, or STOP and ALIGN",
    **dict.fromkeys((Mode.STANDSTILL, Mode.ESTOP), "RESET and ALIGN"),
}  # the operator's, not ours


class RunError(RuntimeError):
    """An experiment cannot start or go on; the text says why."""


def enter_ros(name: str, deadline: float, tell: Callable[[str], None]) -> None:
    """Become a node of a name of its own as soon as there is a master.

    Raises:
        RunError: There is none after ``deadline`` [s].
    """
    end = time.monotonic() + deadline
    if not rosgraph.is_master_online():
        tell(f"waiting for a ROS master at {rosgraph.get_master_uri()}: is the cell started?")
    while not rosgraph.is_master_online():
        if time.monotonic() > end:
            raise RunError(
                f"no ROS master at {rosgraph.get_master_uri()} after {deadline:g} s: "
                "start the cell first"
            )
        time.sleep(MASTER_POLL_S)
    harden_process()
    # Anonymous: the master ends the older of two nodes of one name. Signals are the caller's, who
    # has to stop motion and recording first.
    rospy.init_node(name, anonymous=True, disable_signals=True)


class RunningCell:
    """Subscribes to the cell and calls its services."""

    def __init__(self, robot: Robot, moving_speed_percent: float, deadlines: Deadlines) -> None:
        """Subscribe; nothing is waited for."""
        self._deadlines = deadlines
        self._thresholds = {
            joint.name: joint.velocity * moving_speed_percent / 100.0 for joint in robot.twin_joints
        }
        self._activities = dict.fromkeys((TRUTH, SHOWN, "twin/joint_states"), Activity())
        self._newest: dict[str, Any] = {}
        # Beginning and end of an experiment stand in the bag itself: a report needs nothing else.
        self._marker = rospy.Publisher("experiment/marker", String, queue_size=10, tcp_nodelay=True)
        for topic, kind in {**TOPICS, TRUTH: JointState}.items():
            rospy.Subscriber(topic, kind, self._receive, topic, queue_size=100, tcp_nodelay=True)

    def _receive(self, message: Any, topic: str) -> None:
        """Keep the newest message; of joint states also whether they move."""
        self._newest[topic] = message
        if topic in self._activities:
            # A robot may show more joints than the twin has.
            known = [n in self._thresholds for n in message.name]
            speeds = [*compress(message.velocity, known)]
            thresholds = [self._thresholds[n] for n in compress(message.name, known)]
            self._activities[topic] = observe(
                self._activities[topic], time.monotonic(), speeds, thresholds
            )

    @property
    def mode(self) -> str:
        """Mode of the twin controller, empty before its first message."""
        state = self._newest.get("twin_controller/state")
        return state.mode if state is not None else ""

    @property
    def why(self) -> str:
        """The twin controller's last decision in words, or its alarm."""
        state = self._newest.get("twin_controller/state")
        return str(state.alarm or state.why) if state is not None else ""

    @property
    def running(self) -> bool:
        """True while the robot says that a program of its own runs, or is paused.

        The stream program, by which it follows, is none.
        """
        data = self._newest.get("real/robot_data")
        if data is None or data.control_type != "program":
            return False
        # A paused program has not ended: it goes on, as the same run.
        return bool(data.running or current_line(data.program)[0])

    def moves(self, leader: str) -> int:
        """Return how many moves one side has begun so far."""
        return self._activity(leader).moves

    def still_for(self) -> float:
        """Return for how long both sides have stood still [s]."""
        sides = [self._activity("real"), self._activity("twin")]
        return still_for(sides, time.monotonic(), FRESH_S)

    def _activity(self, side: str) -> Activity:
        """Return what one side has done."""
        # Where the joints truly are, if that is told: what a robot shows is rounded, and late.
        real = TRUTH if TRUTH in self._newest else SHOWN
        return self._activities[real if side == "real" else "twin/joint_states"]

    def _absent(self) -> list[str]:
        """Return in words which topics and services are not there."""
        silent = [
            f"topic {rospy.resolve_name(topic)}" for topic in TOPICS if topic not in self._newest
        ]
        return silent + [
            f"service {rospy.resolve_name(name)}" for name in SERVICES if not is_offered(name, 0.1)
        ]

    def _unready(self) -> list[str]:
        """Return in words what a whole cell still waits for.

        Raises:
            RunError: Only the operator can go on.
        """
        state = self._newest["twin_controller/state"]
        if state.mode != Mode.IDLE:
            reason = state.alarm or state.why or "no reason given"
            waited = f"twin controller in IDLE (it is in {state.mode}: {reason})"
            # Only a person gives these commands: to wait on would be in vain.
            if state.mode in WAYS_OUT:
                raise RunError(
                    f"waiting for {waited}; first give {WAYS_OUT[state.mode]} to "
                    "service twin_controller/command"
                )
            return [waited]
        return [] if self.still_for() > FRESH_S else ["both sides to stand still"]

    def wait_ready(self, tell: Callable[[str], None]) -> None:
        """Wait until the cell can run an experiment.

        ``tell`` is given what is missing, when it changes.

        Raises:
            RunError: Something is still missing at the deadline, all of it is named; or only the
                operator can go on.
        """
        told: list[str] = []
        deadline = time.monotonic() + self._deadlines.cell
        while missing := self._absent() or self._unready():
            if missing != told:
                tell(f"waiting for {', '.join(missing)}")
                told = missing
            if time.monotonic() > deadline:
                raise RunError(f"not there after {self._deadlines.cell:g} s: {', '.join(missing)}")
            time.sleep(POLL_S)

    def wait_until(self, done: Callable[[], bool], deadline: float, what: str) -> None:
        """Wait for ``done`` while the twin controller goes on.

        Raises:
            RunError: The deadline [s] has passed, or the twin controller has ended the motion.
        """
        end = time.monotonic() + deadline
        while not done():
            state = self._newest.get("twin_controller/state")
            if state is not None and state.mode in ENDED_MODES:
                raise RunError(
                    f"the twin controller went to {state.mode}: "
                    f"{state.alarm or state.why or 'no reason given'}"
                )
            if time.monotonic() > end:
                raise RunError(f"waited {deadline:g} s in vain for {what}")
            time.sleep(POLL_S)

    def wait_still(self, duration: float) -> None:
        """Wait until both sides have stood still for ``duration`` [s] from now on.

        The twin controller must be idle too.
        """
        begun = time.monotonic()
        self.wait_until(
            lambda: (
                # A rest from before does not count: what was just asked for may not have begun to
                # move.
                min(self.still_for(), time.monotonic() - begun) >= duration
                and self.mode == Mode.IDLE
            ),
            self._deadlines.still + duration,
            "both sides to stand still with the twin controller in IDLE",
        )

    def mark(self, text: str) -> None:
        """Publish a marker, once the recorder listens."""
        self.wait_until(
            lambda: self._marker.get_num_connections() > 0,
            self._deadlines.service,
            "a recorder of experiment/marker",
        )
        self._marker.publish(text)

    def start_recording(self, path: Path) -> None:
        """Start a bag at ``path``.

        Raises:
            RunError: The recorder refuses, or does not answer in time.
        """
        try:
            answer = self._call("recorder/start", self._deadlines.service, path=str(path))
        except BaseException:
            # The recorder may begin all the same, and nobody else would end it. One that refuses
            # may be at another recording, which goes on.
            with contextlib.suppress(RunError):
                self.stop_recording()
            raise
        if not answer.success:
            raise RunError(f"recorder: {answer.message}")

    def stop_recording(self) -> int:
        """Finish the bag and return its number of messages.

        Raises:
            RunError: The recorder lost the recording.
        """
        answer = self._call("recorder/stop", self._deadlines.service + 30.0)
        if not answer.success:
            raise RunError(
                f"recorder: {answer.message}; {answer.messages} messages are in {answer.path}"
            )
        return int(answer.messages)

    def move_to(self, position: tuple[float, float, float], speed_percent: float) -> None:
        """Send the twin to a position [m] and wait for its answer.

        Raises:
            RunError: It was refused or aborted.
        """
        x, y, z = position
        answer = self._call(
            "move_to", self._deadlines.move, x=x, y=y, z=z, speed_percent=speed_percent
        )
        if not answer.success:
            raise RunError(f"move_to {x:g} {y:g} {z:g}: {answer.message}")

    def move_joint(self, joint: str, position: float, speed_percent: float) -> None:
        """Move one joint of the twin [rad or m] and wait for its answer; the others hold.

        Raises:
            RunError: It was refused or aborted.
        """
        answer = self._call(
            "joint_pose_controller/move",
            self._deadlines.move,
            joint_names=[joint],
            joint_positions=[position],
            speed_percent=speed_percent,
        )
        if not answer.success:
            raise RunError(f"{joint} to {position:g}: {answer.message}")

    def grip(self, on: bool, within: float) -> str:
        """Switch the twin's suction; return why it did not grip or let go, or an empty text."""
        answer = self._call("gripper", within, data=on)
        return "" if answer.success else str(answer.message)

    def gripped(self) -> tuple[bool, bool]:
        """Return whether real robot and twin hold a part, as the twin controller knows it."""
        state = self._newest["twin_controller/state"]
        return state.real_gripper.startswith("holding"), state.twin_gripper.startswith("holding")

    def put_parts_back(self) -> None:
        """Let all parts of both sides be put back on their stands.

        Raises:
            RunError: A part is held.
        """
        for side in ("real", "twin"):
            answer = self._call(f"{side}/put_parts_back", self._deadlines.service)
            if not answer.success:
                raise RunError(f"{side}: {answer.message}")

    def stop_motion(self) -> str:
        """Ask the twin controller for a STOP; return its answer in words."""
        try:
            answer = self._call("twin_controller/command", self._deadlines.service, command="STOP")
        except RunError as error:
            return str(error)
        return "" if answer.success else str(answer.message)

    def _call(self, name: str, within: float, **fields: Any) -> Any:
        """Call a service within a time [s]."""
        try:
            return ServiceClient(name, {**SERVICES, **PARTS_SERVICES}[name], within)(**fields)
        except ServiceTimeoutError as error:
            raise RunError(f"service {name}: no answer within {within:g} s") from error
        except ServiceError as error:
            raise RunError(str(error)) from error
