"""What the cell publishes becomes the snapshot of the page."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from datetime import datetime
from typing import Any

import msgspec
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from scara_config import Robot
from scara_ros.nodes.own_cell import is_own
from std_msgs.msg import String
from visualization_msgs.msg import Marker, MarkerArray

from control_msgs.msg import JointControllerState
from industrial_msgs.msg import RobotStatus as RobotStatusMessage
from operator_panel.view.robot.status import RobotStatus
from operator_panel.view.snapshot import (
    CellState,
    DecisionLine,
    Diagnosis,
    Link,
    Loop,
    Part,
    RobotPackage,
    Snapshot,
)
from scara_msgs.msg import Decision, PartEvent, RobotData, TwinControllerState

DECISIONS_KEPT = 30
TRI_STATES = ("drives_powered", "e_stopped", "motion_possible", "in_motion", "in_error")
CLOCK = "%H:%M:%S"
UNWATCHED_S = 0.5
"""So often what comes all the time is read while no page is open; our choice: as often as chart
points are kept then, and below ``silent_ms``."""
UNSEEN_S = 5.0
"""The same of what only an open page shows; our choice."""
PLACE_DIGITS = 4  # our choice: a tenth of a millimetre, so that what rests is not sent again


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
                self._seldom(self._loop_of(joint)),
            )
        self._listen("robot_status", RobotStatusMessage, self._seldom(self._status))
        for side in ("twin", "real"):
            self._listen(f"{side}/parts", MarkerArray, self._seldom(self._parts_of(side), UNSEEN_S))
            self._listen(f"{side}/part_events", PartEvent, self._placed_by(side), 20)
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

    def _state(self, message: TwinControllerState) -> None:
        links = tuple(
            Link(**{name: getattr(link, name) for name in Link.__struct_fields__})
            for link in message.links
        )
        plain: dict[str, Any] = {
            name: getattr(message, name) for name in CellState.__struct_fields__ if name != "links"
        }
        fields: dict[str, Any] = {
            name: tuple(value) if isinstance(value, (list, tuple)) else value
            for name, value in plain.items()
        }
        clock = datetime.now().strftime(CLOCK)
        self._change(
            state=CellState(links=links, **fields), received=time.monotonic(), silent_since=clock
        )

    def _decision(self, message: Decision) -> None:
        clock = datetime.fromtimestamp(message.header.stamp.to_sec()).strftime(CLOCK)
        by = f" [by {message.who}]" if message.who else ""
        line = DecisionLine(clock, message.mode_before, message.mode_after, message.why + by)
        self._change(decisions=(line, *self.snapshot().decisions)[:DECISIONS_KEPT])

    def _package(self, message: RobotData) -> None:
        self._change(
            package=RobotPackage(
                **{name: getattr(message, name) for name in RobotPackage.__struct_fields__}
            )
        )

    def _jog(self, message: String) -> None:
        self._change(jog=message.data)

    def _loop_of(self, joint: str) -> Callable[[JointControllerState], None]:
        def take(message: JointControllerState) -> None:
            loop = Loop(message.set_point, message.process_value, message.error, message.command)
            with self._lock:
                loops = {**self._snapshot.loops, joint: loop}
                self._snapshot = msgspec.structs.replace(self._snapshot, loops=loops)

        return take

    def _parts_of(self, side: str) -> Callable[[MarkerArray], None]:
        def take(message: MarkerArray) -> None:
            parts = tuple(
                _part(m)
                for m in message.markers
                if m.type == Marker.CYLINDER and m.action == Marker.ADD
            )
            with self._lock:
                if self._snapshot.parts.get(side) != parts:
                    self._snapshot = msgspec.structs.replace(
                        self._snapshot, parts={**self._snapshot.parts, side: parts}
                    )

        return take

    def _status(self, message: RobotStatusMessage) -> None:
        self._change(
            status=RobotStatus(
                mode=message.mode.val,
                error_code=message.error_code,
                **{name: getattr(message, name).val for name in TRI_STATES},
            )
        )

    def _placed_by(self, side: str) -> Callable[[PartEvent], None]:
        def take(message: PartEvent) -> None:
            if message.kind != PartEvent.PLACED:
                return
            with self._lock:
                placed = dict(self._snapshot.placed)
                placed[side] = placed.get(side, 0) + 1
                self._snapshot = msgspec.structs.replace(self._snapshot, placed=placed)

        return take

    def _diagnostics(self, message: DiagnosticArray) -> None:
        if not is_own(message):  # all cells at a master share the topic
            return
        now = time.monotonic()
        found = {
            status.name: Diagnosis(
                int(status.level),
                status.name,
                status.message,
                now,
                {v.key: v.value for v in status.values},
            )
            for status in message.status
        }
        with self._lock:
            self._snapshot = msgspec.structs.replace(
                self._snapshot, diagnoses={**self._snapshot.diagnoses, **found}
            )


def _part(marker: Marker) -> Part:
    place, turn, size = marker.pose.position, marker.pose.orientation, marker.scale
    red, green, blue = (
        round(255 * min(max(part, 0.0), 1.0))
        for part in (marker.color.r, marker.color.g, marker.color.b)
    )
    return Part(
        name=marker.text,
        position=(
            round(place.x, PLACE_DIGITS),
            round(place.y, PLACE_DIGITS),
            round(place.z, PLACE_DIGITS),
        ),
        orientation=(round(turn.x, 3), round(turn.y, 3), round(turn.z, 3), round(turn.w, 3)),
        diameter=round(size.x, 5),
        height=round(size.z, 5),
        colour=f"#{red:02x}{green:02x}{blue:02x}",
    )
