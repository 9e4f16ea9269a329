"""ROS messages to JSON-able values and back, compiled once per message type.

On the wire NaN and infinities are ``null`` (JSON has neither), ``uint8[]`` and ``char[]`` are
base64 text, time and duration are ``{"secs", "nsecs"}``. What comes in may say ``"now"`` for a
time, and a std_msgs/Header without a stamp gets a time: both are when the packet came. So does a
field ``asked`` of a request or command. Errors name the path inside the message and what is
allowed.
"""

from __future__ import annotations

import base64
import binascii
import math
import re
from collections.abc import Callable
from typing import Any, NamedTuple

from scara_ros.standstill import said

Encode = Callable[[Any], Any]
RosTime = tuple[int, int]
"""Seconds, nanoseconds."""
Decode = Callable[[Any, str, RosTime], Any]
Now = Callable[[], RosTime]


class Arrival(NamedTuple):
    """When the packet came that holds a message.

    ``monotonic`` is this machine's monotonic clock [s], ``stamp`` the same instant as ROS time.
    """

    monotonic: float
    stamp: RosTime


_INTEGERS = {
    name: (-(1 << (bits - 1)), (1 << (bits - 1)) - 1)
    if name.startswith("i")
    else (0, (1 << bits) - 1)
    for bits in (8, 16, 32, 64)
    for name in (f"int{bits}", f"uint{bits}")
} | {"byte": (-128, 127), "char": (0, 255)}
_FLOAT_LIMITS = {"float32": 3.4028234663852886e38, "float64": 1.7976931348623157e308}
_LARGEST_INTEGER = 1 << 1000
_TIME_RANGES = {
    "time": ((0, (1 << 32) - 1), (0, 999_999_999)),
    "duration": ((-(1 << 31), (1 << 31) - 1), (-999_999_999, 999_999_999)),
}
_HEADER = "std_msgs/Header"
_ASKED = ("asked", "float64")
"""The field that says when something was asked for: what is older than a stop is refused by it."""
_ARRAY = re.compile(r"(.+?)\[(\d*)\]")


class ConversionError(ValueError):
    """A value does not fit the message type, or the type is unknown."""


class Converter:
    """Converts messages of one type."""

    def __init__(
        self, message_class: type[Any], encode: Encode, decode: Decode, now: Now | None
    ) -> None:
        self.message_class = message_class
        self._encode = encode
        self._decode = decode
        self._now = now
        fields = list(zip(message_class.__slots__, message_class._slot_types))
        self.says_when = _ASKED in fields or ("header", _HEADER) in fields
        """Whether its messages say when they were asked for, or true."""
        self._is_asked = _ASKED in fields
        self._is_stamped = now is not None and ("header", _HEADER) in fields
        # A request has no header. What has one and is asked for is a command such as STOP.
        self._is_command = self._is_asked and ("header", _HEADER) in fields

    def to_values(self, message: Any) -> dict[str, Any]:
        """Return a message as nested dicts and lists.

        ``msgspec.json`` can write them; NaN becomes null there.
        """
        return self._encode(message)  # type: ignore[no-any-return]

    def to_message(self, values: Any, arrival: Arrival | None = None) -> Any:
        """Build a message.

        A missing field keeps its default; ``null`` stands for NaN in float fields.

        Args:
            values: A dict by field names, or (as rosbridge allows for calls) a list in field order,
                which may be shorter.
            arrival: When the packet came. Then ``asked`` and the header's stamp become that where
                they are 0, ``asked`` also where it is later. None: a header that is given without a
                stamp gets the present time.

        Raises:
            ConversionError: Unknown field, wrong type, wrong count, number out of range; the text
                names the path.
        """
        if values is None:
            values = {}
        elif isinstance(values, list):
            fields = self.message_class.__slots__
            if len(values) > len(fields):
                raise ConversionError(
                    f"{len(values)} values for the fields {', '.join(fields) or 'none'}: allowed: "
                    f"at most {len(fields)}"
                )
            values = dict(zip(fields, values))
        stamp = (0, 0)
        if self._now is not None:
            stamp = self._now() if arrival is None else arrival.stamp
        message = self._decode(values, "", stamp)
        if arrival is not None:
            # Fill what the sender has not said, or could not know: a later time is another
            # clock's. A command keeps a later time: a stop that was given while this process stood
            # still must not become as old as the requests that waited beside it. Who hears it
            # knows the future.
            given = message.asked > 0.0 if self._is_command else False
            if self._is_asked and not given and not said(message.asked, arrival.monotonic):
                message.asked = arrival.monotonic
            if self._is_stamped and not message.header.stamp:
                message.header.stamp.secs, message.header.stamp.nsecs = arrival.stamp
        return message


class Converters:
    """Converters by message type, each compiled at its first use."""

    def __init__(self, find_class: Callable[[str], type[Any] | None], now: Now | None) -> None:
        """Take where classes and the time come from.

        Args:
            find_class: Returns the class of a type's name, None if it knows none. A name is
                ``package/Type``, ``time`` or ``duration``.
            now: The time of stamps that a client leaves open; None: they stay 0.
        """
        self._find_class = find_class
        self._now = now
        self._compiled: dict[str, Converter] = {}

    def by_name(self, type_name: str) -> Converter:
        """Return the converter of ``package/Type``.

        Raises:
            ConversionError: There is no such type.
        """
        try:
            known = self._compiled.get(type_name) or self.by_class(self._class(type_name))
        except ValueError as error:
            raise ConversionError(f"unknown type {type_name!r}: {error}") from error
        return known

    def by_class(self, message_class: type[Any]) -> Converter:
        """Return the converter of a message class (also of a service's request or response)."""
        name: str = message_class._type
        if name not in self._compiled:
            encode, decode = self._compile_message(message_class)
            self._compiled[name] = Converter(message_class, encode, decode, self._now)
        return self._compiled[name]

    def _class(self, type_name: str) -> type[Any]:
        found = self._find_class(type_name)
        if found is None:
            raise ConversionError("no package on this machine has it")
        return found

    def _compile_message(self, message_class: type[Any]) -> tuple[Encode, Decode]:
        codecs = {
            name: self._compile(kind)
            for name, kind in zip(message_class.__slots__, message_class._slot_types)
        }
        encoders = [(name, encode) for name, (encode, _) in codecs.items()]
        decoders = {name: decode for name, (_, decode) in codecs.items()}
        stamped = self._now is not None and message_class._type == _HEADER

        def encode(message: Any) -> dict[str, Any]:
            return {
                n: getattr(message, n) if e is None else e(getattr(message, n)) for n, e in encoders
            }

        def decode(values: Any, path: str, stamp: RosTime) -> Any:
            if not isinstance(values, dict):
                raise _mismatch(
                    path, values, f"an object with {', '.join(decoders) or 'no fields'}"
                )
            message = message_class()
            if stamped and values.get("stamp") in (None, {}):
                values = {**values, "stamp": "now"}
            for name, value in values.items():
                decoder = decoders.get(name)
                inner = f"{path}.{name}" if path else name
                if decoder is None:
                    raise ConversionError(
                        f"{inner}: unknown field: allowed: {', '.join(decoders) or 'none'}"
                    )
                setattr(message, name, decoder(value, inner, stamp))
            return message

        return encode, decode

    def _compile(self, kind: str) -> tuple[Encode | None, Decode]:
        """Return encoder (None: as it is) and decoder of one field type."""
        array = _ARRAY.fullmatch(kind)
        if array:
            return self._compile_array(array[1], int(array[2]) if array[2] else None)
        if kind in _INTEGERS:
            return None, _integer(*_INTEGERS[kind])
        if kind in _FLOAT_LIMITS:
            return None, _float(_FLOAT_LIMITS[kind])
        if kind == "bool":
            return bool, _bool
        if kind == "string":
            return None, _string
        if kind in _TIME_RANGES:
            may_be_now = self._now is not None and kind == "time"
            return _encode_time, _time(self._class(kind), *_TIME_RANGES[kind], may_be_now)
        compiled = self.by_class(self._class(kind))
        return compiled._encode, compiled._decode

    def _compile_array(self, kind: str, count: int | None) -> tuple[Encode | None, Decode]:
        encode, decode = self._compile(kind)
        if kind in ("uint8", "char"):
            return bytes, _octets(_array(decode, count), count)
        if encode is None:
            return None, _array(decode, count)
        element = encode
        return lambda values: [element(value) for value in values], _array(decode, count)


def _mismatch(path: str, value: Any, allowed: str) -> ConversionError:
    text = repr(value)
    return ConversionError(
        f"{path or 'message'} = {text if len(text) <= 60 else text[:57] + '...'}: allowed: "
        f"{allowed}"
    )


def _integer(low: int, high: int) -> Decode:
    def decode(value: Any, path: str, stamp: RosTime) -> int:
        if type(value) is not int or not low <= value <= high:
            raise _mismatch(path, value, f"an integer {low}..{high}")
        return value

    return decode


def _float(limit: float) -> Decode:
    def decode(value: Any, path: str, stamp: RosTime) -> float:
        if value is None:
            return math.nan
        if type(value) is int:
            value = float(value) if -_LARGEST_INTEGER <= value <= _LARGEST_INTEGER else math.inf
        if type(value) is not float or not abs(value) <= limit:
            raise _mismatch(path, value, f"a number within +-{limit:.4g} or null")
        return value

    return decode


def _bool(value: Any, path: str, stamp: RosTime) -> bool:
    if type(value) is not bool:
        raise _mismatch(path, value, "true or false")
    return value


def _string(value: Any, path: str, stamp: RosTime) -> str:
    if type(value) is not str:
        raise _mismatch(path, value, "a text")
    return value


def _encode_time(value: Any) -> dict[str, int]:
    return {"secs": value.secs, "nsecs": value.nsecs}


def _time(
    time_class: type[Any],
    secs_range: tuple[int, int],
    nsecs_range: tuple[int, int],
    may_be_now: bool,
) -> Decode:
    """Return the decoder of a time, which may be "now" if ``may_be_now``, or of a duration."""
    allowed = "an object with secs, nsecs" + (', or "now"' if may_be_now else "")
    parts = {"secs": _integer(*secs_range), "nsecs": _integer(*nsecs_range)}

    def decode(value: Any, path: str, stamp: RosTime) -> Any:
        if may_be_now and value == "now":
            return time_class(*stamp)
        if not isinstance(value, dict) or not parts.keys() >= value.keys():
            raise _mismatch(path, value, allowed)
        return time_class(
            *(part(value.get(name, 0), f"{path}.{name}", stamp) for name, part in parts.items())
        )

    return decode


def _array(decode_element: Decode, count: int | None) -> Decode:
    def decode(value: Any, path: str, stamp: RosTime) -> list[Any]:
        if not isinstance(value, list) or count not in (None, len(value)):
            raise _mismatch(path, value, "an array" if count is None else f"an array of {count}")
        return [
            decode_element(element, f"{path}[{index}]", stamp)
            for index, element in enumerate(value)
        ]

    return decode


def _octets(decode_list: Decode, count: int | None) -> Decode:
    def decode(value: Any, path: str, stamp: RosTime) -> bytes:
        if not isinstance(value, str):
            return bytes(decode_list(value, path, stamp))
        try:
            octets = base64.b64decode(value, validate=True)
        except binascii.Error as error:
            raise _mismatch(path, value, "base64 text") from error
        if count not in (None, len(octets)):
            raise ConversionError(f"{path} has {len(octets)} bytes: allowed: {count}")
        return octets

    return decode
