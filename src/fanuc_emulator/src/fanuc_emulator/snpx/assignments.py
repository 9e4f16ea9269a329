"""The table $SNPX_ASG: eighty entries that say what stands at which address.

Where entries overlap, the one with the lower number wins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from scara_config import ConfigError
from scara_config.modbus_map import ModbusMap
from scara_config.set_up.slots import (
    ADDRESSES,
    NAME_LENGTH,
    SLOTS,
    Assignment,
    slot_problems,
    slot_table,
)

from fanuc_emulator.registers import RegisterError
from fanuc_emulator.snpx.variables import Variable, VariableError, parse


class AssignmentError(RegisterError):
    """A value does not fit an entry; the text names entry, value and allowed range."""


def power_up(layout: ModbusMap) -> list[Assignment]:
    """Return the entries by which the registers stand where modbus_map.yaml says.

    Raises:
        ConfigError: A register has no variable, one that does not fit or a hidden address; there
            are too many.
    """
    for problem in slot_problems(layout):
        raise ConfigError(f"modbus_map.yaml: {problem}")
    for name, register in layout.holding_registers.items():
        try:
            parse(register.variable)
        except VariableError as error:
            key = f"holding_registers.{name}.variable"
            raise ConfigError(f"modbus_map.yaml: {key} = {error}") from error
    return slot_table(layout)


class AssignmentTable:
    """The entries as they are now.

    Args:
        entries: The first so many; the rest is empty.

    Attributes:
        version: Another number after each change.
    """

    def __init__(self, entries: Sequence[Assignment]) -> None:
        self._entries = [*entries, *[Assignment()] * (SLOTS - len(entries))]
        self._variables = [parse(entry.name) if entry.name else None for entry in self._entries]
        self.version = 0

    def __getitem__(self, slot: int) -> Assignment:
        """Entry number ``slot``, from 1."""
        return self._entries[slot - 1]

    def at(self, address: int) -> tuple[Assignment, Variable] | None:
        """Return the entry that counts for register ``address``, from 1, and its variable."""
        for entry, variable in zip(self._entries, self._variables):
            # Address 0 marks an empty entry.
            if entry.address <= address < entry.address + entry.size and entry.address:
                return None if variable is None else (entry, variable)
        return None

    def value(self, slot: int, field: str) -> float | str:
        """Return one value of an entry; ``field`` is ``$ADDRESS``, ``$SIZE`` and so on."""
        entry = self[slot]
        values = {"$ADDRESS": entry.address, "$SIZE": entry.size, "$MULTIPLY": entry.multiply}
        return entry.name if field == "$VAR_NAME" else values[field]

    def check(self, slot: int, field: str, value: float | str) -> None:
        """Refuse a value that does not fit.

        Raises:
            AssignmentError: An address or size outside [0, 16384], a factor that is not 0, -1 or in
                [0.0001, 10000], a name that is too long or of no variable.
        """
        self._changed(slot, field, value)

    def put(self, slot: int, field: str, value: float | str) -> None:
        """Change one value of an entry.

        Raises:
            AssignmentError: As :meth:`check`.
        """
        entry = self._changed(slot, field, value)
        self._entries[slot - 1] = entry
        self._variables[slot - 1] = parse(entry.name) if entry.name else None
        self.version += 1

    def _changed(self, slot: int, field: str, value: float | str) -> Assignment:
        """Return entry ``slot`` with one value changed, if it fits."""
        key = f"$SNPX_ASG[{slot}].{field}"
        if isinstance(value, str):
            if len(value) > NAME_LENGTH:
                raise AssignmentError(f"{key} = {value!r} is longer than {NAME_LENGTH} characters")
            try:
                if value:
                    parse(value)
            except VariableError as error:
                raise AssignmentError(f"{key} = {error}") from error
            return replace(self[slot], name=value)
        if field == "$MULTIPLY":
            if value not in (0.0, -1.0) and not 0.0001 <= value <= 10000.0:
                raise AssignmentError(f"{key} = {value:g} is not 0, -1 or in [0.0001, 10000]")
            return replace(self[slot], multiply=value)
        if not 0 <= value <= ADDRESSES:
            raise AssignmentError(f"{key} = {value:g} is outside [0, {ADDRESSES}]")
        number = round(value)
        if field == "$ADDRESS":
            return replace(self[slot], address=number)
        return replace(self[slot], size=number)
