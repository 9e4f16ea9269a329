"""Node ``twin_controller``: the bridge between the real robot (Modbus) and its twin (web socket).

Parameters: ``~config_dir`` (robot.yaml, twin_controller.yaml, modbus_map.yaml); ``~modbus_host``, ``~modbus_port`` and
``~gateway_url`` override the end points of twin_controller.yaml.
Services: ``twin_controller/command`` (scara_msgs/TwinCommand), ``twin_controller/why`` (scara_msgs/Why),
``twin_controller/shadow`` (scara_msgs/Shadow).
Subscribes: ``people/nearest`` (geometry_msgs/PointStamped in the base frame), for speed and separation monitoring.
Publishes: ``twin_controller/state``, ``decisions``, ``inputs``, ``audit``, ``configuration`` (latched),
``real/joint_states``, ``real/robot_data``, ``robot_status``, ``speed_scaling_factor``, ``/diagnostics``.
"""

from __future__ import annotations

import hashlib
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import rospy
from geometry_msgs.msg import PointStamped
from scara_config import ConfigError, Robot, config_directory, files_in_force, load_robot
from scara_config.modbus_map import ModbusMap, load_modbus_map
from scara_ros.memory import keep_for_good
from scara_ros.nodes.starting import become_node, until_shutdown
from std_msgs.msg import String

from scara_msgs.srv import TwinCommand, TwinCommandResponse, Why, WhyResponse
from twin_controller.config import TwinControllerConfig, load_twin_controller
from twin_controller.core.events import PersonSeen
from twin_controller.core.safety.sightings import SightingError, sighting_age
from twin_controller.core.state import Setup
from twin_controller.io.engine import Engine
from twin_controller.io.real_door import RealDoor
from twin_controller.io.rosbridge_access import Access, read_access
from twin_controller.io.twin_door import TwinDoor
from twin_controller.nodes.publishing import Publishing
from twin_controller.nodes.shadow_service import ShadowService
from twin_controller.view import decision_text, statuses

DIAGNOSTICS_PERIOD_S = 1.0  # REP-107
WATCH_PERIOD_S = 0.05
DEFAULT_DECISIONS = 10


class Node:
    """Engine, both doors and the ROS side, wired."""

    def __init__(
        self, robot: Robot, config: TwinControllerConfig, layout: ModbusMap, configuration: str, url: str, access: Access
    ) -> None:
        """Build everything; nothing connects before ``run``.

        Args:
            robot: robot.yaml.
            config: twin_controller.yaml.
            layout: modbus_map.yaml.
            configuration: Identifies the files in force.
            url: Of the gateway.
            access: What the gateway asks of us.
        """
        self._setup = Setup(robot, config)
        self._base_frame = robot.base_frame
        self._shadow = ShadowService(self._setup, configuration)
        self._publishing = Publishing(self._setup, robot, self._shadow)
        host, port = rospy.get_param("~modbus_host", config.real.host), int(rospy.get_param("~modbus_port", config.real.port))
        on_data = self._publishing.robot_data
        alive: Callable[[], bool] = lambda: self._engine.alive  # noqa: E731  the engine is made of the doors
        self._real = RealDoor(self._setup, robot, layout, host, port, self._put, self._changed, on_data, alive)
        self._twin = TwinDoor(self._setup, self._put, self._changed, url, access)
        self._engine = Engine(self._setup, self._real, self._twin, self._publishing)

    def run(self) -> int:
        """Serve until shut down; return the exit code."""
        rospy.Subscriber("people/nearest", PointStamped, self._person, queue_size=1, tcp_nodelay=True)
        services = [
            rospy.Service("twin_controller/command", TwinCommand, self._command),
            rospy.Service("twin_controller/why", Why, self._why),
            self._shadow.offer(),
        ]
        keep_for_good()
        with self._engine, self._real, self._twin, until_shutdown():
            self._watch()
        for service in services:
            service.shutdown("the twin controller ends")
        if self._engine.failure is not None:
            rospy.logfatal("the engine died: %r", self._engine.failure)
            return 1
        return 0

    def _watch(self) -> None:
        """Publish diagnostics each second and when the mode changes; end with the engine."""
        due, shown = 0.0, ""
        while not rospy.is_shutdown() and self._engine.running:
            counters = {"real": self._real.counters, "twin": self._twin.counters}
            self._publishing.counted(counters)
            state, now = self._engine.state, time.monotonic()
            if now >= due or shown != state.mode + state.why:
                due, shown = now + DIAGNOSTICS_PERIOD_S, state.mode + state.why
                self._publishing.diagnose(statuses(self._setup, state, counters, now))
            time.sleep(WATCH_PERIOD_S)

    def _put(self, event: object) -> None:
        self._engine.put(event)  # type: ignore[arg-type]

    def _changed(self, side: str, connected: bool, reason: str) -> None:
        rospy.loginfo("link %s: %s", side, "connected" if connected else reason)
        self._engine.link_changed(side, connected, reason)

    def _command(self, request: TwinCommand._request_class) -> TwinCommandResponse:
        command = request.command.strip().upper()
        target: tuple[float, ...] = ()
        if command == "MOVE":
            target = (request.x, request.y, request.z)
        elif command == "MOVE_JOINTS":
            target = tuple(request.joint_positions)
        try:
            reply = self._engine.operate(command, speed_percent=request.speed_percent, target=target, elbow=request.elbow)
            answer = TwinCommandResponse(reply.success, reply.message)
        except TimeoutError:
            answer = TwinCommandResponse(False, "the controller did not answer in time")
        who = request._connection_header.get("callerid", "unknown")
        what = (
            f"{command} target {list(target)} speed {request.speed_percent:g} %"
            if target
            else f"{command} {request.speed_percent:g} %"
        )
        self._publishing.audit(who, what, answer.success, answer.message)
        return answer

    def _person(self, message: PointStamped) -> None:
        """Take a sighting; one that cannot be used counts as none, and that stops the pair when monitoring is on."""
        header, point = message.header, (message.point.x, message.point.y, message.point.z)
        sensor = message._connection_header.get("callerid", "")
        try:
            age = sighting_age(header.frame_id, header.stamp.to_sec(), point, rospy.get_time(), self._base_frame)
        except SightingError as error:
            rospy.logerr_throttle(1.0, "people/nearest of %s: %s", sensor, error)
            return
        self._engine.put(PersonSeen(time.monotonic(), point, age, sensor))

    def _why(self, request: Why._request_class) -> WhyResponse:
        decisions = self._engine.state.decisions[-(request.count or DEFAULT_DECISIONS) :]
        return WhyResponse([decision_text(decision) for decision in decisions])


def _publish_configuration(folder: Path) -> tuple[rospy.Publisher, str]:
    """Latch all YAML files in force as one JSON object, for the bag; return what identifies them too."""
    files = {name: path.read_text(encoding="utf-8") for name, path in sorted(files_in_force(folder).items())}
    text = msgspec.json.encode(files)
    publisher = rospy.Publisher("twin_controller/configuration", String, queue_size=1, latch=True)
    publisher.publish(String(text.decode()))
    return publisher, hashlib.sha256(text).hexdigest()[:12]


def main() -> None:
    """Bridge until shut down."""
    become_node("twin_controller")
    try:
        folder = Path(rospy.get_param("~config_dir", "") or config_directory())
        robot = load_robot(folder)
        config = load_twin_controller(robot, folder)
        layout = load_modbus_map(folder)
        url = rospy.get_param("~gateway_url", config.twin.url)
        access = read_access(config.twin, url, os.environ)
    except ConfigError as error:
        rospy.logfatal("twin_controller: %s", error)
        sys.exit(2)
    publisher, configuration = _publish_configuration(folder)
    node = Node(robot, config, layout, configuration, url, access)
    code = node.run()
    publisher.unregister()
    if code:
        rospy.signal_shutdown("the engine died")
        os._exit(code)
