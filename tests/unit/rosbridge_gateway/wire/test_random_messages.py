"""Random messages of all types of this machine: what a client gets is what rosbags reads.

rosbags knows ROS's wire form by itself, from the definitions, and shares no code with genpy or us.
"""

from __future__ import annotations

import base64
import dataclasses
import importlib
import io
import random
import re
import struct
from typing import Any

import cbor2
import genpy
import msgspec
import numpy as np
import pytest
import roslib.message
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbridge_gateway.protocol.conversion import Converters
from rosbridge_gateway.wire.cbor import CborEncoder

PACKAGES = (
    *("actionlib", "actionlib_msgs", "control_msgs", "diagnostic_msgs", "geometry_msgs"),
    *("industrial_msgs", "rosgraph_msgs", "scara_msgs", "sensor_msgs", "std_msgs", "tf2_msgs"),
    *("trajectory_msgs", "visualization_msgs"),
)
EACH = 4
SEED = 17
ARRAY = re.compile(r"(.+?)\[(\d*)\]")
BITS = {f"int{bits}": bits for bits in (8, 16, 32, 64)} | {"byte": 8}
FILLER = "structure_needs_at_least_one_member"  # rosbags' own, in messages without fields
LARGEST_SECONDS = 2**31 - 1

CONVERTERS = Converters(roslib.message.get_message_class, None)
ENCODER = CborEncoder(roslib.message.get_message_class)
STORE = get_typestore(Stores.EMPTY)


def types_of(package: str) -> list[type[genpy.Message]]:
    """Return a package's message classes."""
    found = vars(importlib.import_module(f"{package}.msg")).values()
    return [kind for kind in found if isinstance(kind, type) and issubclass(kind, genpy.Message)]


TYPES = [kind for package in PACKAGES for kind in types_of(package)]


def random_value(kind: str, chance: random.Random) -> Any:
    """Return a value of a field type."""
    if array := ARRAY.fullmatch(kind):
        count = int(array[2]) if array[2] else chance.randrange(4)
        values = [random_value(array[1], chance) for _ in range(count)]
        return bytes(values) if array[1] in ("uint8", "char") else values
    if kind in BITS:
        return chance.randrange(-(1 << (BITS[kind] - 1)), 1 << (BITS[kind] - 1))
    if kind.startswith("uint") or kind == "char":
        return chance.randrange(1 << int(kind[4:] if kind != "char" else 8))
    if kind in ("float32", "float64"):
        number = chance.uniform(-1.0, 1.0) * 10.0 ** chance.randrange(-30, 30)
        return struct.unpack("<f", struct.pack("<f", number))[0] if kind == "float32" else number
    if kind == "bool":
        return chance.random() < 0.5
    if kind == "string":
        return "".join(chance.choice('ab/_ \u00e4\u4e16\U0001f916"\\\n') for _ in range(5))
    if kind in ("time", "duration"):
        made = genpy.Time if kind == "time" else genpy.Duration
        return made(chance.randrange(LARGEST_SECONDS), chance.randrange(10**9))
    return random_message(roslib.message.get_message_class(kind), chance)


def random_message(kind: type[genpy.Message], chance: random.Random) -> Any:
    """Return a message whose fields all have a value."""
    return kind(*(random_value(field, chance) for field in kind._slot_types))


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
