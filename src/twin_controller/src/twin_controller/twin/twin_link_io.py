"""The twin behind its web socket: typed actions go out, checked inputs come in."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

from typing_extensions import Self

from twin_controller.core.actions import Command, FollowTwin, MoveTwin, SendTwin
from twin_controller.core.events import AnyEvent, TwinMeasured, TwinMotion
from twin_controller.core.orders.order import Order
from twin_controller.core.orders.stop import STOPPING_TWIN
from twin_controller.core.setup import Setup
from twin_controller.plausible import Plausibility, Verdict
from twin_controller.twin.commands import Packet, heard, lost_text, patience, told
from twin_controller.twin.fields import PacketError
from twin_controller.twin.held_joints import HeldJoints
from twin_controller.twin.packets import (
    FOLLOW,
    GRIPPER,
    JOG_AHEAD,
    JOINT_SETPOINTS,
    JOINT_STATES,
    MOTION_COMMAND,
    MOTION_STATE,
    SPEED_LIMIT,
    ServiceCall,
    answer,
    clock_probe,
    command_packet,
    end_packet,
    follow_packet,
    gripper_call,
    judge_measured,
    move_call,
    twin_gripper,
    twin_measured,
    twin_motion,
    twin_plan,
)
from twin_controller.twin.rosbridge_access_io import Access
from twin_controller.twin.rosbridge_link_io import RosbridgeLink
from twin_controller.twin.rosbridge_socket_io import LinkSettings

_LOG = logging.getLogger("rosout.twin_link")
MOVE_TIMEOUT_S = 600.0
"""As long as gateway.yaml lets a call last: a move that is paused, or slow, has not failed. A lost
line and the twin's nodes answer before that."""
GRIP_TIMEOUT_S = 2.0
FIRST_PROBES_S = 0.02
HERE = ("127.0.0.1", "localhost", "::1")
"""Hosts of a gateway on this machine."""
Done = Callable[[bool, str], None]


class TwinLink:
    """The link to the twin; a context manager."""

    def __init__(
        self,
        setup: Setup,
        put: Callable[[AnyEvent], None],
        changed: Callable[[str, bool, str], None],
        url: str,
        access: Access | None = None,
        beside: Callable[[Packet], None] = lambda packet: None,
    ) -> None:
        """Prepare the link.

        Args:
            setup: Profile and numbers.
            put: Takes checked inputs.
            changed: Told side, connected and why not.
            url: ``ws://host:port`` of the gateway.
            access: What the gateway asks of us.
            beside: Takes a stop to the twin's nodes past the line, while that is lost.
        """
        self._setup, self._put, self._beside = setup, put, beside
        # The monotonic clock is one for all processes of a machine, and another one elsewhere.
        self._same_clock = urlsplit(url).hostname in HERE
        self._rejected = 0
        self._probes = 0
        self._plausible = Plausibility()
        self._held = HeldJoints(setup.joints)
        # The last command, until the twin reports it; each connection begins without one. The
        # engine's thread and the line's set it under the lock.
        self._command_lock = threading.Lock()
        self._command: Order[Packet] | None = None
        self._patience = patience(setup.config.twin)
        self._stop = threading.Event()
        settings = LinkSettings(silent_timeout=setup.config.twin.stale_ms * 1e-3)
        self._link = RosbridgeLink(
            url,
            self._receive,
            lambda up, why: self._change(changed, up, why),
            self._remark,
            access,
            settings,
        )
        self._say_what_is_wanted()
        self._prober = threading.Thread(target=self._probe, name="twin clock", daemon=True)

    def _say_what_is_wanted(self) -> None:
        """Subscribe and advertise; the link remembers it for each connect."""
        twin = self._setup.config.twin
        self._link.subscribe(
            JOINT_STATES, "sensor_msgs/JointState", throttle_ms=round(twin.state_period_ms)
        )
        self._link.subscribe(
            JOINT_SETPOINTS,
            "trajectory_msgs/JointTrajectory",
            throttle_ms=round(twin.plan_period_ms),
        )
        self._link.subscribe(
            JOG_AHEAD,
            "trajectory_msgs/JointTrajectory",
            throttle_ms=round(twin.plan_period_ms),
        )
        self._link.subscribe(MOTION_STATE, "scara_msgs/MotionState", queue_length=10)
        self._link.subscribe(GRIPPER, "scara_msgs/GripperState", queue_length=10)
        self._link.advertise(FOLLOW, "trajectory_msgs/JointTrajectory")
        self._link.advertise(SPEED_LIMIT, "std_msgs/Float64")
        self._link.advertise(MOTION_COMMAND, "scara_msgs/MotionCommand")

    def __enter__(self) -> Self:
        """Connect, again and again."""
        self._link.start()
        self._prober.start()
        return self

    def __exit__(self, *_: object) -> None:
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

    def perform(self, action: SendTwin, stamp: float, reached: bool) -> None:
        """Send the end of following, or one motion command until the twin reports it.

        A twin whose line is lost may still move by a trajectory of its own: a stop goes past the
        line too then. It has its number, so nobody obeys it twice.

        Args:
            action: What the twin is told.
            stamp: The twin's ROS time.
            reached: The twin's data come: its line can be trusted.
        """
        if action.command is Command.RELEASE_TWIN:
            self._link.publish(FOLLOW, end_packet(stamp))
            return
        # Sent again it stays as old as it is.
        asked = time.monotonic() if self._same_clock else 0.0
        packet = command_packet(action, stamp, asked)
        if not reached and action.command in STOPPING_TWIN:
            self._beside(packet)
        if self._link.publish(MOTION_COMMAND, packet):
            order = told(packet, self._patience, time.monotonic())
            with self._command_lock:
                self._command = order

    def _heard(self, motion: TwinMotion) -> None:
        """Repeat, forget or give up the last command, by what the twin reports."""
        before = self._command
        if before is None:
            return
        repeat = heard(before, motion.last_command_id, motion.now)
        order, lost = repeat.order, repeat.lost
        if repeat.again is not None and not self._link.publish(MOTION_COMMAND, repeat.again):
            order, lost = None, repeat.again
        if lost is not None:
            _LOG.error(lost_text(lost))
        # The engine's thread may have sent a newer command meanwhile.
        with self._command_lock:
            if self._command is before:
                self._command = order

    def cap(self, speed_percent: float) -> None:
        """Send the speed cap."""
        self._link.publish(SPEED_LIMIT, {"data": speed_percent})

    def move(self, action: MoveTwin, done: Done) -> None:
        """Start a move; ``done`` is told how it ended."""
        call = move_call(action, self._setup.names, self._same_clock)
        self._call(call, done, MOVE_TIMEOUT_S)

    def grip(self, on: bool, done: Done) -> None:
        """Switch the suction; ``done`` is told what came of it."""
        self._call(gripper_call(on), done, GRIP_TIMEOUT_S)

    def _call(self, call: ServiceCall, done: Done, timeout: float) -> None:
        def answered(result: bool, values: Any, received: float, sent: float) -> None:
            done(*answer(result, values))

        if not self._link.call_service(*call, answered, timeout):
            done(False, "the twin's link is down")

    def _change(
        self, changed: Callable[[str, bool, str], None], connected: bool, reason: str
    ) -> None:
        self._probes, self._plausible, self._command = 0, Plausibility(), None
        self._held.forget()
        changed("twin", connected, reason)

    def _remark(self, level: str, text: str) -> None:
        _LOG.warning("the twin's gateway says (%s): %s", level, text)

    def _receive(self, topic: str, message: dict[str, Any], received: float) -> None:
        try:
            match topic.lstrip("/"):
                case name if name.endswith(JOINT_STATES):
                    self._measured(twin_measured(message, self._setup.names, received))
                case name if name.endswith(JOINT_SETPOINTS):
                    self._put(twin_plan(message, self._setup.names, received, self._held))
                case name if name.endswith(JOG_AHEAD):
                    self._put(twin_plan(message, self._setup.names, received, jog=True))
                case name if name.endswith(GRIPPER):
                    self._put(twin_gripper(message, received))
                case name if name.endswith(MOTION_STATE):
                    motion = twin_motion(message, self._setup.names, received)
                    self._heard(motion)
                    self._put(motion)
        except PacketError as error:
            self._reject(f"{topic}: {error}")

    def _measured(self, event: TwinMeasured) -> None:
        """Hand on what the twin can be.

        Readings that have really jumped (a reset of the simulation) begin anew.
        """
        self._plausible, verdict = judge_measured(self._plausible, event, self._setup.joints)
        if verdict is Verdict.JUMPED:
            self._link.drop(f"the readings of the twin jumped: {self._plausible.reason}")
        if verdict in (Verdict.REFUSED, Verdict.JUMPED):
            raise PacketError(self._plausible.reason)
        if verdict is Verdict.ACCEPTED:
            self._held.measure(event.motion)
            self._put(event)

    def _reject(self, text: str) -> None:
        self._rejected += 1
        # At each power of two: a sender that is wrong all the time must not fill the log.
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
