"""The controller's variables as $VAR_NAME names them: how many there are, what their words hold.

A name is a variable with the index of its first element, and perhaps a slice: ``PR[1]@27.19`` takes
19 words of each element, from its 27th word on. Several elements follow each other: ``R[1]`` with
size 400 is R[1] to R[200].

Source:
    The layouts are those that published drivers and printouts of real controllers use; R, PR, ALM
    and PRG have as many elements as the stand-in keeps (our choice).
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum, auto
from typing import NamedTuple

from scara_config.frames import MOST, Kind
from scara_config.set_up.slots import SLOTS


class VariableError(ValueError):
    """A name is not that of a variable; the text says which there are."""


class ValueKind(Enum):
    """What the words of a field hold."""

    NUMBER = auto()
    """Two words, by $MULTIPLY: 0 a float32, else an int32 of value times $MULTIPLY."""
    INTEGER = auto()
    """One word, whatever $MULTIPLY says."""
    TEXT = auto()
    """Two characters a word, the first in the high byte, padded with NUL."""
    SIGNAL = auto()
    """One word a signal, or with $MULTIPLY 0 sixteen signals a word, the first in bit 0."""


class Field(NamedTuple):
    """One value of an element: its first word, counted from 1, its kind and how many words."""

    first: int
    kind: ValueKind
    words: int


@dataclass(frozen=True, slots=True)
class Family:
    """Equal elements in a row.

    Attributes:
        form: The name of an element, with a place for its index.
        lowest, highest: Indices.
        fields: Of one element, without gaps.
    """

    form: str
    lowest: int
    highest: int
    fields: tuple[Field, ...]

    @property
    def words(self) -> int:
        """How many words one element has."""
        return self.fields[-1].first + self.fields[-1].words - 1


def _fields(*runs: tuple[ValueKind, int, int]) -> tuple[Field, ...]:
    """Lay fields out one after the other: kind, words of each, how many."""
    found: list[Field] = []
    first = 1
    for kind, words, count in runs:
        for _ in range(count):
            found.append(Field(first, kind, words))
            first += words
    return tuple(found)


_NUMBER = _fields((ValueKind.NUMBER, 2, 1))
_SIGNAL = _fields((ValueKind.SIGNAL, 1, 1))
# X Y Z W P R E1 E2 E3, FLIP LEFT UP FRONT, three turns, VALIDC, J1..J9, VALIDJ, UF, UT, 3 reserved.
_POSITION = _fields(
    (ValueKind.NUMBER, 2, 9),
    (ValueKind.INTEGER, 1, 8),
    (ValueKind.NUMBER, 2, 9),
    (ValueKind.INTEGER, 1, 6),
)
# Name, line, state, caller.
_PROGRAM = _fields((ValueKind.TEXT, 8, 1), (ValueKind.INTEGER, 1, 2), (ValueKind.TEXT, 8, 1))
# Id, number, id and number of the cause, severity, y m d h m s; message, cause, severity as text.
_ALARM = _fields((ValueKind.INTEGER, 1, 11), (ValueKind.TEXT, 40, 2), (ValueKind.TEXT, 9, 1))

FAMILIES = {
    name: Family(name, 1, 1, _NUMBER)
    for name in (
        "$MCR.$GENOVERRIDE",
        "$FAST_CLOCK",
        "$RMT_MASTER",
        "$OPWORK.$UOP_DISABLE",
        "$SHELL_CFG.$USE_ABORT",
        "$SHELL_CFG.$CONT_ONLY",
        "$SHELL_CFG.$JOB_BASE",
        "$SNPX_PARAM.$NUM_ASG",
        "$SNPX_PARAM.$NUM_MODBUS",
    )
} | {
    "R": Family("R[{}]", 1, 200, _NUMBER),
    "PR": Family("PR[{}]", 1, 100, _POSITION),
    "POS": Family("POS[{}]", 0, 0, _POSITION),
    "PRG": Family("PRG[{}]", 1, 100, _PROGRAM),
    "ALM": Family("ALM[{}]", 1, 100, _ALARM),
    "UI": Family("UI[{}]", 1, 18, _SIGNAL),
    "UO": Family("UO[{}]", 1, 20, _SIGNAL),
    "DI": Family("DI[{}]", 1, 512, _SIGNAL),
    "DO": Family("DO[{}]", 1, 512, _SIGNAL),
    "RI": Family("RI[{}]", 1, 8, _SIGNAL),
    "RO": Family("RO[{}]", 1, 8, _SIGNAL),
    "SI": Family("SI[{}]", 0, 15, _SIGNAL),
    "SO": Family("SO[{}]", 0, 15, _SIGNAL),
    "$SHELL_CFG.$RSR_ENABLE": Family("$SHELL_CFG.$RSR_ENABLE[{}]", 1, 8, _NUMBER),
    "$SHELL_CFG.$NUM_RSR": Family("$SHELL_CFG.$NUM_RSR[{}]", 1, 8, _NUMBER),
    "$MOR_GRP[1].$CUR_DIS_TRQ": Family("$MOR_GRP[1].$CUR_DIS_TRQ[{}]", 1, 9, _NUMBER),
    "$MNUFRAMENUM": Family("$MNUFRAMENUM[{}]", 1, 1, _NUMBER),
    "$MNUTOOLNUM": Family("$MNUTOOLNUM[{}]", 1, 1, _NUMBER),
    "$MNUFRAME": Family("$MNUFRAME[1,{}]", 1, MOST["user"], _POSITION),
    "$MNUTOOL": Family("$MNUTOOL[1,{}]", 1, MOST["tool"], _POSITION),
    "$SNPX_ASG.$ADDRESS": Family("$SNPX_ASG[{}].$ADDRESS", 1, SLOTS, _NUMBER),
    "$SNPX_ASG.$SIZE": Family("$SNPX_ASG[{}].$SIZE", 1, SLOTS, _NUMBER),
    "$SNPX_ASG.$VAR_NAME": Family(
        "$SNPX_ASG[{}].$VAR_NAME", 1, SLOTS, _fields((ValueKind.TEXT, 40, 1))
    ),
    "$SNPX_ASG.$MULTIPLY": Family("$SNPX_ASG[{}].$MULTIPLY", 1, SLOTS, _NUMBER),
}
FRAME_KINDS: dict[str, Kind] = {"$MNUFRAME": "user", "$MNUTOOL": "tool"}
_NAME = re.compile(
    r"(?P<begin>\$MOR_GRP\[1\]|\$?[A-Z_]+)(?:\[(?P<group>1,)?(?P<index>\d{1,5})\])?(?P<end>\.\$[A-Z_]+)?(?:\[(?P<last>\d{1,5})\])?"
    r"(?:@(?P<first>\d{1,3})\.(?P<words>\d{1,3}))?",
    re.ASCII,
)


class Cell(NamedTuple):
    """One value of one element."""

    family: str
    element: int
    field: Field

    def __str__(self) -> str:
        return FAMILIES[self.family].form.format(self.element)


@dataclass(frozen=True, slots=True)
class Variable:
    """A name, understood.

    Attributes:
        family: Key of ``FAMILIES``.
        index: Of the first element.
        first: First word of each element that is taken, counted from 1.
        words: How many words of each element are taken.
    """

    family: str
    index: int
    first: int
    words: int

    def place(self, word: int) -> tuple[Cell, int] | None:
        """Return what word number ``word``, counted from 0, belongs to, and where in it.

        None: behind the last element.
        """
        family = FAMILIES[self.family]
        elements, within = divmod(word, self.words)
        index, at = self.index + elements, self.first + within
        if index > family.highest:
            return None
        field = next(field for field in family.fields if at < field.first + field.words)
        return Cell(self.family, index, field), at - field.first


def _fits(found: re.Match[str], family: Family) -> bool:
    """Return whether an index stands where the variable has its own, and nowhere else."""
    last = found["end"] is not None and family.form.endswith("[{}]")
    first = "{}]" in family.form and not last
    if (found["group"] is not None) != ("[1,{}]" in family.form):
        return False
    return (found["index"] is not None) == first and (found["last"] is not None) == last


def parse(name: str) -> Variable:
    """Return the variable called ``name``.

    Raises:
        VariableError: There is no such variable, element or word.
    """
    found = _NAME.fullmatch(name)
    key = (found["begin"] + (found["end"] or "")) if found else ""
    family = FAMILIES.get(key)
    if found is None or family is None or not _fits(found, family):
        known = ", ".join(family.form.format("n") for family in FAMILIES.values())
        raise VariableError(f"{name!r} is no variable of the stand-in: there are {known}")
    index = int(found["index"] or found["last"] or 1)
    if not family.lowest <= index <= family.highest:
        raise VariableError(f"{name!r}: the index is outside [{family.lowest}, {family.highest}]")
    if found["first"] is None:
        return Variable(key, index, 1, family.words)
    first, words = int(found["first"]), int(found["words"])
    if min(first, words) < 1 or first + words - 1 > family.words:
        raise VariableError(f"{name!r}: an element has the words 1 to {family.words}")
    return Variable(key, index, first, words)
