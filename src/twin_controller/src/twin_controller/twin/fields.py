"""Checked fields of ROS messages as rosbridge carries them: counts, finite numbers, times."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard, TypeVar

from twin_controller.core.events import Joints

SECONDS = 1 << 32
"""ROS times are uint32 seconds; what lies beyond cannot be one."""

T = TypeVar("T")


class PacketError(ValueError):
    """A packet of the twin does not fit; the text names the field and what was expected."""


def order_of(message: Mapping[str, Any], field: str, names: Sequence[str]) -> tuple[list[int], int]:
    """Return where each of our joints stands in the message, and how many joints it has.

    Raises:
        PacketError: One of ours is missing, or stands there twice.
    """
    given = message.get(field)
    if not isinstance(given, list):
        raise PacketError(f"{field}: missing")
    missing = [name for name in names if name not in given]
    if missing:
        raise PacketError(f"{field} = {shown(given)}: {', '.join(missing)} missing")
    doubled = [name for name in names if given.count(name) > 1]
    if doubled:
        raise PacketError(f"{field} = {shown(given)}: {', '.join(doubled)} more than once")
    return [given.index(name) for name in names], len(given)


def row(message: Mapping[str, Any], field: str, order: tuple[list[int], int]) -> Joints:
    """Return one list of numbers in the core's joint order."""
    values = message.get(field)
    places, count = order
    if not isinstance(values, list) or len(values) != count:
        raise PacketError(f"{field}: expected {count} numbers, got {shown(values)}")
    found = tuple(values[place] for place in places)
    if not all(_is_finite(value) for value in found):
        raise PacketError(f"{field} = {shown(list(found))}: not finite")
    return tuple(float(value) for value in found)


def rows_of(
    message: Mapping[str, Any], field: str, order: tuple[list[int], int]
) -> tuple[Joints, ...]:
    """Return lists of numbers that stand one after the other, each in the core's joint order."""
    values, count = message.get(field), order[1]
    if not isinstance(values, list) or not count or len(values) % count:
        raise PacketError(f"{field}: expected rows of {count} numbers, got {shown(values)}")
    cut = (values[begin : begin + count] for begin in range(0, len(values), count))
    return tuple(row({field: each}, field, order) for each in cut)


def row_or_zeros(message: Mapping[str, Any], field: str, order: tuple[list[int], int]) -> Joints:
    """Return one list of numbers that may be left out: then zeros."""
    if isinstance(message, Mapping) and message.get(field) == []:
        return (0.0,) * len(order[0])
    return row(message, field, order)


def number(message: Mapping[str, Any], field: str) -> float:
    """Return one finite number."""
    value = message.get(field)
    if _is_finite(value):
        return float(value)
    raise PacketError(f"{field} = {shown(value)}: expected a finite number")


def _is_finite(value: object) -> TypeGuard[float]:
    """Return whether a JSON value is a number that a double can hold; true and false are none."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max


def typed(message: Mapping[str, Any], field: str, kind: type[T]) -> T:
    """Return one field that must be of exactly this type."""
    value = message.get(field)
    if type(value) is not kind:
        raise PacketError(f"{field} = {shown(value)}: expected {kind.__name__}")
    return value


def shown(value: object) -> str:
    """Return a value for an error text, of bounded length."""
    if isinstance(value, int) and abs(value) > SECONDS:
        return "a huge number"
    try:
        return f"{value!r}"[:200]
    # Python does not print an integer of thousands of digits, and a list may hold one.
    except ValueError:
        return "something with a huge number"


def stamp_of(message: Mapping[str, Any]) -> float:
    """Return the header's stamp [s]."""
    header = message.get("header")
    if not isinstance(header, Mapping):
        raise PacketError("header: missing")
    return time_of(header, "stamp")


def time_of(message: Mapping[str, Any], field: str) -> float:
    """Return a ROS time or duration [s]."""
    value = message.get(field) if isinstance(message, Mapping) else None
    parts: list[Any] = (
        [value.get(part) for part in ("secs", "nsecs")] if isinstance(value, Mapping) else []
    )
    if not parts or not all(type(part) is int and abs(part) <= SECONDS for part in parts):
        raise PacketError(f"{field} = {shown(value)}: expected secs and nsecs")
    return float(parts[0]) + float(parts[1]) * 1e-9


def ros_time(t: float) -> dict[str, int]:
    """Split a time [s] into secs and nsecs."""
    # Rounded as one number: nsecs alone could come out as a whole second.
    nanoseconds = round(t * 1e9)
    return {"secs": nanoseconds // 1_000_000_000, "nsecs": nanoseconds % 1_000_000_000}
