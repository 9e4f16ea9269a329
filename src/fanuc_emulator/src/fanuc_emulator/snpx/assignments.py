"""The table $SNPX_ASG: eighty entries that say what stands at which address.

Where entries overlap, the one with the lower number wins.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from scara_config import ConfigError
from scara_config.modbus_map import ModbusMap, Register

from fanuc_emulator.registers import RegisterError
from fanuc_emulator.snpx.variables import NAME_LENGTH, SLOTS, Variable, VariableError, parse

ADDRESSES = 16384
"""The controller has so many registers %R."""
BOOTSTRAP = 16300
"""Here entries 76 to 79 show the four values of entry 80, by which a client reaches all others."""
_FIRST_BOOTSTRAP, _REACHED = 76, 80


class AssignmentError(RegisterError):
    """A value does not fit an entry; the text names entry, value and allowed range."""


@dataclass(frozen=True, slots=True)
class Assignment:
    """One entry.

    Attributes:
        address: Of its first register, counted from 1; 0: the entry is empty.
        size: How many registers; 0: the entry is empty.
        name: The variable, ``$VAR_NAME``.
        multiply: 0: float32; else int32 of the value times this; texts take any.
    """

    address: int = 0
    size: int = 0
    name: str = ""
    multiply: float = 1.0


def assigns(layout: ModbusMap) -> bool:
    """Return whether the robot of this map has the table: its registers name variables."""
    return any(register.variable for register in layout.holding_registers.values())


def power_up(layout: ModbusMap) -> list[Assignment]:
    """Return the entries by which the registers stand where modbus_map.yaml says.

    Raises:
        ConfigError: A register has no variable, or one that does not fit; there are too many.
    """
    registers = sorted(layout.holding_registers.items(), key=lambda item: item[1].address)
    entries = [_entry(name, register) for name, register in registers]
    if len(entries) >= _FIRST_BOOTSTRAP:
        raise ConfigError(
            f"modbus_map.yaml: holding_registers has {len(entries)} registers with a variable: "
            f"$SNPX_ASG takes {_FIRST_BOOTSTRAP - 1}"
        )
    entries += [Assignment()] * (_FIRST_BOOTSTRAP - 1 - len(entries))
    reached = f"$SNPX_ASG[{_REACHED}]"
    return [
        *entries,
        Assignment(BOOTSTRAP, 2, f"{reached}.$ADDRESS", 1.0),
        Assignment(BOOTSTRAP + 2, 2, f"{reached}.$SIZE", 1.0),
        Assignment(BOOTSTRAP + 4, 40, f"{reached}.$VAR_NAME", -1.0),
        Assignment(BOOTSTRAP + 44, 2, f"{reached}.$MULTIPLY", 0.0),
        Assignment(),
    ]


def _entry(name: str, register: Register) -> Assignment:
    """Return the entry of one register of the map."""
    key = f"modbus_map.yaml: holding_registers.{name}"
    if not register.variable:
        raise ConfigError(f"{key}.variable: is missing, but other registers have one")
    try:
        parse(register.variable)
    except VariableError as error:
        raise ConfigError(f"{key}.variable = {error}") from error
    multiply = {"float32": 0.0, "string": -1.0}.get(register.type, 1.0 / register.scale)
    return Assignment(register.address, register.words, register.variable, multiply)


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
