"""Node ``gateway``: the twin's web-socket door, rosbridge v2.

Parameters: ``~config_dir`` (default: package scara_config), ``~host``, ``~port`` (default: gateway.yaml).
Topics: ``/diagnostics`` (diagnostic_msgs/DiagnosticArray, out, 1 Hz), ``twin_controller/audit`` (scara_msgs/Audit,
out). All other topics and services are the clients'.
Exit codes: 0 after a signal, 1 when the server died, 2 when it cannot start.
"""

from __future__ import annotations

import dataclasses
import os
import sys
import time

import msgspec
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from scara_config import ConfigError
from scara_ros.memory import keep_for_good
from scara_ros.nodes.starting import become_node, until_shutdown

from scara_simulation.gateway_config import GatewayConfig, load_gateway_config
from scara_simulation.io.gateway_door import GatewayError
from scara_simulation.io.gateway_server import GatewayServer
from scara_simulation.nodes.ros_graph import RosGraph

_WATCH_PERIOD = 0.2
_DIAGNOSTICS_PERIOD = 1.0


def main() -> None:
    """Run the node."""
    try:
        become_node("gateway")
        config = _configuration()
        tokens = {os.environ[r.token_environment]: n for n, r in config.roles.items() if os.environ.get(r.token_environment)}
        graph = RosGraph()
        server = GatewayServer(config, graph, rospy.get_namespace(), tokens, lambda line: rospy.loginfo("gateway: %s", line))
    except (ConfigError, GatewayError) as error:
        rospy.logfatal(str(error))
        sys.exit(2)
    graph.deliver = server.deliver
    keep_for_good()
    with server, until_shutdown():
        rospy.loginfo("gateway: rosbridge v2 on %s:%d", config.host, server.port)
        _watch(server)
    if server.failure is not None:
        sys.exit(1)


def _configuration() -> GatewayConfig:
    config = load_gateway_config(rospy.get_param("~config_dir", None))
    overrides = {key: rospy.get_param(f"~{key}") for key in ("host", "port") if rospy.has_param(f"~{key}")}
    try:
        return msgspec.convert(msgspec.to_builtins(config) | overrides, GatewayConfig)
    except msgspec.ValidationError as error:
        raise ConfigError(f"gateway: parameters {overrides}: {error}") from error


def _watch(server: GatewayServer) -> None:
    """Report until a signal comes or the server's thread ends."""
    publisher = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
    due = time.monotonic()
    while not rospy.is_shutdown() and server.failure is None:
        if time.monotonic() >= due:
            due = time.monotonic() + _DIAGNOSTICS_PERIOD
            publisher.publish(_diagnostics(server))
        rospy.rostime.wallsleep(_WATCH_PERIOD)


def _diagnostics(server: GatewayServer) -> DiagnosticArray:
    statistics = server.statistics()
    counts = [KeyValue(name, str(value)) for name, value in dataclasses.asdict(statistics).items()]
    failed = statistics.errors > 0
    status = DiagnosticStatus(
        level=DiagnosticStatus.WARN if failed else DiagnosticStatus.OK,
        name=f"{rospy.get_name()}: web socket",
        message=f"{statistics.errors} internal errors, see the log" if failed else f"{statistics.clients} clients",
        hardware_id="gateway",
        values=counts,
    )
    array = DiagnosticArray(status=[status])
    array.header.stamp = rospy.Time.now()
    return array
