"""What stands on the outside of a packet that cannot be read.

It is enough to tell its sender which one it was.
"""

from __future__ import annotations

import json
from typing import Any

import msgspec
from msgspec import UNSET, Raw, Struct, UnsetType

_FIELD_BYTES = 2048  # our choice: longer ids and names are not repeated to the sender
# Our choice: how much is searched of what is no JSON, or nested too deep even to be skipped.
_HEAD_BYTES = 4096
_READER = json.JSONDecoder()
_SPACE = " \t\n\r"
_NAMES = ("op", "id", "service")


class Envelope(Struct, frozen=True):
    """The fields that every packet has, and the service of a call.

    A field is absent where it is missing or of another type.
    """

    op: str | None = None
    id: str | int | UnsetType = UNSET
    service: str | None = None


_OUTSIDE = msgspec.json.Decoder(dict[str, Raw])


def read_envelope(data: bytes) -> Envelope:
    """Read what can be read of a packet that is refused.

    It does not fit, is too long or too deep, or is no valid JSON. The whole is skipped over once.
    Where that fails, its first bytes are searched, up to what is wrong.

    Example:
        >>> read_envelope(b'{"op": "call_service", "id": "a", "args": {"x": NaN}}').id
        'a'
    """
    try:
        outside = _OUTSIDE.decode(data)
        fields = {name: bytes(outside[name]) for name in _NAMES if name in outside}
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        fields = _search(data[:_HEAD_BYTES])
    op, packet_id, service = (_value(fields.get(name, b"")) for name in _NAMES)
    return Envelope(
        op=op if isinstance(op, str) else None,
        id=packet_id
        if isinstance(packet_id, str | int) and not isinstance(packet_id, bool)
        else UNSET,
        service=service if isinstance(service, str) else None,
    )


def _search(head: bytes) -> dict[str, bytes]:
    """Find the fields of the outermost object, one after the other up to what is wrong."""
    text = head.decode("utf-8", "replace")
    found: dict[str, bytes] = {}
    at = _skip(text, 0, _SPACE)
    if text[at : at + 1] != "{":
        return found
    try:
        while True:
            at = _skip(text, at + 1, _SPACE)
            key, at = _READER.raw_decode(text, at)
            at = _skip(text, at, _SPACE)
            if not isinstance(key, str) or text[at : at + 1] != ":":
                return found
            begin = _skip(text, at + 1, _SPACE)
            _, at = _READER.raw_decode(text, begin)
            after = _skip(text, at, _SPACE)
            if text[after : after + 1] not in (",", "}"):  # a number may have been cut off
                return found
            found[key] = text[begin:at].encode()
            if text[after] == "}":
                return found
            at = after
    except (ValueError, RecursionError):
        return found


def _skip(text: str, at: int, letters: str) -> int:
    while at < len(text) and text[at] in letters:
        at += 1
    return at


def _value(field: bytes) -> Any:
    """Decode one field, unless it is too long to be repeated."""
    if not field or len(field) > _FIELD_BYTES:
        return None
    try:
        return msgspec.json.decode(field)
    except (msgspec.DecodeError, UnicodeDecodeError):
        return None
