"""What stands in registers and signals, and what an expression of them comes to."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from functools import lru_cache
from typing import Any, Protocol

import msgspec

from scara_config.loader import ConfigError
from scara_config.programs.tp.listing import (
    Binary,
    Bracket,
    Expression,
    Indexed,
    Name,
    PulseTime,
    Unary,
)

POSE_NUMBERS = 9
"""Numbers of a position."""


class Pose(msgspec.Struct, frozen=True):
    """A position as a register holds it [deg, mm].

    Attributes:
        values: J1 to J9, or X Y Z W P R E1 E2 E3.
        config: Arm configuration of a Cartesian one; None: it is one of joints.
    """

    values: tuple[float, ...]
    config: str | None = None


Value = float | bool | Pose
Written = Value | PulseTime | Name
"""What is set: a value, a pulse, or START, STOP and RESET of a timer."""
TIMER_WORDS = ("START", "STOP", "RESET")


class ExecutionError(ConfigError):
    """A line cannot be executed; the text says why."""


class Memory(Protocol):
    """Registers and signals."""

    def read(self, place: Indexed | Name) -> Value:
        """Return what stands there; an index is a number.

        Raises:
            ExecutionError: There is nothing of that name, or it is not known.
        """

    def write(self, place: Indexed | Name, value: Written) -> None:
        """Set what stands there.

        Raises:
            ExecutionError: It cannot be set.
        """


Evaluator = Callable[[Memory], Value]
"""Returns the value of an expression."""


def resolved(place: Indexed | Name, memory: Memory) -> Indexed | Name:
    """Return a variable with numbers as indices, without its comment and its motion group, 1."""
    found = fixed(place)
    if found is not None:
        return found
    assert isinstance(place, Indexed)
    index = tuple(number(each, memory) for each in place.index)
    return Indexed(place.kind, index)


def fixed(place: Indexed | Name) -> Indexed | Name | None:
    """Return a variable without comment and motion group; None: its index is in another one."""
    if isinstance(place, Name) or (
        not (place.comment or place.group)
        and all(isinstance(index, float) for index in place.index)
    ):
        return place
    if not all(isinstance(index, float) for index in place.index):
        return None
    return Indexed(place.kind, place.index)


def truth(expression: Expression, memory: Memory) -> bool:
    """Return whether a condition holds.

    Raises:
        ExecutionError: It is no condition.
    """
    return is_true(evaluate(expression, memory))


def number(expression: Expression, memory: Memory) -> float:
    """Return a number; ON is 1, OFF is 0."""
    return as_number(evaluate(expression, memory))


def evaluate(expression: Expression, memory: Memory) -> Value:
    """Return the value of an expression.

    Raises:
        ExecutionError: It has none: a text, a division by zero, ON where a number belongs, one
            beyond the largest number.
    """
    return evaluator(expression)(memory)


@lru_cache(maxsize=4096)
def evaluator(expression: Expression) -> Evaluator:
    """Return the function that evaluates an expression: to find it again takes no time.

    It raises ExecutionError as :func:`evaluate` does.
    """
    match expression:
        case float():
            return lambda memory: expression
        case Name(word="ON"):
            return lambda memory: True
        case Name(word="OFF"):
            return lambda memory: False
        case Name():
            return lambda memory: memory.read(expression)
        case Indexed():
            place = fixed(expression)
            if place is None:
                return lambda memory: memory.read(resolved(expression, memory))
            return lambda memory: memory.read(place)
        case Bracket():
            return evaluator(expression.inner)
        case Unary(operator="!"):
            inner = evaluator(expression.operand)
            return lambda memory: not is_true(inner(memory))
        case Unary():
            inner = evaluator(expression.operand)
            return lambda memory: -as_number(inner(memory))
        case Binary():
            return _of_two(expression)
    return _without_value


def _of_two(expression: Binary) -> Evaluator:
    left, right = evaluator(expression.left), evaluator(expression.right)
    if expression.operator == "AND":

        def both(memory: Memory) -> Value:
            found = left(memory)
            # What is false on the left decides alone; else both have to be ON or OFF.
            return False if found is False else is_true(found) and is_true(right(memory))

        return both
    if expression.operator == "OR":
        return lambda memory: is_true(left(memory)) or is_true(right(memory))
    operation = _OPERATIONS[expression.operator]
    divides = expression.operator in ("/", "DIV", "MOD")
    place = fixed(expression.left) if isinstance(expression.left, Indexed) else None
    constant = expression.right
    if place is not None and isinstance(constant, float) and not divides:
        # The usual condition, with as few calls as can be.
        def compared(memory: Memory) -> Value:
            found = memory.read(place)
            if found.__class__ is Pose:
                raise ExecutionError("a position is no number")
            return operation(found, constant)

        return compared

    def value(memory: Memory) -> Value:
        first, second = left(memory), right(memory)
        if first.__class__ is Pose or second.__class__ is Pose:
            return _moved(first, second, expression.operator)
        if divides and second == 0.0:
            raise ExecutionError("division by zero")
        return operation(first, second)

    return value


def _moved(first: Value, second: Value, operator: str) -> Pose:
    """Return the sum or the difference of two positions, number by number."""
    if not isinstance(first, Pose) or not isinstance(second, Pose) or operator not in "+-":
        raise ExecutionError("a position can only be added to or taken from another one")
    if (first.config is None) != (second.config is None):
        raise ExecutionError("one position is in joints, the other one is not")
    sign = 1.0 if operator == "+" else -1.0
    values = tuple([as_number(a + sign * b) for a, b in zip(first.values, second.values)])
    return Pose(values, first.config)


def is_true(value: Value) -> bool:
    """Return a value that is ON or OFF.

    Raises:
        ExecutionError: It is a number.
    """
    if not isinstance(value, bool):
        shown = "a position" if isinstance(value, Pose) else f"{value:g}"
        raise ExecutionError(f"{shown} is neither ON nor OFF")
    return value


def as_number(value: Value) -> float:
    """Return a number; ON is 1, OFF is 0.

    Raises:
        ExecutionError: It is a position, or beyond the largest number.
    """
    if isinstance(value, Pose):
        raise ExecutionError("a position is no number")
    found = float(value)
    if not math.isfinite(found):
        raise ExecutionError(f"{found:g} is no number that a register holds")
    return found


def _without_value(_: Memory) -> Value:
    raise ExecutionError("has no value here")


_OPERATIONS: dict[str, Callable[[Any, Any], Value]] = {
    "=": operator.eq,
    "<>": operator.ne,
    "<": operator.lt,
    ">": operator.gt,
    "<=": operator.le,
    ">=": operator.ge,
    # As floats: two signals, each of which counts as 1, would add up to an int.
    "+": lambda a, b: as_number(a + b),
    "-": lambda a, b: as_number(a - b),
    "*": lambda a, b: as_number(a * b),
    "/": lambda a, b: as_number(a / b),
    "DIV": lambda a, b: float(math.trunc(as_number(a / b))),
    "MOD": lambda a, b: math.fmod(as_number(a), as_number(b)),
}
