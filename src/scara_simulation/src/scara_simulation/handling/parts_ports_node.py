"""Parts and gripper of the twin over ROS.

They have topics, the service ``gripper``, and a part of ``/diagnostics``.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import msgspec
import rospy
from geometry_msgs.msg import Point
from scara_config.palletise import Palletise
from scara_ros.diagnosis import Diagnosis, Level
from scara_ros.diagnostics_node import Diagnostics
from scara_ros.pacing import Pace
from std_srvs.srv import (
    SetBool,
    SetBoolRequest,
    SetBoolResponse,
    Trigger,
    TriggerRequest,
    TriggerResponse,
)
from visualization_msgs.msg import Marker, MarkerArray

from scara_msgs.msg import GripperState, PartEvent
from scara_simulation.handling.part_world_io import PartsNow, PartWorld
from scara_simulation.real_time_runner_io import RealTimeRunner
from scara_simulation.simulation import Snapshot

GRIPPER_PERIOD_NS = 50_000_000
PARTS_PERIOD_NS = 100_000_000
RESTING_PERIOD_NS = 1_000_000_000  # our choice: parts that all rest are told again so often
PLACE_DIGITS, TURN_DIGITS = 4, 3  # our choice: 0.1 mm and 0.1 deg; a part that moves less rests
DIAGNOSTICS_PERIOD_NS = 1_000_000_000
FREE = (0.10, 0.45, 0.85, 1.0)
HELD = (0.95, 0.55, 0.10, 1.0)
_WAIT_S = 0.005


class PartsPorts:
    """Publishes where the parts are and what happens to them; serves the gripper."""

    def __init__(self, world: PartWorld, work: Palletise, base_frame: str) -> None:
        """Advertise."""
        self._world, self._work, self._frame = world, work, base_frame
        self._parts = rospy.Publisher("twin/parts", MarkerArray, queue_size=1, latch=True)
        self._gripper = rospy.Publisher(
            "twin/gripper", GripperState, queue_size=10, latch=True, tcp_nodelay=True
        )
        self._events = rospy.Publisher(
            "twin/part_events", PartEvent, queue_size=100, tcp_nodelay=True
        )
        self._diagnostics = Diagnostics("simulator")
        self._paces = (
            (Pace(GRIPPER_PERIOD_NS), self._tell_gripper),
            (Pace(PARTS_PERIOD_NS), self._tell_parts),
            (Pace(DIAGNOSTICS_PERIOD_NS), self._diagnose),
        )
        self._changed = Pace(RESTING_PERIOD_NS)
        self._counted = (0, 0)

    def serve(self, runner: RealTimeRunner) -> None:
        """Offer the service ``gripper``."""
        self._runner = runner
        rospy.Service("gripper", SetBool, self._command)
        rospy.Service("twin/put_parts_back", Trigger, self._put_back)

    def publish(self, snapshots: Sequence[Snapshot]) -> None:
        """Publish what has happened and what fell due by the time of the last snapshot."""
        if not snapshots:
            return
        stamp_ns, now = snapshots[-1].stamp_ns, self._world.now
        stamp = rospy.Time(*divmod(stamp_ns, 1_000_000_000))
        while self._world.happened:
            step, happened = self._world.happened.popleft()
            # A world in which another payload was mounted counts its steps anew: what is told of
            # the one before is as old as this state.
            ago = max(0, self._world.steps - step)
            at = rospy.Time(*divmod(self._runner.simulation.stamp_before(ago), 1_000_000_000))
            event = PartEvent(**msgspec.structs.asdict(happened))
            event.position = Point(*happened.position)
            event.header.stamp, event.header.frame_id = at, self._frame
            self._events.publish(event)
            if event.kind in (PartEvent.DROPPED, PartEvent.COLLISION):
                rospy.logwarn("%s: %s", event.kind, event.message)
        told = (
            now.suction.commanded,
            now.suction.held,
            now.collisions,
            now.drops,
            now.message,
            now.touches,
        )
        for pace, tell in self._paces:
            if pace.is_due(stamp_ns, told):
                tell(now, stamp)

    def _tell_gripper(self, now: PartsNow, stamp: rospy.Time) -> None:
        state = GripperState(
            commanded=now.suction.commanded,
            holding=bool(now.suction.held),
            part=now.suction.held,
            collisions=now.collisions,
            drops=now.drops,
            message=now.message,
            touches=now.touches,
        )
        state.header.stamp = stamp
        self._gripper.publish(state)

    def _tell_parts(self, now: PartsNow, stamp: rospy.Time) -> None:
        # What makes the parts worth telling again.
        shown = [
            (
                part.held,
                *(round(value, PLACE_DIGITS) for value in part.position),
                *(round(value, TURN_DIGITS) for value in part.orientation),
            )
            for part in now.parts
        ]
        if not self._changed.is_due(stamp.to_nsec(), shown):
            return
        array = MarkerArray()
        for part in now.parts:
            marker = Marker(ns=part.name, type=Marker.CYLINDER, action=Marker.ADD)
            marker.header.stamp, marker.header.frame_id = stamp, self._frame
            where, turn = marker.pose.position, marker.pose.orientation
            where.x, where.y, where.z = part.position
            turn.x, turn.y, turn.z, turn.w = part.orientation
            marker.scale.x = marker.scale.y = 2.0 * self._work.parts.radius
            marker.scale.z = self._work.parts.height
            colour = marker.color
            colour.r, colour.g, colour.b, colour.a = HELD if part.held else FREE
            array.markers.append(marker)
        self._parts.publish(array)

    def _diagnose(self, now: PartsNow, stamp: rospy.Time) -> None:
        """Warn once of each new collision or drop."""
        counts = (now.collisions, now.drops)
        worse = any(count > before for count, before in zip(counts, self._counted))
        self._counted = counts
        held = now.suction.held or ("nothing" if now.suction.commanded else "off")
        found = Diagnosis(
            Level.WARN if worse else Level.OK,
            f"{rospy.get_name()}: parts",
            now.message if worse else f"gripper: {held}",
            {"collisions": counts[0], "drops": counts[1], "gripper": held},
        )
        self._diagnostics.publish(found, stamp=stamp)

    def _put_back(self, _: TriggerRequest) -> TriggerResponse:
        with self._runner.lock:
            obstacle = self._world.put_parts_back()
        return TriggerResponse(not obstacle, obstacle or "all parts are back on their stands")

    def _command(self, request: SetBoolRequest) -> SetBoolResponse:
        """Switch the suction; wait until a part hangs, or is let go, or it takes too long."""
        with self._runner.lock:
            self._world.grip(request.data)
            if self._runner.paused:
                return SetBoolResponse(
                    False, "the simulation is paused: the suction is switched, nothing moves"
                )
        until = time.monotonic() + self._work.gripper.answer_ms * 1e-3
        while time.monotonic() < until:
            time.sleep(_WAIT_S)
            with self._runner.lock:
                suction = self._world.suction
            if bool(suction.held) == request.data:
                return SetBoolResponse(
                    True, f"holds {suction.held}" if request.data else "nothing is held"
                )
        if not request.data:
            return SetBoolResponse(False, f"{suction.held} still hangs at the nozzle")
        reach = self._work.gripper.reach_mm
        return SetBoolResponse(
            False, f"no part within {reach:g} mm below the nozzle; the suction stays on"
        )
