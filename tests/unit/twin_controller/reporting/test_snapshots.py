"""Inputs and states survive the way through a recording, bit for bit."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import Pair
from harness.parts import changed
from harness.recording import eventful
from twin_controller.reporting.snapshots import (
    SnapshotError,
    decode_events,
    decode_state,
    encode_events,
    encode_state,
    first_difference,
)


def test_every_state_of_an_eventful_run_survives_encoding() -> None:
    """It reads back as the same bytes and fields, infinities included."""
    recording = eventful(Pair(), batch=7, every=1)
    assert len(recording.inputs) > 100
    for message in recording.inputs:
        state = decode_state(message.state)
        assert encode_state(state) == message.state
        events = decode_events(message.data)
        assert encode_events(events) == message.data


def test_the_past_decisions_are_left_out_of_a_state(pair: Pair) -> None:
    """Nothing is decided by them, and they are recorded as messages of their own."""
    assert pair.state.lead.decisions
    again = decode_state(encode_state(pair.state))
    assert again.lead.decisions == ()
    assert first_difference(again, pair.state) == ""


def test_the_first_different_field_is_named_with_both_values() -> None:
    """A replay that goes astray shows where."""
    pair = Pair()
    other = changed(pair.state, lead__leader="twin")
    assert first_difference(pair.state, other) == "lead.leader = '' instead of 'twin'"


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x01", b"\x91\x81\xa4kind\xa5dance"])
def test_foreign_bytes_are_refused(data: bytes) -> None:
    """A recording of another version is named, not misread."""
    with pytest.raises(SnapshotError, match="inputs: "):
        decode_events(data)
    with pytest.raises(SnapshotError, match="state: "):
        decode_state(data)


@pytest.mark.parametrize(
    "old",
    [
        {"lag": 0.0183, "mode": "IDLE", "leader": "", "mode_since": 3.5, "real": {}, "twin": {}},
        {"sides": {}, "lead": {}, "orders": {}, "safety": {}, "follow": {"lag": 0.0183}},
        {
            "sides": {"real": {"history": [{"t": 3.5, "q": [0.0], "qdot": [0.0]}]}},
            **{part: {} for part in ("lead", "orders", "safety", "follow")},
        },
    ],
)
def test_a_state_of_an_older_version_is_refused_with_what_to_do(old: dict[str, object]) -> None:
    """Once a state was flat, later it had one lag, then samples of their own shape."""
    wanted = "state: recorded by an older version: its states cannot be read; replay the recording"
    with pytest.raises(SnapshotError, match=wanted):
        decode_state(msgspec.msgpack.encode(old))


def test_inputs_of_another_version_are_refused_with_what_to_do() -> None:
    """A joint state of the twin had fields of its own once."""
    old = {"kind": "twin", "now": 3.5, "stamp": 100.5, "q": [0.0], "qdot": [0.0]}
    wanted = "inputs: recorded by another version: .*`motion`.*; replay the recording with that"
    with pytest.raises(SnapshotError, match=wanted):
        decode_events(msgspec.msgpack.encode([old]))


def test_text_that_is_none_is_refused(pair: Pair) -> None:
    """A byte of a recording was damaged: what reads it says so, and does not break off."""
    data = encode_state(changed(pair.state, lead__leader="xylo"))
    with pytest.raises(SnapshotError, match="state: 'utf-8' codec"):
        decode_state(data.replace(b"xylo", b"\xffylo"))
    with pytest.raises(SnapshotError, match="inputs: 'utf-8' codec"):
        decode_events(msgspec.msgpack.encode([{"kind": "xylo"}]).replace(b"xylo", b"\xffylo"))


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x01", b"\x80", b"\x81\xa5sides\x80"])
def test_bytes_that_are_no_state_are_refused(data: bytes) -> None:
    """Empty, broken, or a state with a part missing: none of them passes for a fresh one."""
    with pytest.raises(SnapshotError, match=r"state: (?!recorded)"):
        decode_state(data)
