"""The table $SNPX_ASG of a robot: which variable stands at which Modbus register.

It follows from modbus_map.yaml: each register names its variable, and registers in a row that hold
words in a row take one slot. A person types these slots, or a client writes them.

Source:
    The maker's manual of the HMI device, section 3.3, and printouts of a real controller:
    docs/sources.md.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from scara_config.frames import LETTERS, MOST, Kind, Numbered
from scara_config.loader import ConfigError
from scara_config.modbus_map import ModbusMap

SLOTS = 80
"""The table has so many slots."""
ADDRESSES = 16384
"""The controller has so many registers %R."""
NAME_LENGTH = 37
"""$VAR_NAME is a STRING[37]."""
FIRST_OWN, LAST_OWN = 2, 75
"""Slots that the map may take: slot 1 is the factory's, the last five are a client's way in."""
BOOTSTRAP = 16300
"""Here slots 76 to 79 show the four values of slot 80, by which a client reaches all others."""

_SLICE = re.compile(r"(?P<array>[^@]*?)(?:\[(?P<index>\d+)\])?(?:@(?P<first>\d+)\.(?P<words>\d+))?")
_ELEMENT_WORDS = {"R": 2, "PRG": 18, "ALM": 100, "SI": 1}
"""Words of a whole element, where no slice says how many are taken."""


@dataclass(frozen=True, slots=True)
class Assignment:
    """One slot.

    Attributes:
        address: Of its first register, counted from 1; 0: the slot is empty.
        size: How many registers; 0: the slot is empty.
        name: The variable, ``$VAR_NAME``.
        multiply: 0: float32; else int32 of the value times this. -1 for texts: the first of two
            characters in the high byte.
    """

    address: int = 0
    size: int = 0
    name: str = ""
    multiply: float = 1.0

    @property
    def last(self) -> int:
        """Address of its last register."""
        return self.address + self.size - 1


FACTORY = Assignment(1, 10000, "R[1]@1.1", 1.0)
"""Slot 1 as each controller is delivered: it hides every slot behind it up to 10000."""
_REACHED = f"$SNPX_ASG[{SLOTS}]"
WAY_IN = (
    Assignment(BOOTSTRAP, 2, f"{_REACHED}.$ADDRESS", 1.0),
    Assignment(BOOTSTRAP + 2, 2, f"{_REACHED}.$SIZE", 1.0),
    Assignment(BOOTSTRAP + 4, 40, f"{_REACHED}.$VAR_NAME", -1.0),
    Assignment(BOOTSTRAP + 44, 2, f"{_REACHED}.$MULTIPLY", 0.0),
)
"""Slots 76 to 79: with these four typed, a client can write all others."""


_FIRST_WATCHED = 13001
_NUMBERS = (
    "$SNPX_PARAM.$NUM_ASG",
    "$SNPX_PARAM.$NUM_MODBUS",
    "$RMT_MASTER",
    "$OPWORK.$UOP_DISABLE",
    "$SHELL_CFG.$USE_ABORT",
    "$SHELL_CFG.$CONT_ONLY",
    "$SHELL_CFG.$JOB_BASE",
    "$SHELL_CFG.$RSR_ENABLE[1]",
    "$SHELL_CFG.$NUM_RSR[1]",
)
_FRAMES = ("$MNUFRAMENUM[1]", "$MNUTOOLNUM[1]")
_SIGNALS = {"SI[0]": 1, "SO[0]": 1, "UI[1]": 2, "UO[1]": 2}
"""Sixteen signals a word."""
_ROWS = (
    *[(name, 2, 1.0) for name in _NUMBERS],
    *[(name, size, 0.0) for name, size in _SIGNALS.items()],
    *[(name, 2, 1.0) for name in _FRAMES],
)
WATCHED = tuple(
    # Two addresses a row, also where a row has one word.
    Assignment(_FIRST_WATCHED + 2 * at, size, name, multiply)
    for at, (name, size, multiply) in enumerate(_ROWS)
)
"""By these a client sees how the controller is set up, without writing anything."""
FRAME_WORDS = 12
"""Words of X Y Z W P R of one frame."""
FRAMES: dict[Kind, Assignment] = {
    "user": Assignment(13101, FRAME_WORDS * MOST["user"], "$MNUFRAME[1,1]@1.12", 0.0),
    "tool": Assignment(13251, FRAME_WORDS * MOST["tool"], "$MNUTOOL[1,1]@1.12", 0.0),
}
"""All frames of the first group; one request reads those of a kind."""
MOST_NUMBER = 1e5
"""A frame's numbers are less [mm, deg]: NaN and infinity are no numbers either; our choice."""
FREE_SLOTS = LAST_OWN - FIRST_OWN + 1 - len(WATCHED) - len(FRAMES)
"""So many are left for a map."""
FREE = range(FACTORY.last + 1, _FIRST_WATCHED)
"""Addresses that a map may take."""


def has_slots(layout: ModbusMap) -> bool:
    """Return whether the robot of this map has the table: its registers name variables."""
    return any(register.variable for register in layout.holding_registers.values())


def own_slots(layout: ModbusMap) -> list[Assignment]:
    """Return the slots of a map from slot 2 on, by address, as few as will do."""
    found: list[Assignment] = []
    for register in sorted(layout.holding_registers.values(), key=lambda each: each.address):
        slot = Assignment(register.address, register.words, register.variable, register.multiply)
        joined = _joined(found[-1], slot) if found else None
        found[-1:] = [joined] if joined else [*found[-1:], slot]
    return found


def slot_table(layout: ModbusMap) -> list[Assignment]:
    """Return all 80 slots of a controller that is set up for a map."""
    own = [*own_slots(layout), *WATCHED, *FRAMES.values()]
    empty = [Assignment()] * (LAST_OWN - 1 - len(own))
    return [FACTORY, *own, *empty, *WAY_IN, Assignment()]


def delivered_table() -> list[Assignment]:
    """Return all 80 slots of a controller as it is delivered."""
    return [FACTORY, *[Assignment()] * (SLOTS - 1)]


def frames_of(words: Mapping[Kind, Sequence[int]]) -> Numbered:
    """Return the frames in the words of the slots ``FRAMES``, those that are all 0 too.

    Raises:
        ConfigError: What stands there is no number: the slot has another ``$MULTIPLY`` or name.
    """
    found: dict[tuple[Kind, int], tuple[float, ...]] = {}
    for kind, given in words.items():
        # The low word first: in a row they are the little-endian bytes of a float32.
        values = struct.unpack(f"<{len(given) // 2}f", struct.pack(f"<{len(given)}H", *given))
        for at in range(0, len(values), len(LETTERS)):
            number = at // len(LETTERS) + 1
            # A float32 has seven digits: what is printed is what was typed.
            numbers = tuple(float(f"{value:.7g}") for value in values[at : at + len(LETTERS)])
            if not all(abs(value) < MOST_NUMBER for value in numbers):
                raise ConfigError(f"{FRAMES[kind].name}: frame {number} reads {numbers}")
            found[kind, number] = numbers
    return found


def slot_problems(layout: ModbusMap) -> Iterator[str]:
    """Yield why a delivered controller cannot hold the slots of a map, by register or slot."""
    if not has_slots(layout):
        return
    for name, register in layout.holding_registers.items():
        key = f"holding_registers.{name}"
        last = register.address + register.words - 1
        if not register.variable:
            yield f"{key}.variable: is missing, but other registers have one"
        elif len(register.variable) > NAME_LENGTH:
            yield f"{key}.variable = {register.variable}: is longer than {NAME_LENGTH} characters"
        if register.address < FREE.start:
            yield (
                f"{key}.address = {register.address}: slot 1 of a delivered controller hides it; "
                f"take {FREE.start} to {FREE.stop - 1}"
            )
        elif last >= FREE.stop:
            yield f"{key}: ends at {last}, the last that is free is {FREE.stop - 1}"
    count = len(own_slots(layout))
    if count > FREE_SLOTS:
        yield f"holding_registers take {count} slots: $SNPX_ASG has {FREE_SLOTS} that are free"


def _joined(before: Assignment, slot: Assignment) -> Assignment | None:
    """Return both as one slot, None if they are not in a row.

    A row is either the next words of the same element, or the same words of the next elements.
    """
    if before == slot:
        return before
    if before.last + 1 != slot.address:
        return None
    here, there = _SLICE.fullmatch(before.name), _SLICE.fullmatch(slot.name)
    if here is None or there is None or not here["index"] or here["array"] != there["array"]:
        return None
    size = before.size + slot.size
    (first, words), (next_first, next_words) = _words(here), _words(there)
    if here["index"] == there["index"] and first + words == next_first:
        # Whole words of one element are the same by any factor: only the others' factor counts.
        factors = {before.multiply, slot.multiply} - {1.0} or {1.0}
        if len(factors) > 1:
            return None
        taken = words + next_words
        whole = first == 1 and taken == _ELEMENT_WORDS.get(here["array"])
        name = f"{here['array']}[{here['index']}]" + ("" if whole else f"@{first}.{taken}")
        return replace(before, size=size, name=name, multiply=factors.pop())
    elements = before.size // words
    follows = int(there["index"] or 0) == int(here["index"]) + elements
    # Elements lie in a row only if the slot takes the same words of each, by the same factor.
    same = (first, words, before.multiply) == (next_first, next_words, slot.multiply)
    return replace(before, size=size) if follows and same else None


def _words(found: re.Match[str]) -> tuple[int, int]:
    """Return the first word of each element that a slot takes, and how many."""
    if found["first"]:
        return int(found["first"]), int(found["words"])
    return 1, _ELEMENT_WORDS.get(found["array"], 2)
