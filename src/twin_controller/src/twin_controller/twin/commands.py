"""Motion commands to the twin: each is sent again until the twin's pose controller reports it.

A topic loses what is published before its subscribers are connected, as right after a reconnect.
Repeating is safe: a command has a number, and the twin obeys each number once.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from twin_controller.config import Twin
from twin_controller.core.orders.order import GiveUp, Order, Patience, due, send

Packet = Mapping[str, Any]
"""A scara_msgs/MotionCommand as rosbridge carries it; ``id`` is its number."""


class Repeat(NamedTuple):
    """What is to be done about the last command.

    Attributes:
        order: The order from now on; None: nothing is open.
        again: The packet to publish now.
        lost: The packet of a command that is given up.
    """

    order: Order[Packet] | None
    again: Packet | None = None
    lost: Packet | None = None


def patience(config: Twin) -> Patience:
    """Return how long the twin may take to report a command, from twin_controller.yaml."""
    return Patience(config.command_retry_ms * 1e-3, config.command_attempts, GiveUp.SAY_SO)


def told(packet: Packet, limits: Patience, now: float) -> Order[Packet]:
    """Return the order of a command that was published at ``now`` [s]; it replaces an older one."""
    return send(Order(packet, limits), now)


def heard(order: Order[Packet] | None, last_command_id: int, now: float) -> Repeat:
    """Decide what a report of the twin means for the last command.

    Args:
        order: The last command, if it is open.
        last_command_id: Number of the last command that the twin reports as obeyed.
        now: When the report came [s].
    """
    if order is None or is_shown(order.wanted, last_command_id):
        return Repeat(None)
    late = due([order], now)
    if late.failures:
        return Repeat(None, lost=order.wanted)
    if late.sends:
        return Repeat(late.sends[0], again=order.wanted)
    return Repeat(order)


def is_shown(packet: Packet, last_command_id: int) -> bool:
    """Return whether the twin reports this command as the last one that it obeyed."""
    return bool(packet["id"] == last_command_id)


def lost_text(packet: Packet) -> str:
    """Say that a command was given up."""
    return f"the twin does not obey command {packet['id']}: {packet['reason']}"
