"""Turn values into 16-bit words and back, as the robot controller lays them out.

Written from the layout's description alone: the other end of the wire has a codec of its own.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from scara_config.modbus_map import Register

Value = tuple[int, ...] | tuple[float, ...] | str
_FORMATS = {"int16": "h", "int32": "i", "float32": "f"}


class RegisterError(ValueError):
    """A value does not fit its register."""


def encode(
    register: Register, values: Sequence[float] | Sequence[int] | str, low_first: bool = True
) -> list[int]:
    """Return the words of ``values``, given in the register's unit.

    Args:
        register: What stands there; its ``count`` values (a string: words of two characters).
        values: Numbers, or the text; a text is padded with NUL and cut.
        low_first: The low word of a 32-bit value comes first.

    Raises:
        RegisterError: Wrong number of values, or a number outside the type's range.
    """
    if register.type == "string":
        if not isinstance(values, str):
            raise RegisterError(f"register {register.address} holds a text, not {values!r}")
        size = 2 * register.count
        packed = values.encode("ascii", "replace")[:size].ljust(size, b"\0")
        return list(struct.unpack(f">{register.count}H", packed))
    if isinstance(values, str) or len(values) != register.count:
        raise RegisterError(
            f"register {register.address} holds {register.count} numbers, not {values!r}"
        )
    if register.scale != 1.0:
        counts = [value / register.scale for value in values]
        values = counts if register.type == "float32" else [round(value) for value in counts]
    try:
        packed = struct.pack(f"<{register.count}{_FORMATS[register.type]}", *values)
    except (struct.error, OverflowError) as error:
        raise RegisterError(
            f"register {register.address}: {values!r} do not fit {register.type}: {error}"
        ) from error
    words = list(struct.unpack(f"<{register.words}H", packed))
    return words if low_first else _swap(register, words)


def decode(register: Register, words: Sequence[int], low_first: bool = True) -> Value:
    """Return the values in ``words``: a tuple of numbers, or the text up to the first NUL.

    Raises:
        RegisterError: The number of words is not the register's.
    """
    if len(words) != register.words:
        raise RegisterError(
            f"register {register.address} has {register.words} words, not {len(words)}"
        )
    if register.type == "string":
        text = struct.pack(f">{register.count}H", *words)
        return text.split(b"\0", 1)[0].decode("ascii", "replace")
    ordered = words if low_first else _swap(register, words)
    packed = struct.pack(f"<{register.words}H", *ordered)
    found: tuple[float, ...] = struct.unpack(f"<{register.count}{_FORMATS[register.type]}", packed)
    return (
        found
        if register.scale == 1.0
        # A scale of 0.1 is no binary number: 3 counts would read as 0.30000000000000004.
        else tuple([round(value * register.scale, 9) for value in found])
    )


def _swap(register: Register, words: Sequence[int]) -> list[int]:
    """Exchange the two words of each 32-bit value."""
    if register.type == "int16":
        return list(words)
    return [word for i in range(0, len(words), 2) for word in (words[i + 1], words[i])]


class NoRegisterError(LookupError):
    """There is no such register, or it may not be written; the text says why.

    Args:
        address: Counted from 1; None: the text names what was addressed.
        why: What is there instead.
    """

    def __init__(self, address: int | None, why: str) -> None:
        super().__init__(why if address is None else f"register {address}: {why}")
