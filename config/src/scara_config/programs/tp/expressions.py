"""Read what stands in a line beside its fixed words: numbers, registers, signals, conditions."""

from __future__ import annotations

import re

from scara_config.loader import ConfigError
from scara_config.programs.tp.listing import (
    Binary,
    Bracket,
    Expression,
    Indexed,
    Name,
    PulseTime,
    Text,
    Unary,
)

VARIABLES = (
    *("R", "PR", "P", "SR", "AR", "F", "M", "TIMER", "TIMER_OVERFLOW", "UFRAME", "UTOOL", "PL"),
    *("DI", "DO", "RI", "RO", "UI", "UO", "SI", "SO", "GI", "GO", "AI", "AO", "WI", "WO", "LBL"),
    *("PAYLOAD", "UALM", "SOFTFLOAT", "JOINT_MAX_SPEED"),
)
"""What stands before a bracket."""
NAMES = (
    *("ON", "OFF", "LPOS", "JPOS", "START", "STOP", "RESET", "Constant", "OVERRIDE"),
    *("UFRAME_NUM", "UTOOL_NUM", "LINEAR_MAX_SPEED", "ERR_NUM"),
)
"""Words without a bracket."""
DEEPEST = 40
"""Brackets within each other [our]: controllers' own files have four."""
_LEVELS = (
    ("OR",),
    ("AND",),
    ("=", "<>"),
    ("<", ">", "<=", ">="),
    ("+", "-"),
    ("*", "/", "DIV", "MOD"),
)
"""Operators of two operands, from the loosest to the tightest."""
_OPERATOR = re.compile(r"<>|<=|>=|[<>=+\-*/]|(?:OR|AND)\b|DIV|MOD")
_NUMBER = re.compile(r"\d+\.?\d*|\.\d+")
_SYSTEM = re.compile(r"\$(?:\[\w+\])?\w+(?:\[[^\]]*\])?(?:\.\$?\w+(?:\[[^\]]*\])?)*")
_VARIABLE = re.compile(r"([A-Z_]+)\[")
_NAME = re.compile(r"(ON\+|OFF-|[A-Za-z_]+)")
_GROUP = re.compile(r"GP(\d):")


class LineError(ConfigError):
    """A line is not understood; the text says what was expected, and what stands there."""


class Cursor:
    """A place in the text of a line; each method that finds what it wants moves it on."""

    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        # Operands that have begun within each other.
        self.depth = 0

    @property
    def rest(self) -> str:
        """What has not been read, without blanks in front."""
        return self.text[self.at :].lstrip()

    def find(self, pattern: str | re.Pattern[str]) -> re.Match[str] | None:
        """Return what stands here if the pattern fits."""
        start = len(self.text) - len(self.rest)
        found = re.compile(pattern).match(self.text, start)
        if found is not None:
            self.at = found.end()
        return found

    def expect(self, pattern: str, what: str) -> re.Match[str]:
        """Return what stands here.

        Raises:
            LineError: Something else does.
        """
        found = self.find(pattern)
        if found is None:
            raise LineError(f"{what} is expected at {self.rest[:40]!r}")
        return found

    def end(self) -> None:
        """Raise LineError unless all was read."""
        if self.rest:
            raise LineError(f"{self.rest[:40]!r} is not understood")


def expression(cursor: Cursor, level: int = 0) -> Expression:
    """Read an expression.

    Raises:
        LineError: There is none.
    """
    if level == len(_LEVELS):
        return operand(cursor)
    found = expression(cursor, level + 1)
    while True:
        here = cursor.at
        operator = cursor.find(_OPERATOR)
        if operator is None or operator[0] not in _LEVELS[level]:
            cursor.at = here
            return found
        found = Binary(operator[0], found, expression(cursor, level + 1))


def operand(cursor: Cursor) -> Expression:
    """Read one operand.

    Raises:
        LineError: There is none, or it stands in too many brackets.
    """
    # Deeper, Python's own stack would end before the text does.
    if cursor.depth == DEEPEST:
        raise LineError(f"more than {DEEPEST} operands stand within each other")
    cursor.depth += 1
    found = _operand(cursor)
    cursor.depth -= 1
    return found


def _operand(cursor: Cursor) -> Expression:
    if sign := cursor.find(r"[!-]"):
        inner = operand(cursor)
        if sign[0] == "-" and isinstance(inner, float):
            return -inner
        return Unary(sign[0], inner)
    if cursor.find(r"\("):
        bracket = Bracket(expression(cursor))
        cursor.expect(r"\)", "a closing bracket")
        return bracket
    if number := cursor.find(_NUMBER):
        return float(number[0])
    if quoted := cursor.find(r"'([^']*)'"):
        return Text(quoted[1])
    if system := cursor.find(_SYSTEM):
        return Name(system[0])
    if found := indexed(cursor):
        return found
    return word(cursor)


def indexed(cursor: Cursor) -> Indexed | None:
    """Read a variable with its bracket, if one stands here.

    Raises:
        LineError: What stands in the bracket is no index.
    """
    here = cursor.at
    kind = cursor.find(_VARIABLE)
    if kind is None or kind[1] not in VARIABLES:
        cursor.at = here
        return None
    group = cursor.find(_GROUP)
    index = [operand(cursor)]
    if cursor.find(r","):
        index.append(operand(cursor))
    # A comment may hold brackets, if they are a pair.
    comment = cursor.find(r":((?:[^\[\]]|\[[^\]]*\])*)")
    cursor.expect(r"\]", "a closing bracket")
    return Indexed(
        kind[1], tuple(index), int(group[1]) if group else 0, comment[1] if comment else ""
    )


def variable(cursor: Cursor, *kinds: str) -> Indexed:
    """Read a variable of one of these kinds.

    Raises:
        LineError: Something else stands here.
    """
    rest = cursor.rest
    found = indexed(cursor)
    if found is None or found.kind not in kinds:
        raise LineError(f"{' or '.join(kinds)} is expected at {rest[:40]!r}")
    return found


def word(cursor: Cursor) -> Name:
    """Read a word that stands for itself.

    Raises:
        LineError: It is not one of those.
    """
    rest = cursor.rest
    found = cursor.find(_NAME)
    # ON+ and OFF- are the edges of a signal.
    if found is None or found[1].rstrip("+-") not in NAMES:
        raise LineError(f"a value is expected at {rest[:40]!r}")
    return Name(found[1])


def value(cursor: Cursor) -> Expression:
    """Read what is assigned: an expression or a pulse.

    Raises:
        LineError: Neither stands here.
    """
    if cursor.find(r"PULSE\b") is None:
        return expression(cursor)
    if cursor.find(r",") is None:
        return PulseTime()
    seconds = operand(cursor)
    cursor.expect(r"sec", "sec")
    return PulseTime(seconds)
