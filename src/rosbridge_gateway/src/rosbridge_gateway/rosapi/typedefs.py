"""Types as rosapi describes them: fields, array lengths, examples, constants."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Any

FindClass = Callable[[str], type[Any] | None]

_ARRAY = re.compile(r"(.+?)\[(\d*)\]")
_EXAMPLES = (
    {"bool": "False", "string": "", "float32": "0.0", "float64": "0.0"}
    | {name: "0" for bits in (8, 16, 32, 64) for name in (f"int{bits}", f"uint{bits}")}
    | {"byte": "0", "char": "0"}
)
_NO_ARRAY, _ANY_LENGTH = -1, 0
_TIMES = ("time", "duration")


def typedefs(message_class: type[Any], find_class: FindClass) -> list[dict[str, Any]]:
    """Describe a type and then each that it contains, once, in the order of the fields.

    Args:
        message_class: Class of a message, or of a service's request or response.
        find_class: Returns the class of ``package/Type``.

    Example:
        >>> from std_msgs.msg import String
        >>> typedefs(String, lambda name: None)[0]["fieldtypes"]
        ['string']
    """
    found: list[dict[str, Any]] = []
    seen = {str(message_class._type)}

    def describe(description: dict[str, Any]) -> None:
        found.append(description)
        for kind in description["fieldtypes"]:
            if kind in _EXAMPLES or kind in seen:
                continue
            seen.add(kind)
            inner = None if kind in _TIMES else find_class(kind)
            if kind in _TIMES:
                describe(_time(kind))
            elif inner is not None:
                describe(_typedef(inner))

    describe(_typedef(message_class))
    return found


def _typedef(message_class: type[Any]) -> dict[str, Any]:
    names, kinds = message_class.__slots__, message_class._slot_types
    fields = [_field(kind) for kind in kinds]
    constants = {
        name: str(value)
        for name, value in inspect.getmembers(message_class)
        if not name.startswith("_")
        and name not in message_class.__slots__
        and not inspect.isroutine(value)
    }
    return {
        "type": message_class._type,
        "fieldnames": list(names),
        "fieldtypes": [kind for kind, _, _ in fields],
        "fieldarraylen": [length for _, length, _ in fields],
        "examples": [example for _, _, example in fields],
        "constnames": list(constants),
        "constvalues": list(constants.values()),
    }


def _field(kind: str) -> tuple[str, int, str]:
    """Return type, array length and example of a field."""
    array = _ARRAY.fullmatch(kind)
    if array is None:
        return kind, _NO_ARRAY, _EXAMPLES.get(kind, "{}")
    return array[1], int(array[2]) if array[2] else _ANY_LENGTH, "[]"


def _time(kind: str) -> dict[str, Any]:
    return {
        "type": kind,
        "fieldnames": ["secs", "nsecs"],
        "fieldtypes": ["int32", "int32"],
        "fieldarraylen": [_NO_ARRAY, _NO_ARRAY],
        "examples": ["0", "0"],
        "constnames": [],
        "constvalues": [],
    }
