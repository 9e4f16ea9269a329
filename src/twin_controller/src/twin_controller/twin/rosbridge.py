"""Packets of the rosbridge v2 protocol, and the wishes that a client sends at each connect."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

REFUSED_AGAIN_S = 1.0
"""A wish that the server refused, because its roscore is away, is sent again after this time.

Our choice."""

Packet = dict[str, Any]


class ServerPacket(msgspec.Struct):
    """Any packet that a rosbridge server sends."""

    op: str
    id: Any = None
    topic: str = ""
    msg: Any = None
    values: Any = None
    result: bool = True
    level: str = ""


_DECODER = msgspec.json.Decoder(ServerPacket)
_ENCODER = msgspec.json.Encoder()


def decode(data: bytes) -> ServerPacket | None:
    """Return a packet of the server, None if it is not one."""
    try:
        return _DECODER.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None


def encode(packet: Mapping[str, Any]) -> bytes:
    """Return a packet as it goes over the wire; NaN becomes ``null``."""
    return _ENCODER.encode(packet)


def subscription(topic: str, type_name: str, throttle_ms: int, queue_length: int) -> Packet:
    """Return the packet that asks for a topic."""
    wish = {"op": "subscribe", "topic": topic, "type": type_name}
    rate = {"throttle_rate": throttle_ms, "queue_length": queue_length}
    return wish | rate | {"id": f"subscribe:{topic}"}


def advertisement(topic: str, type_name: str, latch: bool) -> Packet:
    """Return the packet that announces a topic."""
    wish = {"op": "advertise", "topic": topic, "type": type_name, "latch": latch}
    return wish | {"id": f"advertise:{topic}"}


def publication(topic: str, message: Mapping[str, Any]) -> Packet:
    """Return the packet that publishes a message."""
    return {"op": "publish", "topic": topic, "msg": message}


def service_call(call_id: str, service: str, args: Mapping[str, Any], timeout: float) -> Packet:
    """Return the packet that calls a service."""
    call = {"op": "call_service", "id": call_id, "service": service}
    return call | {"args": args, "timeout": timeout}


class Wishes:
    """Subscriptions and advertisements: sent at each connect, and again when they were refused."""

    def __init__(self) -> None:
        self._standing: dict[str, Packet] = {}
        self._again: dict[str, float] = {}

    def add(self, wish: Packet) -> None:
        """Remember a wish for each connect."""
        self._standing[wish["id"]] = wish

    def begin(self) -> list[Packet]:
        """Return all wishes, for a new connection: no wish has been refused there yet."""
        self._again = {}
        return list(self._standing.values())

    def refuse(self, wish_id: Any, now: float) -> None:
        """Note at ``now`` [s] that the server refused something; it may not have been a wish."""
        if isinstance(wish_id, str) and wish_id in self._standing:
            self._again[wish_id] = now + REFUSED_AGAIN_S

    def due(self, now: float) -> list[Packet]:
        """Take the wishes that were refused a while ago and are to be sent again at ``now`` [s]."""
        ripe = [wish_id for wish_id, due in self._again.items() if due <= now]
        for wish_id in ripe:
            del self._again[wish_id]
        return [self._standing[wish_id] for wish_id in ripe]
