"""ROS messages as CBOR: numbers stay numbers, arrays of numbers become typed arrays.

NaN and infinities are CBOR's own, ``uint8[]`` and ``char[]`` byte strings, time and duration maps
of ``secs`` and ``nsecs``.

Source:
    RFC 8949 (CBOR), RFC 8746 (typed arrays: the tags, all little endian).
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from typing import Any

import cbor2

Encode = Callable[[Any], Any]

# Tag and element of a typed array, by ROS type; uint8 and char are plain byte strings.
_TYPED_ARRAYS = {
    "uint16": (69, "H"),
    "uint32": (70, "I"),
    "uint64": (71, "Q"),
    "byte": (72, "b"),
    "int8": (72, "b"),
    "int16": (77, "h"),
    "int32": (78, "i"),
    "int64": (79, "q"),
    "float32": (85, "f"),
    "float64": (86, "d"),
}
_PLAIN: dict[str, Encode] = {"bool": bool, "string": str, "float32": float, "float64": float}
_PLAIN |= {f"{sign}int{bits}": int for sign in ("", "u") for bits in (8, 16, 32, 64)}
_PLAIN |= {"byte": int, "char": int}
_ARRAY = re.compile(r"(.+?)\[\d*\]")


class CborEncoder:
    """Writes messages, each type compiled at its first use."""

    def __init__(self, find_class: Callable[[str], type[Any] | None]) -> None:
        """Take ``find_class``: it returns the class of ``package/Type``."""
        self._find_class = find_class
        self._compiled: dict[str, Encode] = {}

    def encode(self, message: Any) -> bytes:
        """Return a message as one CBOR map."""
        return cbor2.dumps(self._of_class(type(message))(message))

    def _of_class(self, message_class: type[Any]) -> Encode:
        name: str = message_class._type
        known = self._compiled.get(name)
        if known is None:
            fields = [
                (field, self._of_kind(kind))
                for field, kind in zip(message_class.__slots__, message_class._slot_types)
            ]

            def known(message: Any) -> dict[str, Any]:
                return {field: encode(getattr(message, field)) for field, encode in fields}

            self._compiled[name] = known
        return known

    def _of_kind(self, kind: str) -> Encode:
        array = _ARRAY.fullmatch(kind)
        if array is not None:
            return self._of_array(array[1])
        if kind in ("time", "duration"):
            return lambda value: {"secs": int(value.secs), "nsecs": int(value.nsecs)}
        plain = _PLAIN.get(kind)
        if plain is not None:
            return plain
        message_class = self._find_class(kind)
        if message_class is None:
            raise LookupError(f"unknown type {kind}")
        return self._of_class(message_class)

    def _of_array(self, kind: str) -> Encode:
        if kind in ("uint8", "char"):
            return bytes
        if kind in _TYPED_ARRAYS:
            tag, letter = _TYPED_ARRAYS[kind]
            return lambda values: cbor2.CBORTag(
                tag, struct.pack(f"<{len(values)}{letter}", *values)
            )
        element = self._of_kind(kind)
        return lambda values: [element(value) for value in values]


def publish_packet(topic: str, message: bytes) -> bytes:
    """Write a ``publish`` packet around a message that is CBOR already.

    The message is then encoded once for all clients.
    """
    head = b"".join(map(cbor2.dumps, ("op", "publish", "topic", topic, "msg")))
    return b"\xa3" + head + message  # 0xa3: a map of three pairs


def raw_message(secs: int, nsecs: int, content: bytes) -> bytes:
    """Write a message in ROS's own form, with the time of its receipt."""
    return cbor2.dumps({"secs": secs, "nsecs": nsecs, "bytes": content})
