"""What the twin controller publishes: inputs and state become ROS messages."""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from typing import Any

import msgspec
import rospy
from geometry_msgs.msg import Point
from scara_config import Robot
from scara_ros.diagnosis import Diagnosis
from scara_ros.diagnostics_node import Diagnostics
from scara_ros.pacing import Pace
from scara_ros.starting.starting_node import until_shutdown
from sensor_msgs.msg import JointState
from typing_extensions import Self

from scara_msgs.msg import Audit, LinkState, RobotData, TwinControllerState
from scara_msgs.msg import Decision as DecisionMessage
from twin_controller.core.actions import Decided
from twin_controller.core.events import RealMeasured, Tick
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.setup import Setup
from twin_controller.core.sides.pairing import SidesAtOnce
from twin_controller.core.state import CoreState
from twin_controller.reporting.input_publisher_node import InputPublisher
from twin_controller.reporting.peak import Peak
from twin_controller.reporting.publisher_thread_node import Batch, PublisherThread
from twin_controller.reporting.shadow_service_node import ShadowService
from twin_controller.reporting.status_publisher_node import StatusPublisher
from twin_controller.robot.link import REPEATED
from twin_controller.robot_sample import RobotSample
from twin_controller.view import LinkView, state_view

DATA_PERIOD_S = 0.1
REFUSED_PERIOD_S = 0.5
"""How often the commands are judged beside each change of mode: that looks at HOME's way."""
NAN = float("nan")


class Publishing:
    """All publishers of the node; a context manager. Most of it runs in a thread of its own."""

    def __init__(self, setup: Setup, robot: Robot, shadow: ShadowService) -> None:
        """Advertise; ``shadow`` remembers each state."""
        self._setup, self._robot, self._shadow = setup, robot, shadow
        self._state = rospy.Publisher(
            "twin_controller/state", TwinControllerState, queue_size=2, tcp_nodelay=True
        )
        self._decisions = rospy.Publisher(
            "twin_controller/decisions", DecisionMessage, queue_size=100, tcp_nodelay=True
        )
        self._inputs = InputPublisher(setup)
        self._status = StatusPublisher(setup)
        self._joints = rospy.Publisher(
            "real/joint_states", JointState, queue_size=10, tcp_nodelay=True
        )
        self._data = rospy.Publisher("real/robot_data", RobotData, queue_size=2, tcp_nodelay=True)
        self._audit = rospy.Publisher(
            "twin_controller/audit", Audit, queue_size=100, tcp_nodelay=True
        )
        self._diagnostics = Diagnostics("twin_controller", queue_size=2)
        self._state_pace = Pace(1.0 / setup.config.state_rate_hz)
        self._peak = Peak(setup)
        self._data_pace = Pace(DATA_PERIOD_S)
        self._refused_pace = Pace(REFUSED_PERIOD_S)
        self._refused: dict[str, str] = {}
        self.thread = PublisherThread(self._publish)
        self._lock = threading.Lock()
        self._links: dict[str, dict[str, int]] = {}
        self._judge = ""

    def counted(self, links: dict[str, dict[str, int]]) -> None:
        """Take the links' counters, shown with the state."""
        self._links = links

    def judged(self, text: str) -> None:
        """Take what the gate said last, shown with the state."""
        self._judge = text

    def __enter__(self) -> Self:
        """Begin to publish."""
        self.thread.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        """Publish what the engine did last, and end."""
        self.thread.__exit__(*error)

    def _publish(self, batches: list[Batch], lost: int) -> None:
        """Publish inputs, decisions and, when due or changed, the state.

        While the node ends its topics close before the engine stops; what it decides then no longer
        has a listener.
        """
        with until_shutdown(), self._lock:
            state = batches[-1].state
            # As the replay of this message finds it: by its newest input, whichever batch had it.
            newest = max(batches, key=lambda batch: batch.now)
            now, stamp = newest.now, newest.stamp
            events = [event for batch in batches for event in batch.events]
            self._inputs.publish(events, state, stamp, lost)
            for event in events:
                if isinstance(event, Tick) and event.stood and not event.own_gap:
                    rospy.logwarn("this machine stood still for %.2f s", event.stood)
            for decision in (each for batch in batches for each in batch.decided):
                self._decisions.publish(_decision(decision, stamp))
                rospy.loginfo(
                    "%s -> %s: %s", decision.mode_before, decision.mode_after, decision.why
                )
                if decision.actions:
                    self.audit("twin_controller", ", ".join(decision.actions), True, decision.why)
            for batch in batches:
                self._publish_samples(batch)
                measured = any(isinstance(event, RealMeasured) for event in batch.events)
                widest = self._peak.rises(batch.state) if measured else None
                if widest is not None:
                    # At once, while the tools get further apart than before.
                    self._state_pace.hurry()
                    self.publish_state(batch.state, batch.now, batch.stamp, widest)
            # Of what is recorded, too: a replay cannot reach a state between two messages.
            self._shadow.remember(state, now, stamp.to_sec())
            self.publish_state(state, now, stamp)
            self._status.publish(state, now, stamp)

    def _publish_samples(self, batch: Batch) -> None:
        """Publish the real robot's samples of a batch if somebody listens."""
        if not self._joints.get_num_connections():
            return
        # A late engine takes several readings at once: the history has instant and speeds of each.
        # One that the core did not take in stands nowhere in it.
        rows = {row.q: row for row in batch.state.sides.real.history[-len(batch.events) :]}
        for event in batch.events:
            if isinstance(event, RealMeasured) and event.motion.q in rows:
                row = rows[event.motion.q]
                # Its age is ours, and so taken off ROS time; the robot's stamp is of its own clock.
                age = batch.now - row.time
                # Simulated time begins at 0, and a ROS time is never negative.
                true_at = rospy.Time.from_sec(max(0.0, batch.stamp.to_sec() - age))
                message = JointState(header=_header(true_at), name=list(self._setup.names))
                message.position, message.velocity = list(row.q), list(row.qdot)
                message.effort = list(event.efforts)
                self._joints.publish(message)

    def publish_state(
        self, state: CoreState, now: float, stamp: rospy.Time, widest: SidesAtOnce | None = None
    ) -> None:
        """Publish the state at its rate and at once when mode, reason or a link changes.

        Or when the tools get further apart than before, as they were then: see :class:`Peak`.
        """
        sides, lead, orders = state.sides, state.lead, state.orders
        control = lead.control
        shown = (
            lead.mode,
            lead.why,
            lead.links_up,
            lead.move_failed,
            state.safety.divergence.alarm,
            state.safety.delay.judged.alarm,
            orders.speeds,
            sides.real.alarm,
            sides.real.gripper,
            sides.twin.gripper,
            orders.grips.trouble,
            # Not its signs of life.
            control.holder,
            control.since,
            control.moves,
            control.asker,
            self._judge,
        )
        if not self._state_pace.is_due(now, shown):
            return
        fields = msgspec.structs.asdict(state_view(self._setup, state, now, widest))
        fields["links"] = [self._link(link) for link in fields["links"]]
        fields |= {name: Point(*fields[name]) for name in ("real_tool", "twin_tool")}
        held = now - fields["held_since"]
        fields["held_since"] = rospy.Time()  # of nobody
        if fields["holder"]:
            fields["held_since"] = rospy.Time.from_sec(max(0.0, stamp.to_sec() - held))
        ends = orders.hold_away, orders.stop is None
        told = lead.mode, lead.paused, lead.why, lead.must_align, ends
        if self._refused_pace.is_due(now, told):
            self._refused = refusals(self._setup, state, now)
        fields |= {"command": list(self._refused), "refused": list(self._refused.values())}
        fields["judge"] = self._judge
        self._state.publish(TwinControllerState(header=_header(stamp), **fields))

    def _link(self, link: LinkView) -> LinkState:
        fields = msgspec.structs.asdict(link)
        counters = self._links.get(fields["name"], {})
        return LinkState(
            rejected=counters.get("rejected", 0),
            repeated=sum([counters.get(f"{kind}_answers", 0) for kind in REPEATED]),
            reconnects=max(0, counters.get("connects", 0) - 1),
            **fields,
        )

    def audit(self, who: str, what: str, success: bool, outcome: str) -> None:
        """Publish who commanded what, and what came of it."""
        self._audit.publish(Audit(_header(rospy.get_rostime()), who, what, success, outcome))

    def robot_data(self, sample: RobotSample, program: str, alarm: str, alarm_number: int) -> None:
        """Publish the article's package of the real robot at 10 Hz and on a change.

        A change of the position alone does not count.
        """
        kind = {0: "none", 1: "program", 2: "stream"}.get(sample.control_type, "unknown")
        speed = sample.speed_percent
        running = "progrun" in sample.outputs
        ready = "sysrdy" in sample.outputs and "fault" not in sample.outputs
        self._status.pendant_enabled = sample.pendant_enabled
        self._status.alarm_number = alarm_number
        mode = sample.operation_mode
        shown = (kind, speed, running, ready, program, alarm, mode)
        if not self._data_pace.is_due(time.monotonic(), shown):
            return
        joints = self._robot.joints
        message = RobotData(
            control_type=kind,
            speed_percent=NAN if speed is None else speed,
            ready=ready,
            running=running,
            program=program,
            alarm=alarm,
            operation_mode=mode,
        )
        message.header.stamp = rospy.get_rostime()
        message.name, message.unit = (
            [joint.name for joint in joints],
            [joint.unit for joint in joints],
        )
        # In deg and mm with two decimals, as the controller itself shows them.
        message.position = [round(q / joint.scale, 2) for q, joint in zip(sample.motion.q, joints)]
        with until_shutdown():
            self._data.publish(message)

    def diagnose(self, found: list[Diagnosis]) -> None:
        """Publish diagnostics."""
        node = rospy.resolve_name("twin_controller")
        self._diagnostics.publish(
            *(
                replace(each, name=node + each.name.removeprefix("twin_controller"))
                for each in found
            )
        )


def _header(stamp: rospy.Time) -> rospy.Header:
    return rospy.Header(stamp=stamp)


def _decision(decision: Decided, stamp: rospy.Time) -> DecisionMessage:
    message = DecisionMessage(header=_header(stamp), seq=decision.seq)
    message.mode_before, message.event, message.mode_after = (
        decision.mode_before,
        decision.trigger,
        decision.mode_after,
    )
    message.leader, message.actions, message.why = (
        decision.leader,
        list(decision.actions),
        decision.why,
    )
    message.onset_real = NAN if decision.onset_real is None else decision.onset_real
    message.onset_twin = NAN if decision.onset_twin is None else decision.onset_twin
    message.onset_uncertainty = decision.onset_uncertainty
    message.who = decision.who
    return message
