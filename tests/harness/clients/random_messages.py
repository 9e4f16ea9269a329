"""Random messages of all types of this machine."""

from __future__ import annotations

import importlib
import random
import re
import struct
from typing import Any

import genpy
import roslib.message

PACKAGES = (
    *("actionlib", "actionlib_msgs", "control_msgs", "diagnostic_msgs", "geometry_msgs"),
    *("industrial_msgs", "rosgraph_msgs", "scara_msgs", "sensor_msgs", "std_msgs", "tf2_msgs"),
    *("trajectory_msgs", "visualization_msgs"),
)
EACH = 4
SEED = 17
ARRAY = re.compile(r"(.+?)\[(\d*)\]")
BITS = {f"int{bits}": bits for bits in (8, 16, 32, 64)} | {"byte": 8}
LARGEST_SECONDS = 2**31 - 1


def types_of(package: str) -> list[type[genpy.Message]]:
    """Return a package's message classes."""
    found = vars(importlib.import_module(f"{package}.msg")).values()
    return [kind for kind in found if isinstance(kind, type) and issubclass(kind, genpy.Message)]


def random_value(kind: str, chance: random.Random) -> Any:
    """Return a value of a field type."""
    if array := ARRAY.fullmatch(kind):
        count = int(array[2]) if array[2] else chance.randrange(4)
        values = [random_value(array[1], chance) for _ in range(count)]
        return bytes(values) if array[1] in ("uint8", "char") else values
    if kind in BITS:
        return chance.randrange(-(1 << (BITS[kind] - 1)), 1 << (BITS[kind] - 1))
    if kind.startswith("uint") or kind == "char":
        return chance.randrange(1 << int(kind[4:] if kind != "char" else 8))
    if kind in ("float32", "float64"):
        number = chance.uniform(-1.0, 1.0) * 10.0 ** chance.randrange(-30, 30)
        return struct.unpack("<f", struct.pack("<f", number))[0] if kind == "float32" else number
    if kind == "bool":
        return chance.random() < 0.5
    if kind == "string":
        return "".join(chance.choice('ab/_ \u00e4\u4e16\U0001f916"\\\n') for _ in range(5))
    if kind in ("time", "duration"):
        made = genpy.Time if kind == "time" else genpy.Duration
        return made(chance.randrange(LARGEST_SECONDS), chance.randrange(10**9))
    return random_message(roslib.message.get_message_class(kind), chance)


def random_message(kind: type[genpy.Message], chance: random.Random) -> Any:
    """Return a message whose fields all have a value."""
    return kind(*(random_value(field, chance) for field in kind._slot_types))
