"""The words of the robot's registers, for the Python clients: nothing of client or project."""

from __future__ import annotations

import struct
from collections.abc import Iterator


def float32(value: float) -> list[int]:
    """Return the words of a number, the low one first."""
    return list(struct.unpack("<2H", struct.pack("<f", value)))


def text(value: str) -> list[int]:
    """Return the 40 words of a text, the first character in the high byte."""
    return list(struct.unpack(">40H", value.encode().ljust(80, b"\0")))


def assignment(
    slot: int, address: int, size: int, variable: str, factor: float
) -> Iterator[tuple[int, list[int]]]:
    """Yield the requests that assign an entry of $SNPX_ASG: PDU address and words.

    Entry 80, at 16300, is led to each field of the entry in turn; the field's words go to 16000.
    """
    for field, words, by in (
        ("$ADDRESS", [address, 0], 1.0),
        ("$SIZE", [size, 0], 1.0),
        ("$VAR_NAME", text(variable), -1.0),
        ("$MULTIPLY", float32(factor), 0.0),
    ):
        name = text(f"$SNPX_ASG[{slot}].{field}")
        yield 16299, [16000, 0, len(words), 0, *name, *float32(by)]
        yield 15999, words
