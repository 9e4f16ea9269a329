"""The robot's registers and signals as the page lists them: what was read, and what it means."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence

import msgspec
from scara_config.modbus_map import ModbusMap, Register

SHOWN_VALUES = 9  # our choice: as many as axes; longer rows of values are cut with a word
SHOWN_WORDS = 4  # our choice
TABLES = {"holding_registers": "register", "input_registers": "input register"}
BITS = {"coils": "input signal", "discrete_inputs": "output signal"}
"""As the robot calls them: what a client writes is an input of the robot."""


class Entry(msgspec.Struct, frozen=True):
    """One line of the list, all as text; ``offset`` and ``count`` say what is read for it."""

    name: str
    kind: str
    address: int
    table: str
    meaning: str
    offset: int
    count: int
    value: str = ""
    raw: str = ""

    @property
    def words(self) -> str:
        """What a search looks through."""
        return " ".join((self.name, self.kind, str(self.address), self.meaning, self.value)).lower()


def entries(layout: ModbusMap) -> Iterator[Entry]:
    """Yield all registers and signals of a robot, without values."""
    for table, kind in TABLES.items():
        for name, register in getattr(layout, table).items():
            unit = "" if register.unit in ("flag", "enum", "text", "count") else register.unit
            meaning = f"{register.meaning} [{unit}]" if unit else register.meaning
            yield Entry(
                name, kind, register.address, table, meaning, register.offset, register.words
            )
    for table, kind in BITS.items():
        for name, bit in getattr(layout, table).items():
            yield Entry(name, kind, bit.address, table, bit.meaning, bit.offset, 1)


def with_words(entry: Entry, layout: ModbusMap, words: Sequence[int]) -> Entry:
    """Return a register's line with its value."""
    register = getattr(layout, entry.table)[entry.name]
    raw = " ".join(f"{word:04X}" for word in words[:SHOWN_WORDS])
    return msgspec.structs.replace(
        entry,
        value=value_text(register, words, layout.word_order == "low_first"),
        raw=raw + (" ..." if len(words) > SHOWN_WORDS else ""),
    )


def with_bit(entry: Entry, lit: bool) -> Entry:
    """Return a signal's line with its value."""
    return msgspec.structs.replace(entry, value="on" if lit else "off", raw=str(int(lit)))


def value_text(register: Register, words: Sequence[int], low_first: bool) -> str:
    """Return the values of a register as text, in its unit.

    Args:
        register: Type and scale.
        words: All its words, as read.
        low_first: The low word of a pair comes first.
    """
    data = b"".join(word.to_bytes(2, "big") for word in words)
    if register.type == "string":
        return data.partition(b"\0")[0].decode("ascii", "replace").rstrip() or "(empty)"
    if register.type == "int16":
        values = [f"{n * register.scale:g}" for n in struct.unpack(f">{len(words)}h", data)]
    else:
        if low_first:
            pairs = zip(words[1::2], words[::2])
            data = b"".join(word.to_bytes(2, "big") for pair in pairs for word in pair)
        letter = "i" if register.type == "int32" else "f"
        numbers = struct.unpack(f">{len(words) // 2}{letter}", data)
        values = [f"{number * register.scale:.7g}" for number in numbers]
    more = len(values) - SHOWN_VALUES
    return ", ".join(values[:SHOWN_VALUES]) + (f" and {more} more" if more > 0 else "")


def matching(listed: Sequence[Entry], search: str) -> list[Entry]:
    """Return the lines that hold every word of a search."""
    wanted = search.lower().split()
    return [entry for entry in listed if all(word in entry.words for word in wanted)]
