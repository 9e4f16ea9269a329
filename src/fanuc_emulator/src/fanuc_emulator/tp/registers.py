"""Registers and signals as the robot's programs see them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from scara_config.programs.tp.expressions import Cursor, operand
from scara_config.programs.tp.listing import Indexed, Name, PulseTime
from scara_config.programs.tp.printer import print_expression
from scara_config.programs.tp.values import (
    ExecutionError,
    Memory,
    Pose,
    Value,
    as_number,
)

HIGHEST = 200
"""Index of the last register [our]: as many as the stand-in shows."""
NUMBERS = ("R", "TIMER", "GI", "GO", "AI", "AO")
SIGNALS = ("F", "M", "DI", "DO", "RI", "RO", "UI", "UO", "SI", "SO")
AXES = 9
"""Numbers of a position."""
SELECTED = ("UFRAME_NUM", "UTOOL_NUM", "$WAITTMOUT")
"""Names that are kept; frame and tool do not matter to joint positions."""

Place = Indexed | Name


class Registers:
    """What no program has set is 0 or OFF.

    Args:
        reads: What stands in places that belong to the controller, as a program names them.
        writes: What setting such a place does; one that is in ``reads`` alone cannot be set.
    """

    def __init__(
        self,
        reads: Mapping[str, Callable[[], Value]] | None = None,
        writes: Mapping[str, Callable[[Value], None]] | None = None,
    ) -> None:
        self._reads = {operand(Cursor(name)): read for name, read in (reads or {}).items()}
        self._writes = {operand(Cursor(name)): write for name, write in (writes or {}).items()}
        self._values: dict[Place, Value] = {Name("$WAITTMOUT"): 3000.0}

    def read(self, place: Place) -> Value:
        """Return what stands there.

        Raises:
            ExecutionError: The stand-in has no such place, or a position was never set.
        """
        read = self._reads.get(place)
        if read is not None:
            return read()
        if place in self._values:
            return self._values[place]
        if isinstance(place, Indexed) and place.kind == "PR":
            return self._element(place)
        self._check(place)
        return False if isinstance(place, Indexed) and place.kind in SIGNALS else 0.0

    def write(self, place: Place, value: Value | PulseTime) -> None:
        """Set what stands there.

        Raises:
            ExecutionError: It cannot be set.
        """
        shown = print_expression(place)
        if isinstance(value, PulseTime):
            raise ExecutionError(f"{shown}: the stand-in makes no pulses")
        write = self._writes.get(place)
        if write is not None:
            write(value)
            return
        if isinstance(place, Indexed) and place.kind == "PR":
            self._set_position(place, value)
            return
        self._check(place)
        inputs = isinstance(place, Indexed) and place.kind in ("DI", "RI", "UI", "SI", "GI", "AI")
        if inputs or place in self._reads:
            raise ExecutionError(f"{shown} cannot be set")
        if isinstance(value, Pose):
            raise ExecutionError(f"{shown} holds no position")
        signal = isinstance(place, Indexed) and place.kind in SIGNALS
        self._values[place] = bool(value) if signal else float(value)

    def _element(self, place: Indexed) -> float:
        """Return PR[i,j]."""
        if len(place.index) == 1:
            self._check(place)
            raise ExecutionError(f"{print_expression(place)} was never set")
        whole, at = _whole(place)
        found = self.read(whole)
        assert isinstance(found, Pose)
        return found.values[at]

    def _set_position(self, place: Indexed, value: Value) -> None:
        """Set PR[i] or PR[i,j]."""
        if len(place.index) == 1:
            self._check(place)
            if not isinstance(value, Pose):
                raise ExecutionError(f"{print_expression(place)} holds a position")
            self._values[place] = value
            return
        whole, at = _whole(place)
        found = self.read(whole)
        assert isinstance(found, Pose)
        values = (*found.values[:at], as_number(value), *found.values[at + 1 :])
        self.write(whole, Pose(values, found.config))

    def _check(self, place: Place) -> None:
        known = (
            place.word in SELECTED
            if isinstance(place, Name)
            else place.kind in (*NUMBERS, *SIGNALS, "PR")
            and len(place.index) == 1
            and 1 <= float(place.index[0]) <= HIGHEST  # type: ignore[arg-type]
        )
        if not known:
            raise ExecutionError(f"the stand-in keeps no {print_expression(place)}")


def _whole(place: Indexed) -> tuple[Indexed, int]:
    """Return the position register of PR[i,j], and which of its numbers j is, from 0.

    Raises:
        ExecutionError: It has no such number.
    """
    index, element = place.index
    at = int(element) - 1  # type: ignore[arg-type]
    if not 0 <= at < AXES:
        raise ExecutionError(f"{print_expression(place)}: a position has {AXES} numbers")
    return Indexed("PR", (index,)), at


class CalledRegisters:
    """Registers as a program sees them that was called with arguments, AR[n]."""

    def __init__(self, registers: Memory, arguments: Sequence[Value]) -> None:
        self._registers, self._arguments = registers, arguments

    def read(self, place: Place) -> Value:
        """Return an argument, or what stands in a register.

        Raises:
            ExecutionError: There is no such argument or place.
        """
        if not isinstance(place, Indexed) or place.kind != "AR":
            return self._registers.read(place)
        number = int(float(place.index[0]))  # type: ignore[arg-type]
        if not 1 <= number <= len(self._arguments):
            raise ExecutionError(f"AR[{number}]: {len(self._arguments)} arguments were given")
        return self._arguments[number - 1]

    def write(self, place: Place, value: Value | PulseTime) -> None:
        """Set a register.

        Raises:
            ExecutionError: It cannot be set.
        """
        self._registers.write(place, value)
