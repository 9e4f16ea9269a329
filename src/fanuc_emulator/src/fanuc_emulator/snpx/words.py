"""Values of the controller's variables as words, by $MULTIPLY, and back."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

from fanuc_emulator.registers import RegisterError
from fanuc_emulator.snpx.variables import ValueKind

_INT32 = (-(2**31), 2**31 - 1)


def encode(kind: ValueKind, words: int, multiply: float, value: float | str) -> list[int]:
    """Return the words of a value; a number beyond an int32 shows the largest."""
    if kind is ValueKind.TEXT:
        packed = str(value).encode("ascii", "replace")[: 2 * words].ljust(2 * words, b"\0")
        return list(struct.unpack(f">{words}H", packed))
    number = float(value)
    if kind is not ValueKind.NUMBER:
        return [round(number) & 0xFFFF]
    if multiply == 0.0:
        return list(struct.unpack("<2H", struct.pack("<f", number)))
    count = min(max(round(number * factor(multiply)), _INT32[0]), _INT32[1])
    return list(struct.unpack("<2H", struct.pack("<i", count)))


def decode(kind: ValueKind, multiply: float, words: Sequence[int]) -> float | str:
    """Return the value of all words of a field.

    Raises:
        RegisterError: It is not a finite number.
    """
    if kind is ValueKind.TEXT:
        text = struct.pack(f">{len(words)}H", *words).split(b"\0", 1)[0]
        return text.decode("ascii", "replace")
    if kind is not ValueKind.NUMBER:
        return signed(words[0])
    packed = struct.pack("<2H", *words)
    if multiply != 0.0:
        (count,) = struct.unpack("<i", packed)
        scaled = count / factor(multiply)
        return int(scaled) if scaled.is_integer() else scaled
    number: float
    (number,) = struct.unpack("<f", packed)
    if not math.isfinite(number):
        raise RegisterError(f"{number} is not a finite number")
    return number


def signed(word: int) -> int:
    """Return the number of one word with its sign."""
    return word - 0x10000 if word & 0x8000 else word


def factor(multiply: float) -> float:
    """Return by what a whole number is multiplied: -1 is how drivers write "as it is"."""
    return 1.0 if multiply == -1.0 else multiply
