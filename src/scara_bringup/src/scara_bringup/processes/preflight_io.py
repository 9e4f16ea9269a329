"""Refuse what cannot work before anything is started.

That is a taken port, or a second cell in one namespace.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

import rosgraph
from scara_config.quantities import is_this_machine
from scara_ros.names import NamespaceError, namespace_of, resolve

from scara_bringup.plan import CONTROLLER, EMULATOR, NodePlan
from scara_bringup.processes.master_io import MasterAddress, MasterProbe
from scara_bringup.processes.ports_io import listening_ports, owner_of


class CannotStartError(RuntimeError):
    """The cell cannot be started; the text says why and what to do."""


def check_before_start(nodes: list[NodePlan], master: MasterProbe) -> bool:
    """Refuse what cannot work, before anything is started.

    Return whether the master has to be started.

    Raises:
        CannotStartError: A port is taken or wanted twice, a cell runs already in this namespace, or
            the master's machine is elsewhere.
    """
    address = MasterAddress.of(master.uri)
    answers = master.answers()
    if not answers and not address.is_local:
        raise CannotStartError(
            f"no ROS master answers at {master.uri}, and that is another machine: start "
            "roscore there"
        )
    asked = [(node.port, node.name) for node in nodes if node.port is not None]
    if not answers:
        asked.append((address.port, "the ROS master"))
    wanted: dict[int, str] = {}
    for port, who in asked:
        if port in wanted:
            raise CannotStartError(
                f"port {port} is wanted by {wanted[port]} and by {who}: choose another port for "
                "one of them (cell up --help)"
            )
        wanted[port] = who
    for port in sorted(listening_ports() & set(wanted)):
        owner = owner_of(port) or "a process of another user"
        raise CannotStartError(
            f"port {port}, wanted by {wanted[port]}, is taken by {owner}: end that, "
            "choose another port (cell up --help), or give this cell a name and it finds free "
            "ones (cell up --name)"
        )
    if answers:
        running = [
            node.name for node in nodes if master.is_running(resolve(node.name, namespace()))
        ]
        if running:
            raise CannotStartError(
                f"at {master.uri} these nodes run already in namespace {namespace()}: "
                f"{', '.join(running)}; "
                "end them, or give the second cell a name (cell up --name)"
            )
    return not answers


def refuse_two_robots(nodes: list[NodePlan], host: str) -> None:
    """Refuse a stand-in beside a robot that is somewhere else: who is told to move would be unsaid.

    Args:
        nodes: Of the cell.
        host: Of the robot that the twin controller couples the twin with.

    Raises:
        CannotStartError: The cell would start the stand-in and couple another robot.
    """
    names = {node.name for node in nodes}
    if {EMULATOR, CONTROLLER} <= names and not is_this_machine(host):
        raise CannotStartError(
            f"twin_controller.yaml: real.host is {host}, a robot that is no stand-in of this "
            "machine: `./cell up --without emulator` couples that robot; for the stand-in, and for "
            "`./cell demo`, set real.host to 127.0.0.1"
        )


def node_address(env: Mapping[str, str], network: bool) -> dict[str, str]:
    """Return the variables by which every node of the cell listens at this machine's loopback.

    Args:
        env: The environment; a ROS_HOSTNAME in it counts before a ROS_IP.
        network: Whether the caller has allowed another address.

    Raises:
        CannotStartError: An address opens the nodes to the network and nobody has allowed it.
    """
    name = "ROS_HOSTNAME" if env.get("ROS_HOSTNAME") else "ROS_IP"
    address = env.get(name) or "127.0.0.1"
    listens_at = rosgraph.network.get_bind_address(address)
    if not network and listens_at in ("0.0.0.0", "::"):
        raise CannotStartError(
            f"{name} = {address} would open the ROS master and every node to the network, and "
            f"whoever reaches them commands the cell: `unset {name}`, or say --network if that is "
            "meant"
        )
    # One that is empty would count for rospy, and open all.
    return {"ROS_IP": address, "ROS_HOSTNAME": address}


def namespace() -> str:
    """Return the namespace of the cell, in its absolute form.

    Raises:
        CannotStartError: ROS_NAMESPACE holds what is no name.
    """
    try:
        return namespace_of(os.environ.get("ROS_NAMESPACE", ""))
    except NamespaceError as error:
        raise CannotStartError(str(error)) from error
