"""Inputs and state of the core as bytes: what a recording holds and a replay reads.

The inputs alone decide, so a state and all inputs since give every later state and decision again.
The past decisions are left out of a state: they are its largest part, nothing is decided by them,
and the recording holds them anyway.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import msgspec

from twin_controller.config import TwinControllerConfig
from twin_controller.core.events import AnyEvent
from twin_controller.core.state import CoreState


class SnapshotError(ValueError):
    """Recorded bytes are not what this version of the core writes; the text says where."""


OLD_INPUTS = (
    "inputs: recorded by another version: {error}; "
    "replay the recording with that version, or record again with this one"
)
OLD_STATE = (
    "state: recorded by an older version: its states cannot be read; "
    "replay the recording with that version, or record again with this one"
)

_ENCODER = msgspec.msgpack.Encoder()
_EVENTS = msgspec.msgpack.Decoder(list[AnyEvent])
_STATE = msgspec.msgpack.Decoder(CoreState)


def encode_events(events: Sequence[AnyEvent]) -> bytes:
    """Return a batch of inputs as bytes."""
    return _ENCODER.encode(events)


def latest(events: Iterable[AnyEvent], default: float) -> float:
    """Return the time of the newest of some inputs, else ``default`` [s, controller's clock].

    The last one in order is not always it: a command bears the time at which it came in.
    """
    return max((event.now for event in events), default=default)


def decode_events(data: bytes) -> list[AnyEvent]:
    """Return the batch of inputs in ``data``.

    Raises:
        SnapshotError: It holds something else.
    """
    try:
        return _EVENTS.decode(data)
    except msgspec.ValidationError as error:
        raise SnapshotError(OLD_INPUTS.format(error=error)) from error
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise SnapshotError(f"inputs: {error}") from error


def encode_state(state: CoreState) -> bytes:
    """Return a state without its past decisions as bytes; equal states give equal bytes."""
    lead = msgspec.structs.replace(state.lead, decisions=())
    return _ENCODER.encode(msgspec.structs.replace(state, lead=lead))


def decode_state(data: bytes) -> CoreState:
    """Return the state in ``data``.

    Raises:
        SnapshotError: It holds something else, or a state of an older version.
    """
    try:
        return _STATE.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        if _is_old(data):
            raise SnapshotError(OLD_STATE) from error
        raise SnapshotError(f"state: {error}") from error


def _is_old(data: bytes) -> bool:
    """Return whether an older version recorded the bytes: all parts are there, or it had none."""
    try:
        state = msgspec.msgpack.decode(data)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return False
    if not isinstance(state, dict):
        return False
    return "mode_since" in state or state.keys() >= set(CoreState.__struct_fields__)


def first_difference(one: CoreState, other: CoreState) -> str:
    """Return name and both values of the first field that differs; empty if there is none."""
    mine, theirs = _fields(one), _fields(other)
    for name, value in mine.items():
        if _ENCODER.encode(value) != _ENCODER.encode(theirs[name]):
            return f"{name} = {_shown(value)} instead of {_shown(theirs[name])}"
    return ""


def _fields(state: CoreState) -> dict[str, object]:
    """Return the fields of all parts by their names, such as ``lead.mode``; no past decisions."""
    parts = msgspec.structs.asdict(state)
    named = {
        f"{part}.{name}": value
        for part, fields in parts.items()
        for name, value in msgspec.structs.asdict(fields).items()
    }
    del named["lead.decisions"]
    return named


def _shown(value: object) -> str:
    """Return a value for people, of bounded length."""
    text = repr(value)
    return text if len(text) <= 200 else f"{text[:197]}..."


def recorded_choices(text: str, config: TwinControllerConfig) -> str:
    """Return the text of twin_controller.yaml with the choices in force, as it is recorded.

    The robot's address decides whether it may be led, so a replay needs it.
    """
    # In the text itself: the recording keeps the comments with their sources.
    text = re.sub(r"^  host:\s*\S+", f"  host: {config.real.host}", text, count=1, flags=re.M)
    line = f"links: {config.links}"
    said, count = re.subn(r"^links:\s*\w+", line, text, count=1, flags=re.MULTILINE)
    if count or config.links == "strict":
        return said
    return f"{text.rstrip()}\n{line}\n"
