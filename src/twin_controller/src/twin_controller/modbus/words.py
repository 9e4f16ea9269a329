"""Numbers and text as 16-bit words, by the type, scale and word order of modbus_map.yaml."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from scara_config.modbus_map import Register

from twin_controller.robot_sample import SetpointError

_CODES = {"int32": "i", "float32": "f"}


def numbers(register: Register, words: Sequence[int], low_first: bool) -> list[float]:
    """Return the values of a register in its unit.

    Args:
        register: Type and scale.
        words: All its words, as read.
        low_first: The low word of a pair comes first.
    """
    if register.type == "int16":
        # A word has no sign on the wire: this gives it one.
        return [((word ^ 0x8000) - 0x8000) * register.scale for word in words]
    if low_first:
        words = [half for pair in zip(words[1::2], words[::2]) for half in pair]
    packed, code = struct.pack(f">{len(words)}H", *words), _CODES[register.type]
    found = struct.unpack(f">{len(words) // 2}{code}", packed)
    return [value * register.scale for value in found]


def to_words(name: str, register: Register, value: float, low_first: bool) -> list[int]:
    """Return the words of one value given in the register's unit.

    Args:
        name: Of the register, for the text.
        register: Type and scale.
        value: The value.
        low_first: The low word of a pair comes first.

    Raises:
        SetpointError: It does not fit.
    """
    if register.type == "float32":
        return _split(struct.pack(">f", value / register.scale), low_first)
    counts, limit = round(value / register.scale), 1 << (31 if register.type == "int32" else 15)
    if not -limit <= counts < limit:
        low, high = -limit * register.scale, (limit - 1) * register.scale
        raise SetpointError(f"{name} = {value} is outside [{low:g}, {high:g}]")
    if register.type == "int32":
        return _split(struct.pack(">i", counts), low_first)
    return [counts & 0xFFFF]


def text_of(words: Sequence[int]) -> str:
    """Return a string of two characters a word, ended by NUL."""
    text = b"".join(word.to_bytes(2, "big") for word in words)
    return text.partition(b"\0")[0].decode("ascii", "replace").rstrip()


def _split(value: bytes, low_first: bool) -> list[int]:
    high, low = int.from_bytes(value[:2], "big"), int.from_bytes(value[2:], "big")
    return [low, high] if low_first else [high, low]
