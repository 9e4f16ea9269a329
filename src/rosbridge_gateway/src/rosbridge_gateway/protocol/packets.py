"""The packets of rosbridge v2: JSON text to typed values and back.

Source:
    rosbridge v2 protocol specification (RobotWebTools/rosbridge_suite, ROSBRIDGE_PROTOCOL.md).
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import UNSET, Meta, Struct, UnsetType

from rosbridge_gateway.protocol.envelope import read_envelope

PacketId = str | int | None | UnsetType
Level = Literal["info", "warning", "error", "none"]
FragmentSize = Annotated[int, Meta(ge=1)]


class _Packet(Struct, frozen=True, kw_only=True, tag_field="op"):
    id: PacketId = UNSET


class Advertise(_Packet, frozen=True, kw_only=True, tag="advertise"):
    """The client is going to publish ``topic``."""

    topic: str
    type: str
    latch: bool = False
    queue_size: Annotated[int, Meta(ge=0, le=10_000)] = 100


class Unadvertise(_Packet, frozen=True, kw_only=True, tag="unadvertise"):
    """The client publishes ``topic`` no more."""

    topic: str


class Publish(_Packet, frozen=True, kw_only=True, tag="publish"):
    """One message, in either direction."""

    topic: str
    msg: dict[str, Any] = {}


class Subscribe(_Packet, frozen=True, kw_only=True, tag="subscribe"):
    """The client wants ``topic``.

    ``throttle_rate`` is the least time between two messages [ms]; ``fragment_size`` the most
    characters in one piece.
    """

    topic: str
    type: str | None = None
    throttle_rate: Annotated[int, Meta(ge=0, le=3_600_000)] = 0
    queue_length: Annotated[int, Meta(ge=0, le=10_000)] = 0
    compression: str | None = None
    fragment_size: FragmentSize | None = None


class Unsubscribe(_Packet, frozen=True, kw_only=True, tag="unsubscribe"):
    """The client wants ``topic`` no more; with an id only that subscription ends."""

    topic: str


class CallService(_Packet, frozen=True, kw_only=True, omit_defaults=True, tag="call_service"):
    """A service call, in either direction; ``timeout`` [s]."""

    service: str
    args: dict[str, Any] | list[Any] | None = None
    timeout: Annotated[float, Meta(ge=0.0, le=86_400.0)] | None = None
    fragment_size: FragmentSize | None = None


class PacketError(ValueError):
    """What came is no packet.

    Attributes:
        packet_id: Its id as far as it could be read.
        call: Who waits for an answer, when it was meant as a service call: its id and service, as
            far as they could be read.
    """

    def __init__(self, reason: str, data: bytes) -> None:
        super().__init__(reason)
        outside = read_envelope(data)
        self.packet_id = outside.id
        self.call = (
            CallService(id=outside.id, service=outside.service or "")
            if outside.op == "call_service"
            else None
        )


class AdvertiseService(_Packet, frozen=True, kw_only=True, tag="advertise_service"):
    """The client answers calls of ``service``."""

    service: str
    type: str


class UnadvertiseService(_Packet, frozen=True, kw_only=True, tag="unadvertise_service"):
    """The client answers calls of ``service`` no more."""

    service: str


class ServiceResponse(_Packet, frozen=True, kw_only=True, tag="service_response"):
    """The answer to a call; when ``result`` is false, ``values`` may be the reason in words."""

    service: str
    result: bool
    values: Any = None


class Status(_Packet, frozen=True, kw_only=True, tag="status"):
    """A remark on a packet."""

    level: Level
    msg: str


class Fragment(_Packet, frozen=True, kw_only=True, tag="fragment"):
    """Piece ``num`` of ``total`` of another packet's JSON text; all pieces have the same id."""

    data: str
    num: Annotated[int, Meta(ge=0)]
    total: Annotated[int, Meta(ge=1, le=100_000)]


class Png(_Packet, frozen=True, kw_only=True, tag="png"):
    """Another packet's JSON text as an image: its bytes are the pixels."""

    data: str


class SetLevel(_Packet, frozen=True, kw_only=True, tag="set_level"):
    """Which ``status`` packets the client wants."""

    level: Level


Packet = (
    Advertise
    | Unadvertise
    | Publish
    | Subscribe
    | Unsubscribe
    | CallService
    | AdvertiseService
    | UnadvertiseService
    | ServiceResponse
    | Status
    | SetLevel
    | Fragment
    | Png
)


_DECODER: msgspec.json.Decoder[Packet] = msgspec.json.Decoder(Packet)
_ENCODER = msgspec.json.Encoder()


def decode(data: bytes, max_bytes: int, max_depth: int) -> Packet:
    """Read one packet.

    Args:
        data: UTF-8 JSON text.
        max_bytes: Longest allowed ``data``.
        max_depth: Deepest allowed nesting of brackets; the packet itself is 1.

    Raises:
        PacketError: Too long, too deep, no JSON, unknown ``op``, a missing field or a wrong type.
    """
    if len(data) > max_bytes:
        raise PacketError(
            f"packet of {len(data)} bytes is longer than the allowed {max_bytes}", data
        )
    try:
        packet = _DECODER.decode(data)
    except msgspec.ValidationError as error:
        raise PacketError(f"packet does not fit rosbridge v2: {error}", data) from error
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise PacketError(f"packet is no valid JSON: {error}", data) from error
    except RecursionError as error:
        raise PacketError(f"packet is nested deeper than the allowed {max_depth}", data) from error
    if depth_exceeds(packet, max_depth):
        raise PacketError(f"packet is nested deeper than the allowed {max_depth}", data)
    return packet


def depth_exceeds(packet: Packet, limit: int) -> bool:
    """Tell whether objects and arrays of a packet nest deeper than ``limit``; it is 1 itself."""
    match packet:
        case Publish():
            inner: Any = packet.msg
        case CallService():
            inner = packet.args
        case ServiceResponse():
            inner = packet.values
        case _:
            return False
    level = [inner] if isinstance(inner, dict | list) else []
    for _ in range(limit - 1):
        if not level:
            return False
        level = [
            child
            for value in level
            for child in (value.values() if type(value) is dict else value)
            if type(child) is dict or type(child) is list
        ]
    return bool(level)


def encode(packet: Packet) -> bytes:
    """Write one packet as JSON; NaN and infinities become ``null``."""
    return _ENCODER.encode(packet)


def encode_publish(topic: str, message: bytes) -> bytes:
    """Write a ``publish`` packet around a message that is JSON already.

    The message is then encoded once for all clients.
    """
    return b'{"op":"publish","topic":' + _ENCODER.encode(topic) + b',"msg":' + message + b"}"
