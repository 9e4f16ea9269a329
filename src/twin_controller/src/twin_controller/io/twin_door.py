"""The twin behind its web socket: typed actions go out, checked inputs come in."""

from __future__ import annotations

import dataclasses
import logging
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from twin_controller.core.actions import Do, FollowTwin, MoveTwin, Perform
from twin_controller.core.events import AnyEvent, TwinMeasured, TwinMotion
from twin_controller.core.state import Setup
from twin_controller.io.rosbridge_access import Access
from twin_controller.io.rosbridge_link import LinkSettings, RosbridgeLink
from twin_controller.packets import (
    FOLLOW,
    GRIPPER,
    JOINT_SETPOINTS,
    JOINT_STATES,
    MOTION_COMMAND,
    MOTION_STATE,
    SPEED_LIMIT,
    PacketError,
    clock_probe,
    command_packet,
    end_packet,
    follow_packet,
    twin_gripper,
    twin_measured,
    twin_motion,
    twin_plan,
)
from twin_controller.plausible import TWIN_ACCELERATION, Plausibility, Reading, Verdict, judge

_LOG = logging.getLogger("rosout.twin_door")
MOVE_TIMEOUT_S = 120.0
GRIP_TIMEOUT_S = 2.0
FIRST_PROBES_S = 0.02
REPEAT_S = 0.1
"""A command that the twin's pose controller does not report as obeyed is sent again after this time,"""
REPEATS = 20
"""at most so often."""
RANGE_MARGIN = 0.02
"""How far outside its range, as a part of it, a joint of the twin may be read: physics gives way at a limit."""


@dataclasses.dataclass(frozen=True, slots=True)
class _Unheard:
    """A command that the twin has not reported yet, when it is due again, and how often still."""

    packet: dict[str, Any]
    due: float
    left: int


class TwinDoor:
    """The link to the twin; a context manager."""

    def __init__(
        self,
        setup: Setup,
        put: Callable[[AnyEvent], None],
        changed: Callable[[str, bool, str], None],
        url: str,
        access: Access | None = None,
    ) -> None:
        """Prepare the link.

        Args:
            setup: Profile and numbers.
            put: Takes checked inputs.
            changed: Told side, connected and why not.
            url: ``ws://host:port`` of the gateway.
            access: What the gateway asks of us.
        """
        self._setup, self._put = setup, put
        self._rejected = 0
        self._probes = 0
        self._plausible = Plausibility()
        self._unheard: _Unheard | None = None
        self._stop = threading.Event()
        settings = LinkSettings(silent_timeout=setup.config.twin.stale_ms * 1e-3)
        self._link = RosbridgeLink(
            url, self._receive, lambda up, why: self._change(changed, up, why), self._remark, access, settings
        )
        twin = setup.config.twin
        self._link.subscribe(JOINT_STATES, "sensor_msgs/JointState", throttle_ms=round(twin.state_period_ms))
        self._link.subscribe(JOINT_SETPOINTS, "trajectory_msgs/JointTrajectory", throttle_ms=round(twin.plan_period_ms))
        self._link.subscribe(MOTION_STATE, "scara_msgs/MotionState", queue_length=10)
        self._link.subscribe(GRIPPER, "scara_msgs/GripperState", queue_length=10)
        self._link.advertise(FOLLOW, "trajectory_msgs/JointTrajectory")
        self._link.advertise(SPEED_LIMIT, "std_msgs/Float64")
        self._link.advertise(MOTION_COMMAND, "scara_msgs/MotionCommand")
        self._prober = threading.Thread(target=self._probe, name="twin clock", daemon=True)

    def __enter__(self) -> Self:
        """Connect, again and again."""
        self._link.start()
        self._prober.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Disconnect."""
        self._stop.set()
        self._prober.join(timeout=1.0)
        self._link.close()

    @property
    def counters(self) -> dict[str, int]:
        """What went over the link, for diagnostics."""
        link = self._link.counters
        return {
            "sent": link.sent,
            "received": link.received,
            "rejected": link.rejected + self._rejected,
            "connects": link.connects,
        }

    def follow(self, action: FollowTwin) -> None:
        """Send one set point."""
        self._link.publish(FOLLOW, follow_packet(action, self._setup.names))

    def perform(self, action: Perform, stamp: float) -> None:
        """Send the end of following, or one motion command until the twin reports it; ``stamp`` is the twin's ROS time.

        A topic loses what is published before its subscribers are connected, as right after a reconnect.
        """
        if action.do is Do.RELEASE_TWIN:
            self._link.publish(FOLLOW, end_packet(stamp))
            return
        packet = command_packet(action, stamp)
        if self._link.publish(MOTION_COMMAND, packet):
            self._unheard = _Unheard(packet, time.monotonic() + REPEAT_S, REPEATS)

    def _heard(self, motion: TwinMotion) -> None:
        """Forget the last command once the twin reports its id, or send it again; it is obeyed once, however often it comes."""
        last, again = self._unheard, None
        if last is None:
            return
        if motion.last_command_id != last.packet["id"]:
            if motion.now < last.due:
                return
            if last.left and self._link.publish(MOTION_COMMAND, last.packet):
                again = _Unheard(last.packet, motion.now + REPEAT_S, last.left - 1)
            else:
                _LOG.error("the twin does not obey command %d: %s", last.packet["id"], last.packet["reason"])
        if self._unheard is last:
            self._unheard = again

    def cap(self, speed_percent: float) -> None:
        """Send the speed cap."""
        self._link.publish(SPEED_LIMIT, {"data": speed_percent})

    def move(self, action: MoveTwin, done: Callable[[bool, str], None]) -> None:
        """Start a move; ``done`` is told how it ended."""
        if action.command == "MOVE":
            x, y, z = action.target
            service = "move_to"
            arguments: dict[str, Any] = {"x": x, "y": y, "z": z, "speed_percent": action.speed_percent, "elbow": action.elbow}
        else:
            service = "joint_pose_controller/move"
            positions = list(action.target)
            arguments = {
                "joint_names": list(self._setup.names),
                "joint_positions": positions,
                "speed_percent": action.speed_percent,
            }

        def answered(result: bool, values: Any, received: float, sent: float) -> None:
            if not result or not isinstance(values, dict):
                done(False, str(values))
            else:
                done(bool(values.get("success")), str(values.get("message", "")))

        if not self._link.call_service(service, arguments, answered, MOVE_TIMEOUT_S):
            done(False, "the twin's link is down")

    def grip(self, on: bool, done: Callable[[bool, str], None]) -> None:
        """Switch the suction; ``done`` is told what came of it."""

        def answered(result: bool, values: Any, received: float, sent: float) -> None:
            good = result and isinstance(values, dict)
            done(good and bool(values.get("success")), str(values.get("message", "") if good else values))

        if not self._link.call_service("gripper", {"data": on}, answered, GRIP_TIMEOUT_S):
            done(False, "the twin's link is down")

    def _change(self, changed: Callable[[str, bool, str], None], connected: bool, reason: str) -> None:
        self._probes, self._plausible, self._unheard = 0, Plausibility(), None
        changed("twin", connected, reason)

    def _remark(self, level: str, text: str) -> None:
        _LOG.warning("the twin's gateway says (%s): %s", level, text)

    def _receive(self, topic: str, message: dict[str, Any], received: float) -> None:
        try:
            match topic.lstrip("/"):
                case name if name.endswith(JOINT_STATES):
                    self._measured(twin_measured(message, self._setup.names, received))
                case name if name.endswith(JOINT_SETPOINTS):
                    self._put(twin_plan(message, self._setup.names, received))
                case name if name.endswith(GRIPPER):
                    self._put(twin_gripper(message, received))
                case name if name.endswith(MOTION_STATE):
                    motion = twin_motion(message, self._setup.names, received)
                    self._heard(motion)
                    self._put(motion)
        except PacketError as error:
            self._reject(f"{topic}: {error}")

    def _measured(self, event: TwinMeasured) -> None:
        """Hand on what the twin can be; readings that have really jumped (a reset of the simulation) begin anew."""
        setup = self._setup
        for joint, q in zip(setup.joints, event.q):
            margin = RANGE_MARGIN * (joint.upper - joint.lower)
            if not joint.lower - margin <= q <= joint.upper + margin:
                raise PacketError(f"position of {joint.name} = {q:g} is outside [{joint.lower:.6g}, {joint.upper:.6g}]")
        reading = Reading(event.q, event.qdot, event.stamp, event.now)
        self._plausible, verdict = judge(self._plausible, reading, setup.joints, TWIN_ACCELERATION)
        if verdict is Verdict.JUMPED:
            self._link.drop(f"the readings of the twin jumped: {self._plausible.reason}")
        if verdict in (Verdict.REFUSED, Verdict.JUMPED):
            raise PacketError(self._plausible.reason)
        if verdict is Verdict.ACCEPTED:
            self._put(event)

    def _reject(self, text: str) -> None:
        self._rejected += 1
        if self._rejected & (self._rejected - 1) == 0:
            _LOG.error("packet of the twin rejected (%d so far): %s", self._rejected, text)

    def _probe(self) -> None:
        """Ask the twin's clock: quickly at first, then at the configured period."""
        config = self._setup.config.twin
        while not self._stop.is_set():
            if self._link.connected:
                self._link.call_service("/rosapi/get_time", {}, self._probed, 1.0)
            quick = self._probes < 4 * config.probes
            self._stop.wait(FIRST_PROBES_S if quick else config.probe_period_ms * 1e-3)

    def _probed(self, result: bool, values: Any, received: float, sent: float) -> None:
        try:
            if not result or not isinstance(values, dict):
                raise PacketError(f"get_time: {values!r}")
            self._put(clock_probe(values, sent, received))
            self._probes += 1
        except PacketError as error:
            self._reject(str(error))
