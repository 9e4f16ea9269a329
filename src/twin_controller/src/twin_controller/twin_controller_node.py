"""Node ``twin_controller``: the bridge between the real robot (Modbus) and its twin (web socket).

Parameters: ``~config_dir`` (robot.yaml, twin_controller.yaml, modbus_map.yaml, persons.yaml);
``~modbus_host``, ``~modbus_port`` and ``~gateway_url`` override the end points of
twin_controller.yaml, ``~links`` its choice of link limits (strict or desk); ``~learned`` is the
folder in which it keeps what it has learned of the robot (default: ``~/.ros/learned``, for a robot
on this machine nowhere).
Services: ``twin_controller/command`` (scara_msgs/TwinCommand), ``twin_controller/control``
(scara_msgs/Control), ``twin_controller/stop``, ``pause``, ``resume``, ``reset``
(std_srvs/Trigger), ``twin_controller/judge`` (scara_msgs/JudgeMove), ``twin_controller/why``
(scara_msgs/Why), ``twin_controller/shadow`` (scara_msgs/Shadow).
Calls: ``what_if/judge`` (scara_msgs/JudgeMotion) before MOVE, MOVE_JOINTS and HOME, and for each
program that the robot starts by itself.
Subscribes: ``people/nearest`` (geometry_msgs/PointStamped in the base frame), for speed and
separation monitoring; ``what_if/gate`` (scara_msgs/Audit), what all gates say, which it publishes
too.
Publishes: ``motion_command`` (a stop that the lost line to the twin cannot carry),
``twin_controller/state``, ``decisions``, ``inputs``, ``audit``, ``configuration``
(latched), ``real/joint_states``, ``real/robot_data``, ``robot_status``, ``speed_scaling_factor``,
``/diagnostics``.
"""

from __future__ import annotations

import hashlib
import os
import time
from pathlib import Path

import msgspec
import rospy
from geometry_msgs.msg import PointStamped
from scara_config import Robot, files_in_force, load_robot
from scara_config.modbus_map import ModbusMap, load_modbus_map
from scara_config.profile import PLANTS
from scara_config.quantities import is_this_machine
from scara_ros.diagnostics_node import PERIOD_S
from scara_ros.gate.settings import GateSettings, load_gate
from scara_ros.pacing import Pace
from scara_ros.page.persons_io import Persons, load_persons
from scara_ros.page.token_file_io import token_folder
from scara_ros.process.memory_io import keep_for_good
from scara_ros.process.scheduling_io import go_first
from scara_ros.shell.ros_node import own_frame, starting
from scara_ros.starting.starting_node import until_shutdown
from std_msgs.msg import String

from scara_msgs.msg import MotionCommand
from scara_msgs.srv import Why, WhyResponse
from twin_controller.config import TwinControllerConfig, load_twin_controller
from twin_controller.core.events import PersonSeen
from twin_controller.core.safety.sightings import (
    SightingError,
    note_stranger,
    sensor_of,
    sighting_age,
)
from twin_controller.core.setup import Setup
from twin_controller.engine.engine_io import Engine
from twin_controller.engine.learned_io import (
    learned,
    learned_file,
    read_learned,
    write_learned,
)
from twin_controller.modbus.port_io import ModbusSettings
from twin_controller.modbus.robot_link_io import ModbusRobotLink
from twin_controller.reporting.publishing_node import Publishing
from twin_controller.reporting.shadow_service_node import ShadowService
from twin_controller.reporting.snapshots import recorded_choices
from twin_controller.robot.link import RobotListener
from twin_controller.robot.real_link_io import RealLink
from twin_controller.services.command_services_node import CommandServices
from twin_controller.services.move_gate_node import MoveGate
from twin_controller.twin.commands import Packet
from twin_controller.twin.packets import SENDER
from twin_controller.twin.rosbridge_access_io import Access, read_access
from twin_controller.twin.twin_link_io import TwinLink
from twin_controller.view import decision_text, links_text, statuses

replace = msgspec.structs.replace
WATCH_PERIOD_S, KEEP_PERIOD_S = 0.05, 60.0
DEFAULT_DECISIONS = 10
CONFIG_FILE = "twin_controller.yaml"


class Node:
    """Engine, both links and the ROS side, wired."""

    def __init__(
        self,
        robot: Robot,
        config: TwinControllerConfig,
        layout: ModbusMap,
        configuration: str,
        url: str,
        access: Access,
        persons: Persons,
        gate: GateSettings,
        learned: Path | None,
    ) -> None:
        """Build everything; nothing connects before ``run``.

        Args:
            robot: robot.yaml.
            config: twin_controller.yaml.
            layout: modbus_map.yaml.
            configuration: Identifies the files in force.
            url: Of the gateway.
            access: What the gateway asks of us.
            persons: Who may hold control.
            gate: what_if.yaml.
            learned: Where what was learned of the robot is kept; None: nowhere.
        """
        switches = layout.has_gripper or not layout.shows_gripper
        self._setup = Setup(robot, config, switches)
        self._base_frame = own_frame(robot.base_frame)
        self._learned = learned
        self._sensors, self._strangers = config.separation.sensors, tuple[str, ...]()
        self._shadow = ShadowService(self._setup, configuration)
        self._publishing = Publishing(self._setup, robot, self._shadow)
        self._real = self._real_link(robot, config, layout)
        self._stops = rospy.Publisher(
            "motion_command", MotionCommand, queue_size=10, tcp_nodelay=True
        )
        self._twin = TwinLink(self._setup, self._put, self._changed, url, access, self._stop_beside)
        self._engine = Engine(self._setup, self._real, self._twin, self._publishing.thread.stepped)
        if persons.trouble:
            rospy.logerr("nobody can hold control: %s", persons.trouble)
        self._gate = MoveGate(
            self._setup,
            gate,
            lambda: self._engine.state,
            self._publishing.judged,
            self._publishing.audit,
            self._pause,
        )
        self._commands = CommandServices(
            self._setup, self._engine, persons, self._publishing.audit, self._gate
        )

    def _real_link(self, robot: Robot, config: TwinControllerConfig, layout: ModbusMap) -> RealLink:
        """Choose the robot's protocol; another one is another ``connect``."""
        settings = ModbusSettings(
            config.real.host,
            config.real.port,
            poll_period=config.real.poll_period_ms * 1e-3,
            drift_ppm=config.real.clock_drift_ppm,
            timeout=config.real.timeout_ms * 1e-3,
            command_retry=config.real.command_retry_ms * 1e-3,
            command_attempts=config.real.command_attempts,
            alone=config.real.alone_ms * 1e-3,
        )

        def connect(listener: RobotListener) -> ModbusRobotLink:
            return ModbusRobotLink(settings, layout, robot, listener)

        return RealLink(
            robot,
            layout.shows_gripper,
            connect,
            self._put,
            self._changed,
            self._publishing.robot_data,
            alive=self._decides,
        )

    def _decides(self) -> bool:
        """Tell whether the robot's watchdog is kept awake: somebody decides, and is heard of it."""
        return self._engine.alive and self._publishing.thread.failure is None

    def run(self) -> int:
        """Serve until shut down; return the exit code."""
        rospy.Subscriber(
            "people/nearest", PointStamped, self._person, queue_size=1, tcp_nodelay=True
        )
        services = [
            *self._commands.offer(),
            rospy.Service("twin_controller/why", Why, self._why),
            self._shadow.offer(),
        ]
        path = self._learned
        if path and (known := read_learned(path, self._setup.names, time.monotonic())):
            self._put(known)
        keep_for_good()
        go_first()
        # They end from right to left: the robot's last stop needs a living engine's heartbeats.
        with self._publishing, self._engine, self._real, self._twin, until_shutdown():
            rospy.loginfo("twin_controller is ready")
            self._watch()
        self._keep()
        for service in services:
            service.shutdown("the twin controller ends")
        failure = self._engine.failure or self._publishing.thread.failure or self._real.failure
        if failure is not None:
            rospy.logfatal("the twin controller died: %r", failure)
            return 1
        return 0

    def _watch(self) -> None:
        """Publish diagnostics each second and when the mode changes; end with engine or link."""
        pace, keeping = Pace(PERIOD_S), Pace(KEEP_PERIOD_S)
        publisher, real = self._publishing.thread, self._real
        while not rospy.is_shutdown() and self._engine.running:
            # A link that died does not connect again; whoever supervises the node starts it anew.
            if publisher.failure is not None or real.failure is not None:
                return
            counters = {"real": self._real.counters, "twin": self._twin.counters}
            self._publishing.counted(counters)
            self._gate.look()
            state, now = self._engine.state, time.monotonic()
            if pace.is_due(now, state.lead.mode + state.lead.why):
                self._publishing.diagnose(statuses(self._setup, state, counters, now))
            if keeping.is_due(now):
                self._keep()
            time.sleep(WATCH_PERIOD_S)

    def _keep(self) -> None:
        """Keep what was learned of the robot for the next start."""
        if self._learned is None:
            return
        kept = learned(self._engine.state, self._setup.names)
        if kept is not None:
            write_learned(self._learned, kept)

    def _pause(self) -> None:
        """Pause the pair because the robot's own program was refused."""
        try:
            reply = self._engine.operate("PAUSE")
            success, message = reply.success, reply.message
        except TimeoutError as error:
            success, message = False, f"the engine gave {error}"
            rospy.logerr("PAUSE (hold_own_programs): %s", message)
        self._publishing.audit("what_if", "PAUSE (hold_own_programs)", success, message)

    def _put(self, event: object) -> None:
        self._engine.put(event)  # type: ignore[arg-type]

    def _changed(self, side: str, connected: bool, reason: str) -> None:
        rospy.loginfo("link %s: %s", side, "connected" if connected else reason)
        self._engine.link_changed(side, connected, reason)

    def _stop_beside(self, packet: Packet) -> None:
        """Tell the twin's nodes to stop: their line to us is lost, and with it their robot."""
        told = {name: packet[name] for name in ("command", "id", "reason", "asked")}
        header = rospy.Header(stamp=rospy.get_rostime(), frame_id=SENDER)
        self._stops.publish(MotionCommand(header=header, **told))

    def _person(self, message: PointStamped) -> None:
        """Take a sighting of a named sensor; one that cannot be used does not count.

        Without a sighting the pair stops when monitoring is on.
        """
        caller = message._connection_header.get("callerid", "")
        sensor = sensor_of(caller, rospy.get_namespace(), self._sensors)
        if sensor is None:
            self._strangers, said = note_stranger(self._strangers, caller)
            if said:
                rospy.logwarn("%s", said)
            return
        header, point = message.header, (message.point.x, message.point.y, message.point.z)
        try:
            age = sighting_age(
                header.frame_id, header.stamp.to_sec(), point, rospy.get_time(), self._base_frame
            )
        except SightingError as error:
            rospy.logerr_throttle(1.0, "people/nearest of %s: %s", sensor, error)
            return
        self._engine.put(PersonSeen(time.monotonic(), point, age, sensor))

    def _why(self, request: Why._request_class) -> WhyResponse:
        decisions = self._engine.state.lead.decisions[-(request.count or DEFAULT_DECISIONS) :]
        return WhyResponse([decision_text(decision) for decision in decisions])


def _publish_configuration(
    folder: Path, config: TwinControllerConfig
) -> tuple[rospy.Publisher, str]:
    """Latch all YAML files in force as one JSON object, for the bag; return their digest too.

    Not the plants: how the robot behaves is measured here, and the stand-in says it of itself.
    """
    files = {
        name: path.read_text(encoding="utf-8")
        for name, path in sorted(files_in_force(folder).items())
        if not name.startswith(f"{PLANTS}/")
    }
    files[CONFIG_FILE] = recorded_choices(files[CONFIG_FILE], config)
    text = msgspec.json.encode(files)
    publisher = rospy.Publisher("twin_controller/configuration", String, queue_size=1, latch=True)
    publisher.publish(String(text.decode()))
    return publisher, hashlib.sha256(text).hexdigest()[:12]


def main() -> None:
    """Bridge until shut down."""
    with starting("twin_controller") as folder:
        robot = load_robot(folder)
        config = load_twin_controller(robot, folder, rospy.get_param("~links", ""))
        host = str(rospy.get_param("~modbus_host", config.real.host))
        port = int(rospy.get_param("~modbus_port", config.real.port))
        config = replace(config, real=replace(config.real, host=host, port=port))
        layout = load_modbus_map(folder)
        url = rospy.get_param("~gateway_url", config.twin.url)
        access = read_access(config.twin, url, os.environ)
        persons = Persons(load_persons(folder))
        gate = load_gate(folder)
    rospy.loginfo(links_text(config))
    only_followed = robot.only_followed(config.real.host)
    if only_followed:
        rospy.logwarn("the robot is followed, and never led: %s", only_followed)
    publisher, configuration = _publish_configuration(folder, config)
    # A stand-in on this machine is another robot with each start.
    usual = "" if is_this_machine(host) else token_folder(os.environ) / "learned"
    place = str(rospy.get_param("~learned", str(usual)))
    kept = learned_file(Path(place), robot.name, host, port) if place and robot.lead else None
    node = Node(robot, config, layout, configuration, url, access, persons, gate, kept)
    code = node.run()
    publisher.unregister()
    if code:
        rospy.signal_shutdown("the twin controller died")
        os._exit(code)
