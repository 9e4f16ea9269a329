"""Which packets stop a robot, overtaking what their client has sent; and who moves one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rosbridge_gateway.config import Driving, Stops
from rosbridge_gateway.protocol import names, packets
from rosbridge_gateway.protocol.names import any_of, patterns_in
from rosbridge_gateway.protocol.packets import Packet

_FIELD = "command"


class StopRules:
    """The stops of gateway.yaml in one namespace."""

    def __init__(self, config: Stops, namespace: str) -> None:
        self._namespace = namespace
        self._topics = {
            names.resolve(name, namespace): frozenset(values)
            for name, values in config.publish.items()
        }
        self._services = {
            names.resolve(name, namespace): frozenset(map(_as_read, values))
            for name, values in config.call_service.items()
        }

    def stops(self, packet: Packet) -> bool:
        """Return whether a packet stops a robot, if its client may send it."""
        match packet:
            case packets.Publish():
                return self._is(packet.topic, packet.msg.get(_FIELD), self._topics)
            case packets.CallService():
                args = packet.args or {}
                if isinstance(args, list):  # in the order of the fields, the command first
                    args = {_FIELD: args[0]}
                return self._is(packet.service, _as_read(args.get(_FIELD)), self._services)
        return False

    def _is(self, written: str, command: Any, known: dict[str, frozenset[Any]]) -> bool:
        try:
            values = known.get(names.resolve(written, self._namespace))
        except names.NameNotLegalError:
            return False
        if values is None:
            return False
        # None named: a stop without words.
        return not values or (isinstance(command, str | int) and command in values)


def _as_read(command: Any) -> Any:
    """Return a command of a call as its service reads it."""
    return command.strip().upper() if isinstance(command, str) else command


class Drivers:
    """The roles and topics of gateway.yaml that move the robot, in one namespace."""

    def __init__(self, driving: Driving, namespace: str) -> None:
        self._roles = frozenset(driving.roles)
        self._topics = any_of(patterns_in(driving.topics, namespace))

    def drives(self, role: str, advertised: Iterable[str]) -> bool:
        """Tell whether a client moves the robot.

        Args:
            role: Role of the client.
            advertised: Absolute names of the topics that it publishes.
        """
        return role in self._roles or any(self._topics.match(name) for name in advertised)
