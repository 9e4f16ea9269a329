"""What is read of a packet that cannot be read as a whole."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import UNSET
from rosbridge_gateway.protocol.envelope import Envelope, read_envelope


@pytest.mark.parametrize(
    ("data", "envelope"),
    [
        (
            b'{"op":"call_service","id":"a","service":"/x","args":5}',
            Envelope("call_service", "a", "/x"),
        ),
        (
            b'{"args":[[{"id":"inner"}]],"service":"/x","id":-7,"op":"call_service"}',
            Envelope("call_service", -7, "/x"),
        ),
        (
            b'{"op" : "call_service" , "id":\t"a" , "args":{"id":"inner","x":Infinity}}',
            Envelope("call_service", "a"),
        ),
        (b'{"op":"publish","msg":{"id":"inner"},"id":"a","x":NaN}', Envelope("publish", "a")),
        (
            b'{"op":"publish","msg":["\\"}","{"],"id":"a\\u00e4\\"","x":NaN}',
            Envelope("publish", 'a\u00e4"'),
        ),
        (b'{"op":"call_service","id":"a","args":' + b"[" * 100_000, Envelope("call_service", "a")),
        (b'{"op":5,"id":true,"service":["/x"]}', Envelope()),
        (b'{"op":"publish","id":null}', Envelope("publish")),
        (b'{"op":"publish","id":"' + b"x" * 5000 + b'"}', Envelope("publish")),
        (b'{"op":"publish","id":"cut', Envelope("publish")),
        (b'{"op" "publish","id":"a"}', Envelope()),
        (b'{1:"x","op":"publish","id":"a"}', Envelope()),
        (b'[{"op":"publish","id":"a"}]', Envelope()),
        (b"", Envelope()),
        (b'{"op":"\xff","id":"a"}', Envelope(None, "a")),
    ],
)
def test_outside_is_read_as_far_as_it_goes(data: bytes, envelope: Envelope) -> None:
    """Only the outermost object counts, and values that are short enough to be repeated."""
    assert read_envelope(data) == envelope


@given(st.binary(max_size=300) | st.text('{}[]":,\\ opid12').map(str.encode))
def test_rubbish_is_no_error(data: bytes) -> None:
    """Whatever comes, something is returned."""
    assert isinstance(read_envelope(data), Envelope)


@given(
    st.text(max_size=50),
    st.text(max_size=50),
    st.recursive(st.integers() | st.text(max_size=9), st.lists, max_leaves=5),
)
def test_search_finds_what_decoding_finds(packet_id: str, service: str, args: object) -> None:
    """A packet cut off in its last field says as much as the whole one."""
    text = json.dumps(
        {"op": "call_service", "id": packet_id, "service": service, "args": args}
    ).encode()
    assert (
        read_envelope(text[:-1])
        == read_envelope(text)
        == Envelope("call_service", packet_id, service)
    )


def test_field_that_is_missing_is_unset() -> None:
    """An answer to a packet without an id has none."""
    assert read_envelope(b"{}").id is UNSET
