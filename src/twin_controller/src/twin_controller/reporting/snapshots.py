"""Inputs and state of the core as bytes: what a recording holds and a replay reads.

The inputs alone decide, so a state and all inputs since give every later state and decision again. The past decisions are
left out of a state: they are its largest part, nothing is decided by them, and the recording holds them anyway.
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from twin_controller.core.events import AnyEvent
from twin_controller.core.state import CoreState


class SnapshotError(ValueError):
    """Recorded bytes are not what this version of the core writes; the text says where."""


_ENCODER = msgspec.msgpack.Encoder()
_EVENTS = msgspec.msgpack.Decoder(list[AnyEvent])
_STATE = msgspec.msgpack.Decoder(CoreState)


def encode_events(events: Sequence[AnyEvent]) -> bytes:
    """Return a batch of inputs as bytes."""
    return _ENCODER.encode(events)


def decode_events(data: bytes) -> list[AnyEvent]:
    """Return the batch of inputs in ``data``.

    Raises:
        SnapshotError: It holds something else.
    """
    try:
        return _EVENTS.decode(data)
    except msgspec.DecodeError as error:
        raise SnapshotError(f"inputs: {error}") from error


def encode_state(state: CoreState) -> bytes:
    """Return a state without its past decisions as bytes; equal states give equal bytes."""
    return _ENCODER.encode(msgspec.structs.replace(state, decisions=()))


def decode_state(data: bytes) -> CoreState:
    """Return the state in ``data``.

    Raises:
        SnapshotError: It holds something else.
    """
    try:
        return _STATE.decode(data)
    except msgspec.DecodeError as error:
        raise SnapshotError(f"state: {error}") from error


def first_difference(one: CoreState, other: CoreState) -> str:
    """Return the name and both values of the first field in which two states differ; empty if there is none."""
    for name in CoreState.__struct_fields__:
        mine, theirs = getattr(one, name), getattr(other, name)
        if name != "decisions" and _ENCODER.encode(mine) != _ENCODER.encode(theirs):
            return f"{name} = {_shown(mine)} instead of {_shown(theirs)}"
    return ""


def _shown(value: object) -> str:
    """Return a value for people, of bounded length."""
    text = repr(value)
    return text if len(text) <= 200 else f"{text[:197]}..."
