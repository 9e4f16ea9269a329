"""The rosbridge v2 packets, tested with literal text."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbridge_gateway.protocol import packets
from rosbridge_gateway.protocol.packets import PacketError, depth_exceeds

MAX_BYTES, MAX_DEPTH = 10_000, 10


@pytest.mark.parametrize(
    ("data", "packet"),
    [
        (
            b'{"op":"advertise","topic":"/t","type":"std_msgs/String"}',
            packets.Advertise(topic="/t", type="std_msgs/String"),
        ),
        (
            b'{"op":"advertise","id":"a:1","topic":"/t","type":"T","latch":true,"queue_size":1}',
            packets.Advertise(id="a:1", topic="/t", type="T", latch=True, queue_size=1),
        ),
        (b'{"op":"unadvertise","topic":"/t"}', packets.Unadvertise(topic="/t")),
        (
            b'{"op":"publish","topic":"/t","msg":{"data":null}}',
            packets.Publish(topic="/t", msg={"data": None}),
        ),
        (b'{"op":"publish","topic":"/t"}', packets.Publish(topic="/t")),
        (
            b'{"op":"subscribe","id":7,"topic":"t","throttle_rate":10,'
            b'"queue_length":3,"compression":"none","fragment_size":9}',
            packets.Subscribe(
                id=7,
                topic="t",
                throttle_rate=10,
                queue_length=3,
                compression="none",
                fragment_size=9,
            ),
        ),
        (b'{"op":"unsubscribe","id":null,"topic":"t"}', packets.Unsubscribe(id=None, topic="t")),
        (b'{"op":"call_service","service":"/s"}', packets.CallService(service="/s")),
        (
            b'{"op":"call_service","service":"/s","args":[1,2],"timeout":5}',
            packets.CallService(service="/s", args=[1, 2], timeout=5.0),
        ),
        (
            b'{"op":"advertise_service","service":"/s","type":"T"}',
            packets.AdvertiseService(service="/s", type="T"),
        ),
        (b'{"op":"unadvertise_service","service":"/s"}', packets.UnadvertiseService(service="/s")),
        (
            b'{"op":"service_response","id":"1","service":"/s","result":true,"values":{"a":1}}',
            packets.ServiceResponse(id="1", service="/s", result=True, values={"a": 1}),
        ),
        (b'{"op":"status","level":"info","msg":"x"}', packets.Status(level="info", msg="x")),
        (b'{"op":"set_level","level":"none"}', packets.SetLevel(level="none")),
    ],
)
def test_packet_is_read(data: bytes, packet: packets.Packet) -> None:
    """Every op of rosbridge v2; fields that we do not know are no error."""
    assert packets.decode(data, MAX_BYTES, MAX_DEPTH) == packet


@pytest.mark.parametrize(
    ("data", "text", "packet_id"),
    [
        (b"{", "no valid JSON", packets.UNSET),
        (b"", "no valid JSON", packets.UNSET),
        (b'{"op":"publish","topic":"/t"}x', "no valid JSON", packets.UNSET),
        (b'{"op":"status","level":"info","msg":"\xff"}', "no valid JSON", packets.UNSET),
        (b"[]", "does not fit rosbridge v2", packets.UNSET),
        (b'{"id":"a"}', "missing required field `op`", "a"),
        (b'{"op":"dance","id":"a"}', "Invalid value 'dance' - at `\\$.op`", "a"),
        (b'{"op":3,"id":4}', "Expected `str`", 4),
        (b'{"op":"publish","id":"a","msg":{}}', "missing required field `topic`", "a"),
        (
            b'{"op":"publish","id":"a","topic":"/t","msg":[]}',
            "Expected `object`, got `array` - at `\\$.msg`",
            "a",
        ),
        (b'{"op":"subscribe","id":[1],"topic":"/t"}', "- at `\\$.id`", packets.UNSET),
        (
            b'{"op":"subscribe","id":"a","topic":"/t","throttle_rate":-1}',
            "`int` >= 0 - at `\\$.throttle_rate`",
            "a",
        ),
        (
            b'{"op":"subscribe","id":"a","topic":"/t","fragment_size":0}',
            "`int` >= 1 - at `\\$.fragment_size`",
            "a",
        ),
        (
            b'{"op":"subscribe","id":"a","topic":"/t","queue_length":1e9}',
            "- at `\\$.queue_length`",
            "a",
        ),
        (b'{"op":"set_level","level":"loud"}', "Invalid enum value 'loud'", packets.UNSET),
        (
            b'{"op":"publish","topic":"/t","msg":{"data":"' + b"x" * MAX_BYTES + b'"}}',
            "longer than the allowed 10000",
            packets.UNSET,
        ),
        (
            b'{"op":"publish","id":"a","topic":"/t","msg":{"x":' + b"[" * 10 + b"]" * 10 + b"}}",
            "deeper than the allowed 10",
            "a",
        ),
        (
            b'{"op":"publish","topic":"/t","msg":{"x":' + b"[" * 4000 + b"]" * 4000 + b"}}",
            "deeper than the allowed 10",
            packets.UNSET,
        ),
        (b'{"op":"publish","topic":"/t","msg":{"x":' + b"[" * 5000, "deeper than", packets.UNSET),
        (b"[" * 5000 + b"]" * 5000, "does not fit rosbridge v2", packets.UNSET),
        (b"[" * 5000, "does not fit rosbridge v2", packets.UNSET),
    ],
)
def test_what_is_no_packet_is_refused(data: bytes, text: str, packet_id: packets.PacketId) -> None:
    """The reason names what is wrong; an id that could be read is kept, for its sender."""
    with pytest.raises(PacketError, match=text) as caught:
        packets.decode(data, MAX_BYTES, MAX_DEPTH)
    assert caught.value.packet_id == packet_id


nested = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text('[]{}"\\a'),
    lambda s: st.lists(s) | st.dictionaries(st.text("[{"), s),
)


@given(nested, st.integers(1, 6))
def test_depth_is_that_of_the_value(value: object, limit: int) -> None:
    """Brackets inside strings do not count."""

    def depth(value: object) -> int:
        inner = (
            list(value.values())
            if isinstance(value, dict)
            else value
            if isinstance(value, list)
            else None
        )
        return 0 if inner is None else 1 + max(map(depth, inner), default=0)

    packet = packets.ServiceResponse(service="s", result=True, values=value)
    assert depth_exceeds(packet, limit) == (depth(value) + 1 > limit)


def test_nesting_up_to_the_limit_is_allowed() -> None:
    """The limit itself is fine."""
    data = b'{"op":"publish","topic":"/t","msg":{"x":' + b"[" * 8 + b"]" * 8 + b"}}"
    assert isinstance(packets.decode(data, MAX_BYTES, MAX_DEPTH), packets.Publish)


def test_answer_without_an_id_has_none() -> None:
    """A client that gave no id gets none."""
    assert (
        packets.encode(packets.Status(level="error", msg="x"))
        == b'{"op":"status","level":"error","msg":"x"}'
    )


def test_response_always_has_values() -> None:
    """Clients read `values` without asking whether it is there."""
    data = packets.encode(packets.ServiceResponse(id="1", service="/s", result=True, values={}))
    assert json.loads(data) == {
        "op": "service_response",
        "id": "1",
        "service": "/s",
        "result": True,
        "values": {},
    }


def test_encoded_message_is_wrapped_as_it_is() -> None:
    """One encoding serves all clients, whatever they call the topic."""
    assert json.loads(packets.encode_publish('a"b', b'{"data":1.5}')) == {
        "op": "publish",
        "topic": 'a"b',
        "msg": {"data": 1.5},
    }
