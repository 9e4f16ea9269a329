"""ROS messages to JSON and back."""

from __future__ import annotations

import io
import math
from typing import Any

import msgspec
import pytest
import roslib.message
from geometry_msgs.msg import PoseWithCovariance
from hypothesis import given
from hypothesis import strategies as st
from rosbridge_gateway.protocol.conversion import Arrival, ConversionError, Converters
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import (
    Bool,
    Byte,
    ByteMultiArray,
    Char,
    Duration,
    Empty,
    Float32,
    Float64,
    Int8,
    Int16,
    Int32,
    Int64,
    String,
    Time,
    UInt8,
    UInt16,
    UInt32,
    UInt64,
)

from control_msgs.msg import FollowJointTrajectoryActionGoal
from scara_msgs.msg import CoreInput, MotionCommand, TwinControllerState
from scara_msgs.srv import MoveToRequest

CONVERTERS = Converters(roslib.message.get_message_class, lambda: (12, 34))


def values_of(message: Any) -> Any:
    """Return what a client gets to see, by way of the JSON text."""
    return msgspec.json.decode(
        msgspec.json.encode(CONVERTERS.by_class(type(message)).to_values(message))
    )


def message_of(kind: type[Any], values: Any) -> Any:
    """Return the message of a client's values, after ROS's own serialisation."""
    message = CONVERTERS.by_class(kind).to_message(values)
    return reread(message)


def reread(message: Any) -> Any:
    """Serialise and read back a message."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return type(message)().deserialize(buffer.getvalue())


finite = st.floats(allow_nan=False, allow_infinity=False)


@given(
    st.lists(finite),
    st.lists(st.text(st.characters(codec="utf-8"))),
    st.integers(0, 2**32 - 1),
    st.integers(0, 999_999_999),
)
def test_joint_state_survives_both_ways(
    position: list[float], name: list[str], secs: int, nsecs: int
) -> None:
    """To JSON, back, and through ROS's serialisation: the same message."""
    message = JointState(name=name, position=position)
    message.header.stamp.secs, message.header.stamp.nsecs = secs, nsecs
    assert message_of(JointState, values_of(reread(message))) == reread(message)


def test_nested_messages_survive_both_ways() -> None:
    """Arrays of messages, strings and numbers inside each other."""
    values = {
        "mode": "IDLE",
        "name": ["joint_1"],
        "deviation": [0.25],
        "diverged": True,
        "links": [{"name": "real", "connected": True, "age": 0.5, "samples": 3}, {"name": "twin"}],
    }
    message = message_of(TwinControllerState, values)
    assert [link.name for link in message.links] == ["real", "twin"]
    assert message.links[0].samples == 3 and message.links[1].samples == 0
    assert message_of(TwinControllerState, values_of(message)) == message


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_json_cannot_say_is_null_on_the_wire(value: float) -> None:
    """NaN and infinities leave as null, in fields and arrays."""
    assert values_of(Float64(value)) == {"data": None}
    assert values_of(JointState(position=[1.0, value]))["position"] == [1.0, None]


def test_null_comes_in_as_nan() -> None:
    """A null is NaN for every float field."""
    assert math.isnan(message_of(Float64, {"data": None}).data)
    assert math.isnan(message_of(Float32, {"data": None}).data)
    assert math.isnan(message_of(JointState, {"position": [None]}).position[0])


def test_bytes_are_base64_both_ways() -> None:
    """Arrays of uint8 are base64 text; a list of numbers is understood too."""
    message = reread(Image(data=bytes([0, 127, 255])))
    assert values_of(message)["data"] == "AH//"
    assert message_of(Image, {"data": "AH//"}).data == b"\x00\x7f\xff"
    assert message_of(Image, {"data": [0, 127, 255]}).data == b"\x00\x7f\xff"
    assert values_of(reread(CoreInput(data=b"\x01")))["data"] == "AQ=="


def test_times_are_seconds_and_nanoseconds() -> None:
    """They go as {secs, nsecs}; a missing part is 0."""
    assert values_of(message_of(Time, {"data": {"secs": 5}})) == {"data": {"secs": 5, "nsecs": 0}}
    assert values_of(message_of(Duration, {"data": {"secs": -5, "nsecs": 1}})) == {
        "data": {"secs": -5, "nsecs": 1}
    }


def test_missing_fields_keep_their_defaults() -> None:
    """A caller names what it means, the rest is ROS's default."""
    request = message_of(MoveToRequest, {"x": 0.51, "y": 0.16})
    assert (request.x, request.y, request.z, request.speed_percent, request.elbow) == (
        0.51,
        0.16,
        0.0,
        0.0,
        "",
    )


def test_arguments_may_be_a_list_in_field_order() -> None:
    """A call of rosbridge may have positional arguments."""
    assert message_of(MoveToRequest, [0.5, 0.1, 0.0, 10.0, "lefty"]).elbow == "lefty"
    assert message_of(MoveToRequest, [0.5, 0.1]) == MoveToRequest(x=0.5, y=0.1)
    assert message_of(MoveToRequest, []) == MoveToRequest() == message_of(MoveToRequest, None)


def stamp_of(header: dict[str, Any]) -> tuple[int, int]:
    """Return the stamp that a header gets."""
    stamp = message_of(JointState, {"header": header}).header.stamp
    return stamp.secs, stamp.nsecs


@pytest.mark.parametrize(("said", "asked"), [(0.0, 100.0), (99.5, 99.5), (100.1, 100.1)])
def test_a_stop_stays_as_new_as_it_is(said: float, asked: float) -> None:
    """It was given while the gateway stood still, from 100.0 on: behind what waited beside it."""
    converter = CONVERTERS.by_class(MotionCommand)
    assert converter.to_message({"asked": said}, Arrival(100.0, (12, 34))).asked == asked


@pytest.mark.parametrize(
    ("said", "asked"),
    [({}, 100.0), ({"asked": 0.0}, 100.0), ({"asked": 99.5}, 99.5), ({"asked": 1e9}, 100.0)]
    + [({"asked": None}, 100.0), ({"asked": -1.0}, 100.0)],
)
def test_request_says_when_its_packet_came(said: dict[str, Any], asked: float) -> None:
    """Unless its sender has said when it was asked for, on this machine, and not in the future."""
    converter = CONVERTERS.by_class(MoveToRequest)
    assert converter.to_message(said, Arrival(100.0, (12, 34))).asked == asked
    assert converter.to_message([0.5, 0.1, 0.1], Arrival(100.0, (12, 34))).asked == 100.0


def test_type_tells_whether_its_messages_say_when() -> None:
    """By a header, or by the field ``asked``."""
    says = {
        kind: CONVERTERS.by_class(kind).says_when for kind in (JointState, MoveToRequest, Float64)
    }
    assert says == {JointState: True, MoveToRequest: True, Float64: False}


def test_header_without_a_stamp_gets_the_present_time() -> None:
    """A stamp that is given stays, also 0; a message without a header at all keeps 0."""
    for header in ({}, {"frame_id": "base_link"}, {"stamp": {}}, {"stamp": None}, {"stamp": "now"}):
        assert stamp_of(header) == (12, 34)
    assert stamp_of({"stamp": {"secs": 5}}) == (5, 0) and stamp_of({"stamp": {"secs": 0}}) == (0, 0)
    assert message_of(JointState, {}).header.stamp.secs == 0
    arrived = Arrival(100.0, (56, 78))
    for values in ({}, {"header": {}}, {"header": {"stamp": {"secs": 0, "nsecs": 0}}}):
        stamp = CONVERTERS.by_class(JointState).to_message(values, arrived).header.stamp
        assert (stamp.secs, stamp.nsecs) == (56, 78), "published: when the packet came"
    given = {"header": {"stamp": {"secs": 5}}}
    assert CONVERTERS.by_class(JointState).to_message(given, arrived).header.stamp.secs == 5
    assert message_of(Time, {}).data.secs == 0
    assert message_of(Time, {"data": "now"}).data.nsecs == 34
    strict = Converters(roslib.message.get_message_class, None).by_class(JointState)
    assert strict.to_message({"header": {}}).header.stamp.secs == 0
    with pytest.raises(ConversionError, match=r"header.stamp = 'now': allowed: an object"):
        strict.to_message({"header": {"stamp": "now"}})
    goal = message_of(FollowJointTrajectoryActionGoal, {"goal": {"trajectory": {"header": {}}}})
    assert goal.goal.trajectory.header.stamp.secs == 12 and goal.header.stamp.secs == 0


def test_integers_are_numbers_too() -> None:
    """JavaScript writes 1 for 1.0."""
    assert message_of(Float64, {"data": 1}).data == 1.0


@pytest.mark.parametrize(
    ("kind", "lowest", "highest"),
    [
        (Byte, -128, 127),
        (Char, 0, 255),
        (Int8, -(2**7), 2**7 - 1),
        (Int16, -(2**15), 2**15 - 1),
        (Int32, -(2**31), 2**31 - 1),
        (Int64, -(2**63), 2**63 - 1),
        (UInt8, 0, 2**8 - 1),
        (UInt16, 0, 2**16 - 1),
        (UInt32, 0, 2**32 - 1),
        (UInt64, 0, 2**64 - 1),
    ],
)
def test_an_integer_may_be_what_its_type_holds_and_no_more(
    kind: Any, lowest: int, highest: int
) -> None:
    """The smallest and the largest go over the wire; the next ones are refused with the range."""
    for number in (lowest, highest):
        assert reread(message_of(kind, {"data": number})).data == number
    for number in (lowest - 1, highest + 1):
        with pytest.raises(ConversionError, match=f"data = {number}: allowed: .*{highest}"):
            message_of(kind, {"data": number})


@pytest.mark.parametrize(
    ("kind", "lowest", "highest"),
    [(Time, (0, 0), (2**32 - 1, 999_999_999)), (Duration, (-(2**31), 0), (2**31 - 1, 999_999_999))],
)
def test_a_time_may_be_what_its_words_hold_and_no_more(
    kind: Any, lowest: tuple[int, int], highest: tuple[int, int]
) -> None:
    """Seconds and nanoseconds at their bounds; a second beyond is refused."""
    for secs, nsecs in (lowest, highest):
        data = message_of(kind, {"data": {"secs": secs, "nsecs": nsecs}}).data
        assert (data.secs, data.nsecs) == (secs, nsecs)
    for secs in (lowest[0] - 1, highest[0] + 1):
        with pytest.raises(ConversionError, match=f"secs.*{secs}"):
            message_of(kind, {"data": {"secs": secs, "nsecs": 0}})


def test_message_without_fields_is_an_empty_object() -> None:
    """Such as std_msgs/Empty."""
    assert values_of(Empty()) == {} and message_of(Empty, {}) == Empty()


@pytest.mark.parametrize(
    ("kind", "values", "text"),
    [
        (String, {"dta": "x"}, "dta: unknown field: allowed: data"),
        (
            JointState,
            {"header": {"stamp": {"sec": 1}}},
            r"header.stamp = \{'sec': 1\}: allowed: an object with secs, nsecs",
        ),
        (
            JointState,
            {"header": {"frame": ""}},
            "header.frame: unknown field: allowed: seq, stamp, frame_id",
        ),
        (JointState, {"position": [1.0, "2"]}, r"position\[1\] = '2': allowed: a number within"),
        (JointState, {"position": [True]}, r"position\[0\] = True: allowed: a number"),
        (JointState, {"position": 1.0}, "position = 1.0: allowed: an array"),
        (JointState, {"name": [None]}, r"name\[0\] = None: allowed: a text"),
        (
            JointState,
            [{}, [], [], [], [], 1],
            "6 values for the fields header, name, .*, effort: allowed: at most 5",
        ),
        (Empty, [1], "1 values for the fields none: allowed: at most 0"),
        (Duration, {"data": "now"}, "data = 'now': allowed: an object with secs, nsecs$"),
        (Time, {"data": "then"}, 'data = .then.: allowed: .* secs, nsecs, or "now"'),
        (JointState, "x", "message = 'x': allowed: an object with header, name"),
        (
            TwinControllerState,
            {"links": [{}, {"samples": -1}]},
            r"links\[1\].samples = -1: allowed: an integer 0..4294967295",
        ),
        (
            PoseWithCovariance,
            {"covariance": [0.0] * 35},
            "covariance = .*: allowed: an array of 36",
        ),
        (Int8, {"data": 128}, "data = 128: allowed: an integer -128..127"),
        (UInt8, {"data": -1}, "data = -1: allowed: an integer 0..255"),
        (UInt8, {"data": 1.0}, "data = 1.0: allowed: an integer"),
        (UInt8, {"data": True}, "data = True: allowed: an integer"),
        (UInt64, {"data": 2**64}, "allowed: an integer 0..18446744073709551615"),
        (ByteMultiArray, {"data": [200]}, r"data\[0\] = 200: allowed: an integer -128..127"),
        (Float32, {"data": 1e39}, r"data = 1e\+39: allowed: a number within \+-3.403e\+38 or null"),
        (Float64, {"data": 10**400}, "allowed: a number within"),
        (Bool, {"data": 1}, "data = 1: allowed: true or false"),
        (Time, {"data": {"secs": -1}}, "data.secs = -1: allowed: an integer 0..4294967295"),
        (
            Time,
            {"data": {"nsecs": 10**9}},
            "data.nsecs = 1000000000: allowed: an integer 0..999999999",
        ),
        (Image, {"data": "=="}, "data = '==': allowed: base64 text"),
        (Image, {"data": [256]}, r"data\[0\] = 256: allowed: an integer 0..255"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_path(
    kind: type[Any], values: Any, text: str
) -> None:
    """A refusal names where in the message, what came and what is allowed."""
    with pytest.raises(ConversionError, match=text):
        CONVERTERS.by_class(kind).to_message(values)


@pytest.mark.parametrize("name", ["no_such_package/Type", "std_msgs/NoSuchType", "JustAName", ""])
def test_unknown_type_is_refused_by_name(name: str) -> None:
    """A type that no package here has."""
    with pytest.raises(ConversionError, match=f"unknown type '{name}'"):
        CONVERTERS.by_name(name)


def test_converter_is_compiled_once() -> None:
    """Conversion of a stream does not look at types again."""
    assert CONVERTERS.by_name("sensor_msgs/JointState") is CONVERTERS.by_class(JointState)


def test_fixed_byte_array_counts() -> None:
    """A fixed count holds for base64 too."""

    class Fixed:
        __slots__ = ["data"]
        _slot_types = ("uint8[4]",)
        _type = "test/Fixed"

    with pytest.raises(ConversionError, match="data has 3 bytes: allowed: 4"):
        CONVERTERS.by_class(Fixed).to_message({"data": "AH//"})
