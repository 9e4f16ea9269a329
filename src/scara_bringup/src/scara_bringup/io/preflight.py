"""Refuse what cannot work before anything is started: taken ports, a second cell in one namespace."""

from __future__ import annotations

import os

from scara_bringup.io.master import Address, MasterProbe
from scara_bringup.io.ports import listening_ports, owner_of
from scara_bringup.plan import NodePlan
from scara_bringup.readiness import resolve


class CannotStartError(RuntimeError):
    """The cell cannot be started; the text says why and what to do."""


def check_before_start(nodes: list[NodePlan], master: MasterProbe) -> bool:
    """Refuse what cannot work, before anything is started; return whether the master has to be started.

    Raises:
        CannotStartError: A port is taken, a cell runs already in this namespace, or the master's machine is elsewhere.
    """
    address = Address.of(master.uri)
    answers = master.answers()
    if not answers and not address.is_local:
        raise CannotStartError(f"no ROS master answers at {master.uri}, and that is another machine: start roscore there")
    wanted = {node.port: node.name for node in nodes if node.port is not None}
    if not answers:
        wanted[address.port] = "the ROS master"
    for port in sorted(listening_ports() & set(wanted)):
        owner = owner_of(port) or "a process of another user"
        raise CannotStartError(
            f"port {port}, wanted by {wanted[port]}, is taken by {owner}: end that, or choose another port (cell up --help)"
        )
    if answers:
        running = [node.name for node in nodes if master.is_running(resolve(node.name, namespace()))]
        if running:
            raise CannotStartError(
                f"at {master.uri} these nodes run already in namespace {namespace()}: {', '.join(running)}; "
                "end them, or set ROS_NAMESPACE and other ports for a second cell"
            )
    return not answers


def namespace() -> str:
    """Return the namespace of the cell."""
    return os.environ.get("ROS_NAMESPACE", "").strip() or "/"
