"""What the twin controller publishes: inputs and state become ROS messages."""

from __future__ import annotations

import threading
import time

import msgspec
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from scara_config import Robot
from scara_ros.nodes.starting import until_shutdown
from sensor_msgs.msg import JointState

from scara_msgs.msg import Audit, LinkState, RobotData, TwinControllerState
from scara_msgs.msg import Decision as DecisionMessage
from twin_controller.core.actions import Decided
from twin_controller.core.events import AnyEvent, RealMeasured
from twin_controller.core.state import CoreState, Setup
from twin_controller.nodes.input_publisher import InputPublisher
from twin_controller.nodes.shadow_service import ShadowService
from twin_controller.nodes.status_publisher import StatusPublisher
from twin_controller.robot_sample import RobotSample
from twin_controller.view import LinkView, Status, state_view

DATA_PERIOD_S = 0.1
NAN = float("nan")


class Publishing:
    """All publishers of the node. ``stepped`` runs in the engine's thread."""

    def __init__(self, setup: Setup, robot: Robot, shadow: ShadowService) -> None:
        """Advertise; ``shadow`` remembers each state."""
        self._setup, self._robot, self._shadow = setup, robot, shadow
        self._state = rospy.Publisher("twin_controller/state", TwinControllerState, queue_size=2, tcp_nodelay=True)
        self._decisions = rospy.Publisher("twin_controller/decisions", DecisionMessage, queue_size=100, tcp_nodelay=True)
        self._inputs = InputPublisher(setup.config)
        self._status = StatusPublisher(setup)
        self._joints = rospy.Publisher("real/joint_states", JointState, queue_size=2, tcp_nodelay=True)
        self._data = rospy.Publisher("real/robot_data", RobotData, queue_size=2, tcp_nodelay=True)
        self._audit = rospy.Publisher("twin_controller/audit", Audit, queue_size=100, tcp_nodelay=True)
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=2, tcp_nodelay=True)
        self._next_state = self._next_data = 0.0
        self._shown: tuple[object, ...] = ()
        self._data_shown: tuple[object, ...] = ()
        self._lock = threading.Lock()
        self._links: dict[str, dict[str, int]] = {}

    def counted(self, links: dict[str, dict[str, int]]) -> None:
        """Take the links' counters, shown with the state."""
        self._links = links

    def stepped(self, events: list[AnyEvent], state: CoreState, decided: list[Decided]) -> None:
        """Publish a batch of inputs, the decisions and, when due or changed, the state.

        While the node ends its topics close before the engine stops; what it decides then has no listener any more.
        """
        with until_shutdown():
            self._publish(events, state, decided)

    def _publish(self, events: list[AnyEvent], state: CoreState, decided: list[Decided]) -> None:
        now, stamp = time.monotonic(), rospy.get_rostime()
        with self._lock:
            self._inputs.publish(events, state, stamp)
            for decision in decided:
                self._decisions.publish(_decision(decision, stamp))
                rospy.loginfo("%s -> %s: %s", decision.mode_before, decision.mode_after, decision.why)
                if decision.actions:
                    self.audit("twin_controller", ", ".join(decision.actions), True, decision.why)
            for event in events:
                if isinstance(event, RealMeasured) and state.real.history:
                    self._publish_joints(event, state, now, stamp)
            self.publish_state(state, now, stamp)
            self._status.publish(state, now, stamp)
        self._shadow.remember(state, now, stamp.to_sec())

    def publish_state(self, state: CoreState, now: float, stamp: rospy.Time) -> None:
        """Publish the state at its rate and at once when mode, reason or a link changes."""
        grippers = (state.grip_real, state.grip_twin, state.grip_trouble)
        shown = (state.mode, state.why, state.links_up, state.divergence.alarm, state.speed, state.alarm, grippers)
        if now < self._next_state and shown == self._shown:
            return
        self._shown, self._next_state = shown, now + 1.0 / self._setup.config.state_rate_hz
        fields = msgspec.structs.asdict(state_view(self._setup, state, now))
        fields["links"] = [self._link(link) for link in fields["links"]]
        self._state.publish(TwinControllerState(header=_header(stamp), **fields))

    def _link(self, link: LinkView) -> LinkState:
        fields = msgspec.structs.asdict(link)
        counters = self._links.get(fields["name"], {})
        return LinkState(rejected=counters.get("rejected", 0), reconnects=max(0, counters.get("connects", 0) - 1), **fields)

    def _publish_joints(self, event: RealMeasured, state: CoreState, now: float, stamp: rospy.Time) -> None:
        true_at = rospy.Time.from_sec(stamp.to_sec() - (now - state.real.last.t))
        message = JointState(header=_header(true_at), name=list(self._setup.names))
        message.position, message.velocity = list(event.q), list(event.qdot)
        self._joints.publish(message)

    def audit(self, who: str, what: str, success: bool, outcome: str) -> None:
        """Publish who commanded what, and what came of it."""
        self._audit.publish(Audit(_header(rospy.get_rostime()), who, what, success, outcome))

    def robot_data(self, sample: RobotSample, program: str, alarm: str) -> None:
        """Publish the article's package of the real robot at 10 Hz and when anything but the position changes."""
        kind = {0: "none", 1: "program", 2: "stream"}.get(sample.control_type, "unknown")
        speed = sample.override * sample.program_speed * 1e-2
        running = "progrun" in sample.outputs
        ready = "sysrdy" in sample.outputs and "fault" not in sample.outputs
        self._status.pendant_enabled = "tpenbl" in sample.outputs
        shown = (kind, speed, running, ready, program, alarm)
        now = time.monotonic()
        if now < self._next_data and shown == self._data_shown:
            return
        self._data_shown, self._next_data = shown, now + DATA_PERIOD_S
        joints = self._robot.joints
        message = RobotData(control_type=kind, speed_percent=speed, ready=ready, running=running, program=program, alarm=alarm)
        message.header.stamp = rospy.get_rostime()
        message.name, message.unit = [joint.name for joint in joints], [joint.unit for joint in joints]
        message.position = [round(q / joint.scale, 2) for q, joint in zip(sample.positions, joints)]
        self._data.publish(message)

    def diagnose(self, found: list[Status]) -> None:
        """Publish diagnostics."""
        array = DiagnosticArray(header=_header(rospy.get_rostime()))
        for status in found:
            values = [KeyValue(key, value) for key, value in status.values.items()]
            name = rospy.resolve_name("twin_controller") + status.name.removeprefix("twin_controller")
            array.status.append(DiagnosticStatus(status.level, name, status.message, "twin_controller", values))
        self._diagnostics.publish(array)


def _header(stamp: rospy.Time) -> rospy.Header:
    return rospy.Header(stamp=stamp)


def _decision(decision: Decided, stamp: rospy.Time) -> DecisionMessage:
    message = DecisionMessage(header=_header(stamp), seq=decision.seq)
    message.mode_before, message.event, message.mode_after = decision.mode_before, decision.trigger, decision.mode_after
    message.leader, message.actions, message.why = decision.leader, list(decision.actions), decision.why
    message.onset_real = NAN if decision.onset_real is None else decision.onset_real
    message.onset_twin = NAN if decision.onset_twin is None else decision.onset_twin
    message.onset_uncertainty = decision.onset_uncertainty
    return message
