"""Judge from what the master and the kernel show which node is not ready yet, and why."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from scara_ros.names import resolve

from scara_bringup.plan import CONTROLLER, NodePlan
from scara_msgs.msg import TwinControllerState

READY_MODE = TwinControllerState.IDLE
NOT_YET = ("", TwinControllerState.OFFLINE, TwinControllerState.ALIGNING)
"""In these the pair still gets ready by itself; out of the others it may need a person."""
WORKS = (
    READY_MODE,
    TwinControllerState.REAL_LEADS,
    TwinControllerState.TWIN_LEADS,
    TwinControllerState.OPERATOR_LEADS,
)
"""Only a pair that was aligned gets there."""


@dataclass(frozen=True)
class Missing:
    """What one node still lacks."""

    node: str
    what: str


@dataclass(frozen=True)
class SeenCell:
    """What can be seen of the cell at one moment.

    Attributes:
        services: Absolute names that the master knows.
        topics: Absolute names with a publisher.
        ports: TCP ports that somebody listens at.
        mode: Mode of the twin controller, empty if it has not spoken.
        why: Its last decision in words.
    """

    services: frozenset[str] = frozenset()
    topics: frozenset[str] = frozenset()
    ports: frozenset[int] = frozenset()
    mode: str = ""
    why: str = ""


def missing(
    nodes: Iterable[NodePlan], seen: SeenCell, namespace: str = "/", idle: bool = False
) -> tuple[Missing, ...]:
    """List what is not there yet; empty when the cell is ready.

    A robot that runs its own program, has a fault or no drives on keeps the pair from IDLE, and the
    page on which a person would mend that must not end with the start.

    Args:
        nodes: The plan.
        seen: What there is.
        namespace: In which the relative names of the plan are resolved.
        idle: Experiments follow: they begin with a pair that stands.
    """
    nodes = list(nodes)
    found = [Missing(node.name, what) for node in nodes for what in _lacks(node, seen, namespace)]
    settled = seen.mode == READY_MODE if idle else seen.mode not in NOT_YET
    if any(node.name == CONTROLLER for node in nodes) and not settled:
        said = f": it is {seen.mode}" if seen.mode else " (no twin_controller/state yet)"
        why = f" ({seen.why})" if seen.mode and seen.why else ""
        found.append(Missing(CONTROLLER, f"mode {READY_MODE}{said}{why}"))
    return tuple(found)


def _lacks(node: NodePlan, seen: SeenCell, namespace: str) -> list[str]:
    """List what one node does not offer yet."""
    lacks = [
        f"service {name}" for name in node.services if resolve(name, namespace) not in seen.services
    ]
    lacks += [
        f"topic {name}" for name in node.topics if resolve(name, namespace) not in seen.topics
    ]
    if node.port is not None and node.port not in seen.ports:
        lacks.append(f"a listener at port {node.port}")
    return lacks
