"""CBOR: numbers as numbers, arrays of numbers as typed arrays, all kinds of fields."""

from __future__ import annotations

import io
import math
from typing import Any

import cbor2
import genpy.dynamic
import numpy as np
import pytest
import roslib.message
from geometry_msgs.msg import PoseWithCovariance
from rosbridge_gateway.wire import cbor
from rosbridge_gateway.wire.cbor import CborEncoder
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Float64, String

ENCODER = CborEncoder(roslib.message.get_message_class)
# RFC 8746, section 2: little endian, two's complement, IEEE 754.
DTYPES = {
    69: "<u2",
    70: "<u4",
    71: "<u8",
    72: "i1",
    77: "<i2",
    78: "<i4",
    79: "<i8",
    85: "<f4",
    86: "<f8",
}


def read(octets: bytes) -> Any:
    """Decode CBOR, typed arrays by numpy."""

    def plain(value: Any) -> Any:
        if isinstance(value, cbor2.CBORTag):
            return np.frombuffer(value.value, DTYPES[value.tag]).tolist()
        if isinstance(value, dict):
            return {key: plain(one) for key, one in value.items()}
        return [plain(one) for one in value] if isinstance(value, list) else value

    return plain(cbor2.loads(octets))


def test_every_kind_of_field_arrives() -> None:
    """Alone, as an array and with a fixed length."""
    samples: dict[str, list[Any]] = {
        **{f"int{b}": [-(1 << (b - 1)), -1, (1 << (b - 1)) - 1] for b in (8, 16, 32, 64)},
        **{f"uint{b}": [0, 1, (1 << b) - 1] for b in (8, 16, 32, 64)},
        "float32": [0.5, -math.inf, 1.5],
        "float64": [0.1, math.inf, -3e300],
        "bool": [True, False, True],
        "string": ["", "\u00e4", "x"],
        "byte": [-128, 0, 127],
        "char": [0, 65, 255],
    }
    text = "\n".join(f"{k} a_{k}\n{k}[] b_{k}\n{k}[3] c_{k}\n{k}[] d_{k}" for k in samples)
    message = genpy.dynamic.generate_dynamic("test_msgs/All", text)["test_msgs/All"]()
    for kind, values in samples.items():
        in_bytes = kind in ("uint8", "char")
        many = bytes(values) if in_bytes else values
        setattr(message, f"a_{kind}", values[-1])
        setattr(message, f"b_{kind}", many)
        setattr(message, f"c_{kind}", many)
    found = read(ENCODER.encode(reread(message)))
    for kind, values in samples.items():
        expected = bytes(values) if kind in ("uint8", "char") else values
        assert found[f"a_{kind}"] == values[-1], kind
        assert found[f"b_{kind}"] == expected == found[f"c_{kind}"], kind
        assert found[f"d_{kind}"] == (b"" if kind in ("uint8", "char") else []), kind


def reread(message: Any) -> Any:
    """Return a message as it comes out of ROS."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return type(message)().deserialize(buffer.getvalue())


def test_nested_messages_times_and_names_arrive() -> None:
    """A joint state as a viewer gets it."""
    message = JointState(name=["joint_1"], position=[0.5, 1.5])
    message.header.stamp.secs, message.header.frame_id = 7, "base_link"
    found = read(ENCODER.encode(reread(message)))
    assert found == {
        "header": {"seq": 0, "stamp": {"secs": 7, "nsecs": 0}, "frame_id": "base_link"},
        "name": ["joint_1"],
        "position": [0.5, 1.5],
        "velocity": [],
        "effort": [],
    }


def test_not_a_number_stays_one() -> None:
    """JSON has none, CBOR has."""
    assert math.isnan(read(ENCODER.encode(Float64(math.nan)))["data"])


def test_fixed_array_is_typed_and_bytes_are_bytes() -> None:
    """Covariances and pixels cost no more than in ROS."""
    covariance = ENCODER.encode(PoseWithCovariance(covariance=[float(n) for n in range(36)]))
    assert b"\xd8\x56\x59\x01\x20" in covariance  # tag 86, 288 bytes
    assert read(covariance)["covariance"] == list(range(36))
    assert read(ENCODER.encode(Image(data=b"\x00\xff")))["data"] == b"\x00\xff"


def test_packet_is_one_map_byte_by_byte() -> None:
    """RFC 8949: a3 map of 3, 60+n text of n characters."""
    packet = cbor.publish_packet("/t", ENCODER.encode(String("x")))
    assert packet == (b"\xa3\x62op\x67publish\x65topic\x62/t\x63msg" + b"\xa1\x64data\x61x")
    raw = cbor2.loads(cbor.publish_packet("/t", cbor.raw_message(1, 2, b"\x05")))
    assert raw["msg"] == {"secs": 1, "nsecs": 2, "bytes": b"\x05"}


def test_unknown_type_is_told() -> None:
    """The message is counted as an error, not sent in part."""
    with pytest.raises(LookupError, match="unknown type std_msgs/Header"):
        CborEncoder(lambda _: None).encode(JointState())
