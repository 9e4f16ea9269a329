"""Random messages of all types of this machine: what a client gets is what rosbags reads.

rosbags knows ROS's wire form by itself, from the definitions, and shares no code with genpy or us.
"""

from __future__ import annotations

import base64
import dataclasses
import io
import random
from typing import Any

import cbor2
import genpy
import msgspec
import numpy as np
import pytest
import roslib.message
from harness.clients.random_messages import EACH, PACKAGES, SEED, random_message, types_of
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbridge_gateway.protocol.conversion import Converters
from rosbridge_gateway.wire.cbor import CborEncoder

FILLER = "structure_needs_at_least_one_member"  # rosbags' own, in messages without fields

CONVERTERS = Converters(roslib.message.get_message_class, None)
ENCODER = CborEncoder(roslib.message.get_message_class)
STORE = get_typestore(Stores.EMPTY)
TYPES = [kind for package in PACKAGES for kind in types_of(package)]


def wire_form(message: genpy.Message) -> bytes:
    """Return what ROS carries."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def read_by_rosbags(kind: type[genpy.Message], octets: bytes) -> Any:
    """Return what rosbags reads, as a rosbridge client gets it."""
    name = kind._type.replace("/", "/msg/")
    wanted = get_types_from_msg(kind._full_text, name)
    STORE.register({key: found for key, found in wanted.items() if key not in STORE.fielddefs})
    return _plain(STORE.deserialize_ros1(octets, name))


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        is_text = value.dtype == np.uint8  # rosbridge: base64
        return base64.b64encode(value.tobytes()).decode() if is_text else value.tolist()
    if isinstance(value, list):
        return [_plain(one) for one in value]
    if not dataclasses.is_dataclass(value):
        return value
    if type(value).__name__.startswith("builtin_interfaces"):
        return {"secs": value.sec, "nsecs": value.nanosec}
    _, fields = STORE.fielddefs[value.__msgtype__]
    return {name: _plain(getattr(value, name)) for name, _ in fields if name != FILLER}


NUMPY = {69: "<u2", 70: "<u4", 71: "<u8", 72: "i1", 77: "<i2", 78: "<i4", 79: "<i8"}
NUMPY |= {85: "<f4", 86: "<f8"}


def _of_cbor(value: Any) -> Any:
    """Return CBOR's values as JSON has them."""
    if isinstance(value, cbor2.CBORTag):
        return np.frombuffer(value.value, NUMPY[value.tag]).tolist()
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, dict):
        return {name: _of_cbor(one) for name, one in value.items()}
    return [_of_cbor(one) for one in value] if isinstance(value, list) else value


def test_there_are_more_types_than_were_tried_before() -> None:
    """Of 51 types 204 messages were tried against rosbridge_server."""
    assert len(TYPES) > 51 and len(TYPES) * EACH > 204


@pytest.mark.parametrize("package", PACKAGES)
def test_random_messages_reach_clients_and_come_back_unchanged(package: str) -> None:
    """JSON and CBOR say what rosbags reads; the JSON, sent by a client, is the same message."""
    chance = random.Random(f"{SEED} {package}")
    for kind in types_of(package):
        for _ in range(EACH):
            octets = wire_form(random_message(kind, chance))
            message = kind().deserialize(octets)
            expected = read_by_rosbags(kind, octets)
            text = msgspec.json.encode(CONVERTERS.by_class(kind).to_values(message))
            heard = msgspec.json.decode(text)
            assert heard == expected, kind._type
            assert _of_cbor(cbor2.loads(ENCODER.encode(message))) == expected, kind._type
            assert wire_form(CONVERTERS.by_class(kind).to_message(heard)) == octets, kind._type
