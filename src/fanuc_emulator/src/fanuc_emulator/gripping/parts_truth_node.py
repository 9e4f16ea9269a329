"""The truth about the real side's parts and gripper, as ROS messages.

For the report and for eyes, never for control.
"""

from __future__ import annotations

import queue
from collections.abc import Callable
from concurrent import futures
from typing import Any

import numpy as np
from scara_config.palletise import Palletise

from fanuc_emulator.gripping.cell_parts import CellParts, Event
from fanuc_emulator.gripping.vehicle import dock, docked_text
from fanuc_emulator.uop import Outputs

GRIPPER_EVERY = 13
PARTS_EVERY = 25
"""Of the ground truth at 250 Hz: about 20 and 10 Hz."""
FREE = (0.45, 0.70, 0.95, 0.6)
HELD = (1.00, 0.75, 0.40, 0.6)
SEED = 1
"""Of how far off each vehicle docks and is seen, one after the other."""
_ANSWER_S = 1.0
"""The servo loop wakes each 10 ms. Our choice."""
_Wish = tuple[Callable[[], str], futures.Future[str]]


class PartsTruth:
    """Publishes ``real/parts``, ``real/gripper`` and ``real/part_events``.

    It does so from the servo loop's thread: at a rate while somebody listens, else only what has
    changed. So the last message, which a late listener gets first, is still true.

    Args:
        parts: The parts; stepped by the same thread.
        work: palletise.yaml.
        base_frame: Frame of all positions; on ROS it gets the cell's prefix.
    """

    def __init__(self, parts: CellParts, work: Palletise, base_frame: str) -> None:
        self._parts, self._work, self._frame = parts, work, base_frame
        self._calls = 0
        self._asked: queue.SimpleQueue[_Wish] = queue.SimpleQueue()
        self._chance = np.random.default_rng(SEED)
        self._told: tuple[object, ...] = ()
        # What has happened, with the monotonic time: before a roscore is there nobody is told.
        self._happened: list[tuple[float, Event]] = []
        self._places: list[tuple[float, float, float]] = []

    def advertise(self) -> None:
        """Begin; a roscore is there."""
        import rospy
        from geometry_msgs.msg import Point
        from scara_ros.shell.ros_node import own_frame
        from std_srvs.srv import SetBool, SetBoolResponse, Trigger, TriggerResponse
        from visualization_msgs.msg import Marker, MarkerArray

        from scara_msgs.msg import GripperState, PartEvent

        self._time, self._frame = rospy.Time.from_sec, own_frame(self._frame)
        self._marker, self._array, self._point = Marker, MarkerArray, Point
        self._answer, self._dock_answer = TriggerResponse, SetBoolResponse
        self._state, self._event = GripperState, PartEvent
        self._gripper = rospy.Publisher(
            "real/gripper", GripperState, queue_size=10, latch=True, tcp_nodelay=True
        )
        self._events = rospy.Publisher(
            "real/part_events", PartEvent, queue_size=100, tcp_nodelay=True
        )
        rospy.Service("real/put_parts_back", Trigger, self._put_back)
        if self._work.vehicle is not None:
            rospy.Service("real/dock", SetBool, self._dock)
        self._markers = rospy.Publisher("real/parts", MarkerArray, queue_size=1, latch=True)

    def note(self, due: float) -> None:
        """Remember when it was that something happened: by the monotonic time ``due`` [s]."""
        while self._parts.events:
            self._happened.append((due, self._parts.events.pop(0)))

    def publish(self, outputs: Outputs, due: float, offset: float) -> None:
        """Publish what has happened, and the state when it is due or has changed.

        Args:
            outputs: The robot's.
            due: Monotonic time at which they are true [s].
            offset: ROS time minus monotonic time [s].
        """
        parts, seconds = self._parts, due + offset
        while not self._asked.empty():
            act, answer = self._asked.get()
            # Who has waited in vain was told so, and what was not done stays undone.
            if answer.set_running_or_notify_cancel():
                answer.set_result(act())
        self.note(due)
        while self._happened:
            at, happened = self._happened.pop(0)
            event = self._event(
                kind=happened.kind,
                part=happened.part,
                other=happened.other,
                message=happened.message,
            )
            event.header.stamp, event.header.frame_id, event.position = (
                self._time(at + offset),
                self._frame,
                self._point(*happened.position),
            )
            self._events.publish(event)
        held = parts.held.name if parts.held else ""
        told = (outputs.gripper, held, parts.collisions, parts.drops)
        changed, self._told = told != self._told, told
        self._calls += 1
        if changed or (self._calls % GRIPPER_EVERY == 0 and self._gripper.get_num_connections()):
            self._publish_state(outputs.gripper, held, seconds)
        if changed or self._calls % PARTS_EVERY == 0:
            places = [parts.place(part) for part in parts.parts]
            if changed or places != self._places or self._markers.get_num_connections():
                self._publish_parts(places, seconds)
            self._places = places

    def _put_back(self, _: Any) -> Any:
        """Put all parts back."""
        obstacle = self._ask(self._parts.put_back)
        return self._answer(not obstacle, obstacle or "all parts are back on their stands")

    def _dock(self, request: Any) -> Any:
        """Let a vehicle dock, or leave."""
        docked = dock(self._work, self._chance) if request.data else None

        def change() -> str:
            if (self._parts.docked is None) == (docked is None):
                return "a vehicle is docked already" if docked else "no vehicle is docked"
            self._parts.dock(docked)
            return ""

        obstacle = self._ask(change)
        text = docked_text(docked) if docked else "the vehicle has left"
        return self._dock_answer(not obstacle, obstacle or text)

    def _ask(self, act: Callable[[], str]) -> str:
        """Leave the wish to the servo loop's thread and wait for its answer: why not, or empty."""
        answer: futures.Future[str] = futures.Future()
        # The servo loop's thread owns the parts, and steps them while services are called.
        self._asked.put((act, answer))
        try:
            return answer.result(_ANSWER_S)
        except futures.TimeoutError:
            if answer.cancel():
                return f"no answer of the servo loop within {_ANSWER_S:g} s: nothing is done"
            return answer.result(_ANSWER_S)

    def _publish_state(self, suction: bool, held: str, seconds: float) -> None:
        parts = self._parts
        state = self._state(
            commanded=suction,
            holding=bool(held),
            part=held,
            collisions=parts.collisions,
            drops=parts.drops,
            message=parts.message,
        )
        state.header.stamp = self._time(seconds)
        self._gripper.publish(state)

    def _publish_parts(self, places: list[tuple[float, float, float]], seconds: float) -> None:
        """Publish one cylinder for each part, like the twin's."""
        array, stamp = self._array(), self._time(seconds)
        for part, place in zip(self._parts.parts, places):
            kind, action = self._marker.CYLINDER, self._marker.ADD
            marker = self._marker(ns=part.name, type=kind, action=action)
            marker.header.stamp, marker.header.frame_id = stamp, self._frame
            where = marker.pose.position
            where.x, where.y, where.z = place
            where.z += 0.5 * self._work.parts.height
            marker.pose.orientation.w = 1.0
            marker.scale.x = marker.scale.y = 2.0 * self._work.parts.radius
            marker.scale.z = self._work.parts.height
            colour = marker.color
            colour.r, colour.g, colour.b, colour.a = HELD if part is self._parts.held else FREE
            array.markers.append(marker)
        self._markers.publish(array)
