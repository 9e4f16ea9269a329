"""What the cell publishes becomes the snapshot of the page."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from datetime import datetime
from functools import partial
from typing import Any

import msgspec
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped
from scara_config import Robot
from scara_ros.shell.ros_node import is_own
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from control_msgs.msg import JointControllerState
from industrial_msgs.msg import RobotStatus as RobotStatusMessage
from operator_panel.retelling import taking
from operator_panel.view.snapshot import Snapshot
from scara_msgs.msg import Decision, MotionOutcome, PartEvent, RobotData, TwinControllerState

UNWATCHED_S = 0.5
"""So often what comes all the time is read while no page is open; our choice: as often as chart
points are kept then, and below ``silent_ms``."""
UNSEEN_S = 5.0
"""The same of what only an open page shows; our choice."""


class Listening:
    """Subscribes, converts and keeps the newest of everything."""

    def __init__(self, robot: Robot) -> None:
        """Know nothing yet."""
        self._lock = threading.Lock()
        self._snapshot = Snapshot()
        self._joints = [joint.name for joint in robot.twin_joints]
        self._watched = threading.Event()

    def watch(self, watched: bool) -> None:
        """Read all that comes, from now on, or little of it: ``watched`` says if a page is open."""
        if watched:
            self._watched.set()
        else:
            self._watched.clear()

    def subscribe(self) -> None:
        """Subscribe to everything; the process is a ROS node by now."""
        self._listen("twin_controller/state", TwinControllerState, self._seldom(self._state))
        self._listen("twin_controller/decisions", Decision, self._decision, 20)
        self._listen("real/robot_data", RobotData, self._seldom(self._package))
        self._listen("joint_vel_controller/state", String, self._jog)
        self._listen("/diagnostics", DiagnosticArray, self._diagnostics, 20)
        for joint in self._joints:
            self._listen(
                f"twin/{joint}_position_controller/state",
                JointControllerState,
                self._seldom(partial(self._loop, joint)),
            )
        self._listen("robot_status", RobotStatusMessage, self._seldom(self._status))
        for side in ("twin", "real"):
            parts = partial(self._take, taking.with_parts, side)
            self._listen(f"{side}/parts", MarkerArray, self._seldom(parts, UNSEEN_S))
            placed = partial(self._take, taking.with_part_event, side)
            self._listen(f"{side}/part_events", PartEvent, placed, 20)
        self._listen("people/nearest", PointStamped, self._seldom(self._person))
        self._listen("what_if/outcomes", MotionOutcome, self._outcome)
        self._change(master=True)

    def snapshot(self) -> Snapshot:
        """Return the newest of everything."""
        with self._lock:
            return self._snapshot

    def _listen(self, topic: str, kind: type, take: Callable[[Any], None], queue: int = 1) -> None:
        rospy.Subscriber(topic, kind, take, queue_size=queue, tcp_nodelay=True)

    def _seldom(
        self, take: Callable[[Any], None], pause: float | None = None
    ) -> Callable[[Any], None]:
        """Take the newest message only now and then while no page is open.

        ``pause`` [s] between two; default: UNWATCHED_S.
        Meanwhile the messages stay in the socket; rospy then throws all but the newest away unread.
        """

        def take_and_wait(message: Any) -> None:
            take(message)
            self._watched.wait(UNWATCHED_S if pause is None else pause)

        return take_and_wait

    def _change(self, **fields: Any) -> None:
        with self._lock:
            self._snapshot = msgspec.structs.replace(self._snapshot, **fields)

    def _take(self, take: Callable[..., Snapshot], *what: Any) -> None:
        """Put what came into the snapshot, by a function of ``taking``."""
        with self._lock:
            self._snapshot = take(self._snapshot, *what)

    def _state(self, message: TwinControllerState) -> None:
        clock = datetime.now().strftime(taking.CLOCK)
        self._take(taking.with_state, message, time.monotonic(), clock)

    def _decision(self, message: Decision) -> None:
        made = datetime.fromtimestamp(message.header.stamp.to_sec())
        self._take(taking.with_decision, message, made.isoformat(timespec="seconds"))

    def _package(self, message: RobotData) -> None:
        self._take(taking.with_package, message)

    def _loop(self, joint: str, message: JointControllerState) -> None:
        self._take(taking.with_loop, joint, message, time.monotonic())

    def _jog(self, message: String) -> None:
        self._change(jog=message.data)

    def _status(self, message: RobotStatusMessage) -> None:
        self._take(taking.with_status, message)

    def _person(self, message: PointStamped) -> None:
        sensor = message._connection_header.get("callerid", "")
        self._take(taking.with_person, sensor, message, time.monotonic())

    def _outcome(self, message: MotionOutcome) -> None:
        self._take(taking.with_outcome, message)

    def _diagnostics(self, message: DiagnosticArray) -> None:
        if is_own(message):  # all cells at a master share the topic
            self._take(taking.with_diagnostics, message, time.monotonic())
