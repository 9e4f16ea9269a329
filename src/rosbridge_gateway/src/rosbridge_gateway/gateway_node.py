"""Node ``gateway``: the twin's web-socket door, rosbridge v2.

Parameters: ``~config_dir`` (default: package scara_config), ``~host``, ``~port`` (default:
gateway.yaml).
Topics: ``/diagnostics`` (diagnostic_msgs/DiagnosticArray, out, 1 Hz), ``twin_controller/audit``
(scara_msgs/Audit, out). All other topics and services are the clients'.
Exit codes: 0 after a signal, 1 when the server died, 2 when it cannot start.
"""

from __future__ import annotations

import dataclasses
import os
import sys
import time
from pathlib import Path

import msgspec
import rospy
from scara_config import ConfigError
from scara_ros.diagnosis import Diagnosis, Level
from scara_ros.diagnostics_node import PERIOD_S, Diagnostics
from scara_ros.pacing import Pace
from scara_ros.page.persons_io import Person, load_persons, person_tokens
from scara_ros.page.token_file_io import TokenError, read_token
from scara_ros.process.memory_io import keep_for_good
from scara_ros.process.scheduling_io import go_first
from scara_ros.shell.ros_node import starting
from scara_ros.starting.starting_node import until_shutdown

from rosbridge_gateway.admission.door_io import GatewayError
from rosbridge_gateway.config import GatewayConfig, load_gateway_config
from rosbridge_gateway.connection.server_io import GatewayServer
from rosbridge_gateway.graph.ros_graph_node import RosGraph
from rosbridge_gateway.protocol.first_messages import KeepRules
from rosbridge_gateway.protocol.names import any_of, patterns_in

_WATCH_PERIOD = 0.2


def main() -> None:
    """Run the node."""
    with starting("gateway", GatewayError, TokenError) as folder:
        config = _configuration(folder)
        tokens, persons = _tokens(config, load_persons(folder))
        namespace = rospy.get_namespace()
        stamps_itself = any_of(patterns_in(config.sender_stamps, namespace)).match
        drives = any_of(patterns_in(config.driving.topics, namespace)).match
        keep_rules = KeepRules(config.first_messages, namespace)
        graph = RosGraph(keep_rules, stamps_itself, drives, config.unstamped_age)
        server = GatewayServer(
            config,
            graph,
            namespace,
            tokens,
            lambda line: rospy.loginfo("gateway: %s", line),
            persons,
        )
    graph.deliver, graph.remark = server.deliver, server.remark
    keep_for_good()
    go_first()
    with server, until_shutdown():
        rospy.loginfo("gateway is ready: rosbridge v2 on %s:%d", config.host, server.port)
        diagnostics, pace = Diagnostics("gateway"), Pace(PERIOD_S)
        while not rospy.is_shutdown() and server.failure is None:
            if pace.is_due(time.monotonic()):
                diagnostics.publish(_diagnosis(server))
            graph.end_openings()
            rospy.rostime.wallsleep(_WATCH_PERIOD)
    if server.failure is not None:
        sys.exit(1)


def _configuration(folder: Path) -> GatewayConfig:
    config = load_gateway_config(folder)
    if rospy.has_param("~token"):
        rospy.delete_param("~token")
        raise ConfigError(
            "~token: the command line and the parameter server show it to everybody; give "
            "it by the environment variable or the file that gateway.yaml names, and choose a new "
            "one"
        )
    overrides = {
        key: rospy.get_param(f"~{key}") for key in ("host", "port") if rospy.has_param(f"~{key}")
    }
    try:
        return msgspec.convert(msgspec.to_builtins(config) | overrides, GatewayConfig)
    except msgspec.ValidationError as error:
        raise ConfigError(f"parameters {overrides}: {error}") from error


def _tokens(
    config: GatewayConfig, persons: dict[str, Person]
) -> tuple[dict[str, str], dict[str, str]]:
    """Return the role by token, those of persons included, and the person by token.

    Raises:
        ConfigError: Two roles have the same token, or a person's role is unknown.
        TokenError: A token's file cannot be used.
    """
    tokens: dict[str, str] = {}
    for name, role in config.roles.items():
        token = read_token(role.token_environment, role.token_file, os.environ)
        if token is None:
            continue
        if token in tokens:
            raise ConfigError(
                f"roles {tokens[token]} and {name} have the same token: give each its own"
            )
        tokens[token] = name
    known = {token: name for name, token in person_tokens(persons).items()}
    for token, person in known.items():
        given = persons[person].gateway_role
        if given not in config.roles:
            allowed = ", ".join(config.roles)
            raise ConfigError(
                f"persons.yaml: persons.{person}.gateway_role = {given!r}: allowed: {allowed}"
            )
        if tokens.setdefault(token, given) != given:
            raise ConfigError(
                f"{person} has the token of the role {tokens[token]}: give each its own"
            )
    return tokens, known


def _diagnosis(server: GatewayServer) -> Diagnosis:
    statistics = server.statistics()
    name, values = f"{rospy.get_name()}: web socket", dataclasses.asdict(statistics)
    if statistics.errors > 0:
        return Diagnosis(
            Level.WARN, name, f"{statistics.errors} internal errors, see the log", values
        )
    return Diagnosis(Level.OK, name, f"{statistics.clients} clients", values)
