"""Which packets stop a robot: they overtake what the same client has sent before."""

from __future__ import annotations

from typing import Any

from rosbridge_gateway.config import Stops
from rosbridge_gateway.protocol import names, packets
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
            names.resolve(name, namespace): frozenset(values)
            for name, values in config.call_service.items()
        }

    def stops(self, packet: Packet) -> bool:
        """Return whether a packet stops a robot, if its client may send it."""
        match packet:
            case packets.Publish():
                return self._is(packet.topic, packet.msg, self._topics)
            case packets.CallService():
                args = packet.args
                if isinstance(args, list):  # in the order of the fields, the command first
                    args = {_FIELD: args[0]} if args else {}
                return self._is(packet.service, args or {}, self._services)
        return False

    def _is(self, written: str, fields: dict[str, Any], known: dict[str, frozenset[Any]]) -> bool:
        command = fields.get(_FIELD)
        if not isinstance(command, str | int):
            return False
        try:
            return command in known.get(names.resolve(written, self._namespace), ())
        except names.NameNotLegalError:
            return False
