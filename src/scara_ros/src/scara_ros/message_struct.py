"""A plain struct with the fields of a ROS message, made from the message's own definition.

Whoever shows or fills a message without ROS extends such a struct, so a field that the message gets
is there without a line of code.
"""

from __future__ import annotations

from typing import Any

import msgspec

PLAIN: dict[str, tuple[Any, Any]] = {
    "string": (str, ""),
    "bool": (bool, False),
    "float64": (float, 0.0),
    "uint32": (int, 0),
    "string[]": (tuple[str, ...], ()),
    "float64[]": (tuple[float, ...], ()),
    "int32": (int, 0),
    "uint64": (int, 0),
    # Both hold one number, and -1 is unknown.
    "industrial_msgs/RobotMode": (int, -1),
    "industrial_msgs/TriState": (int, -1),
}
"""ROS type: type of Python, value where nothing is known."""


def struct_of(message: Any, *without: str) -> Any:
    """Make a frozen struct of a message's fields, in their order, each with a default.

    Lists become tuples. Fields that are messages of several fields, and times, are left out: who
    needs one adds it, in a form of its own.

    Args:
        message: Class of the message, as genpy makes it.
        without: Names of fields that are left out too.

    Example:
        >>> class Tool:
        ...     __slots__ = ["stamp", "name", "forces"]
        ...     _slot_types = ["time", "string", "float64[]"]
        >>> struct_of(Tool)("gripper")
        Tool(name='gripper', forces=())
    """
    fields = [
        (name, *PLAIN[kind])
        for name, kind in zip(message.__slots__, message._slot_types)
        if kind in PLAIN and name not in without
    ]
    return msgspec.defstruct(message.__name__, fields, frozen=True)
