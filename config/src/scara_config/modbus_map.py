"""What stands where on a robot's Modbus server, by modbus_map.yaml.

Robots differ in where things stand and how they are written, not in what is needed of them. The
names are those of the first robot (UI and UO of a Fanuc controller); a map says for another one by
what register, bit or command code it does the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scara_config.loader import ConfigError, load
from scara_config.map_entries import (
    COMMANDS,
    ENTRIES,
    FAST_CLOCK,
    FAST_CLOCK_MS,
    GRIPPER_INPUTS,
    GRIPPER_OUTPUTS,
    INPUTS,
    LEVELS,
    OUTPUTS,
    PANEL_INPUTS,
    PANEL_OUTPUTS,
    WHOLE,
    WRITTEN,
)
from scara_config.profile import locate

Address = Annotated[int, Meta(ge=1, le=65536)]
Code = Annotated[int, Meta(ge=1, le=32767)]
Table = Literal["holding_registers", "input_registers"]
TABLES: tuple[Table, ...] = ("holding_registers", "input_registers")
WORDS = {"int16": 1, "int32": 2, "float32": 2, "string": 1}

AXES = ("position", "velocity", "motor_torque", "setpoint")
# A robot may take set points ahead of their time: then it has all of these, else none. Those that
# tell of all places hold one value, or one set point, for each.
RING = ("ring_setpoint", "ring_clock_ms", "ring_write", "ring_read", "ring_underruns")
RING_NUMBERS = 32760
"""Set points ahead are numbered 1..32760, then from 1 again; number n stands in place (n - 1)
modulo the number of places."""
_RING_WRITTEN = ("ring_setpoint", "ring_clock_ms", "ring_write")


class Register(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One value (or ``count`` equal ones in a row).

    ``scale`` is what one count of an integer means in ``unit``; ``variable`` is what a controller
    with ``$SNPX_ASG`` has assigned to the address.
    """

    address: Address
    type: Literal["int16", "int32", "float32", "string"]
    unit: str
    meaning: str
    count: Annotated[int, Meta(ge=1, le=512)] = 1
    scale: Annotated[float, Meta(ge=1e-9, le=1e9)] = 1.0
    write: bool = False
    variable: str = ""

    @property
    def multiply(self) -> float:
        """``$MULTIPLY`` of its slot in ``$SNPX_ASG``: texts take any, 0 is a float32."""
        of_a_count = FAST_CLOCK_MS if self.variable == FAST_CLOCK else 1.0
        return {"float32": 0.0, "string": -1.0}.get(self.type, of_a_count / self.scale)

    @property
    def words(self) -> int:
        """How many 16-bit words it takes; a string counts words, not characters."""
        return WORDS[self.type] * self.count

    @property
    def offset(self) -> int:
        """PDU address: the manual's number minus one."""
        return self.address - 1


class Bit(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One coil or discrete input; ``normal``: level at rest, ``pulse_ms``: a pulse's length."""

    address: Address
    meaning: str
    write: bool = False
    normal: bool = False
    pulse_ms: Annotated[int, Meta(ge=0, le=1000)] = 0

    @property
    def offset(self) -> int:
        """PDU address: the manual's number minus one."""
        return self.address - 1


class SignalWord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Signals as bits of one register, bit 0 the lowest."""

    register: str
    bits: dict[str, Annotated[int, Meta(ge=0, le=15)]]


class SignalCode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Command codes of one input: of its two levels, or of an event."""

    low: Code | None = None
    high: Code | None = None
    pulse: Code | None = None


class CommandWord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Commands by number.

    One counts when ``sequence`` changes, and the robot then shows it in ``echo``.

    Attributes:
        register: Takes the code; the next register is ``sequence``.
        sequence: Takes the sequence number, 1..32767.
        echo: Shows the sequence number of the last command that was taken.
        codes: Of each input.
    """

    register: str
    sequence: str
    echo: str
    codes: dict[str, SignalCode]


class ModbusMap(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What stands where on the robot's Modbus server.

    Attributes:
        holding_registers: Read by function 3, written by 6 and 16.
        input_registers: Read by function 4.
        coils: Inputs of the robot; empty if it has a ``command_word``.
        discrete_inputs: Outputs of the robot; empty if it has a ``status_word``.
        status_word: Outputs of the robot as bits of a register.
        switches_word: Levels of the inputs as bits of a register, beside a ``command_word``.
        command_word: Inputs of the robot as numbered commands.
    """

    device_id: Annotated[int, Meta(ge=1, le=247)]
    word_order: Literal["low_first", "high_first"]
    holding_registers: dict[str, Register]
    input_registers: dict[str, Register] = {}
    coils: dict[str, Bit] = {}
    discrete_inputs: dict[str, Bit] = {}
    status_word: SignalWord | None = None
    switches_word: SignalWord | None = None
    command_word: CommandWord | None = None

    def table_of(self, name: str) -> Table | None:
        """Return the table that holds the register ``name``, None if there is no such register."""
        return next((table for table in TABLES if name in getattr(self, table)), None)

    def find(self, name: str) -> Register | None:
        """Return the register ``name`` of either table, None if there is none."""
        return self.holding_registers.get(name) or self.input_registers.get(name)

    @property
    def leads(self) -> bool:
        """Something of it is written: the map is of a robot that may be led."""
        return any(register.write for register in self.holding_registers.values())

    def left_out(self) -> Iterator[tuple[str, str]]:
        """Yield each quantity that the robot does not give, and what stands in its place."""
        yield from ((name, one.instead) for name, one in ENTRIES.items() if not self.find(name))

    @property
    def has_outputs(self) -> bool:
        """The robot shows its signals."""
        return bool(self.discrete_inputs) or self.status_word is not None

    @property
    def ring_places(self) -> int:
        """How many set points ahead of their time the robot takes; 0: none."""
        times = self.find("ring_clock_ms")
        return times.count if times is not None else 0

    @property
    def shows_mode(self) -> bool:
        """The robot tells at what its mode switch stands."""
        return self.find("mode_b0") is not None

    @property
    def has_gripper(self) -> bool:
        """The robot has a suction gripper that a client can switch."""
        return self._has_any((*GRIPPER_INPUTS, *GRIPPER_OUTPUTS))

    @property
    def shows_gripper(self) -> bool:
        """The robot tells whether its suction is on, by a signal or by a number."""
        return self.has_gripper or self.find("suction_now") is not None

    @property
    def has_panel(self) -> bool:
        """The robot shows the buttons of the person beside it."""
        return self._has_any((*PANEL_INPUTS, *PANEL_OUTPUTS))

    def _has_any(self, names: Iterable[str]) -> bool:
        inputs = self.command_word.codes if self.command_word else self.coils
        outputs = self.status_word.bits if self.status_word else self.discrete_inputs
        return any(name in inputs or name in outputs for name in names)


def number_after(number: int) -> int:
    """Return the number of the set point ahead that comes after ``number``; 1 after 0, none yet."""
    return number % RING_NUMBERS + 1


def load_modbus_map(directory: Path | str | None = None) -> ModbusMap:
    """Read modbus_map.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, two registers overlap, a needed register or
            signal is missing or of another kind, a signal is unknown.
    """
    path = locate("modbus_map.yaml", directory)
    layout = load(path, ModbusMap)
    for problem in problems(layout):
        raise ConfigError(f"{path}: {problem}")
    return layout


def problems(layout: ModbusMap) -> Iterator[str]:
    """Yield everything that is wrong with a map, as text."""
    for table in TABLES:
        yield from _overlaps(table, getattr(layout, table))
    for name in sorted(set(layout.holding_registers) & set(layout.input_registers)):
        yield f"input_registers.{name}: stands in holding_registers too"
    for kind in ("coils", "discrete_inputs"):
        addresses = [bit.address for bit in getattr(layout, kind).values()]
        if len(set(addresses)) != len(addresses):
            yield f"{kind}: an address occurs more than once"
    yield from _wrong_registers(layout)
    yield from _wrong_ring(layout)
    yield from _wrong_outputs(layout)
    yield from _wrong_inputs(layout)


def _overlaps(table: str, registers: dict[str, Register]) -> Iterator[str]:
    ordered = sorted(registers.items(), key=lambda item: item[1].address)
    for (name, register), (after, following) in pairwise(ordered):
        if register.address + register.words > following.address:
            last = register.address + register.words - 1
            yield (
                f"{table}.{after}.address = {following.address}: overlaps {name}, which ends at "
                f"{last}"
            )


def _wrong_registers(layout: ModbusMap) -> Iterator[str]:
    """Yield registers that both sides use and that are missing or not of the kind they use."""
    for name, entry in ENTRIES.items():
        register, table = layout.find(name), layout.table_of(name)
        one = 6 if name == "alarm_time" else 1
        if register is None:
            if entry.need == "follow" or (entry.need == "lead" and layout.leads):
                yield f"holding_registers.{name}: is missing"
        elif register.type not in entry.types:
            yield f"{table}.{name} = {register.type}: must be {' or '.join(entry.types)}"
        elif name not in AXES and register.type != "string" and register.count != one:
            yield f"{table}.{name} = {register.type}, count {register.count}: must be one number"
        elif name == "clock_ms" and 2.0 * register.scale % 1.0:
            yield f"{table}.{name}.scale = {register.scale:g}: must be a multiple of 0.5"
        elif name in WRITTEN and (table != "holding_registers" or not register.write):
            yield f"{table}.{name}: must be a holding register with write: true"
    for name, other in (("mode_b0", "mode_b1"), ("mode_b1", "mode_b0")):
        if layout.find(other) is not None and layout.find(name) is None:
            yield f"holding_registers.{name}: is missing, but {other} is there"
    counts = {name: register.count for name in AXES if (register := layout.find(name)) is not None}
    if len(set(counts.values())) > 1:
        yield (
            f"{', '.join(counts)} = {', '.join(map(str, counts.values()))} values: must be as "
            "many each"
        )


def _wrong_ring(layout: ModbusMap) -> Iterator[str]:
    """Yield what is wrong with the ring of set points ahead, if the map has one."""
    found = {name: register for name in RING if (register := layout.find(name)) is not None}
    if not found:
        return
    for name in (name for name in RING if name not in found):
        yield f"holding_registers.{name}: is missing, but {next(iter(found))} is there"
    for name, register in found.items():
        table = layout.table_of(name)
        if name != "ring_setpoint" and register.type not in WHOLE:
            yield f"{table}.{name} = {register.type}: must be int16 or int32"
        if name in _RING_WRITTEN and (table != "holding_registers" or not register.write):
            yield f"{table}.{name}: must be a holding register with write: true"
    one, all_of, times = (layout.find(name) for name in ("setpoint", "ring_setpoint", RING[1]))
    if one is None or all_of is None or times is None:
        return
    if (all_of.type, all_of.scale) != (one.type, one.scale):
        yield (
            f"holding_registers.ring_setpoint = {all_of.type}, scale {all_of.scale:g}: must be as "
            f"setpoint, {one.type}, scale {one.scale:g}"
        )
    if all_of.count != times.count * one.count:
        yield (
            f"holding_registers.ring_setpoint.count = {all_of.count}: must be {one.count} for each"
            f" of ring_clock_ms's {times.count} places, {times.count * one.count}"
        )
    if times.type != "int32" or not 2 <= times.count <= 40 or RING_NUMBERS % times.count:
        yield (
            f"holding_registers.ring_clock_ms = {times.type}, count {times.count}: must be int32,"
            f" count 2 to 40 and a divisor of {RING_NUMBERS}"
        )


def _wrong_outputs(layout: ModbusMap) -> Iterator[str]:
    if not (layout.leads or layout.has_outputs):
        return
    names = OUTPUTS + (GRIPPER_OUTPUTS if layout.has_gripper else ())
    names += PANEL_OUTPUTS if layout.has_panel else ()
    if layout.status_word is None:
        yield from _wrong_names("discrete_inputs", layout.discrete_inputs, names)
        return
    if layout.discrete_inputs:
        yield "status_word: there are discrete_inputs too"
    yield from _wrong_names("status_word.bits", layout.status_word.bits, names)
    yield from _wrong_word(layout, "status_word", layout.status_word)


def _wrong_word(layout: ModbusMap, key: str, word: SignalWord) -> Iterator[str]:
    register = layout.find(word.register)
    if register is None or register.words != 1:
        yield f"{key}.register = {word.register}: must be the name of a register of one word"
    if len(set(word.bits.values())) != len(word.bits):
        yield f"{key}.bits: a bit occurs more than once"


def _wrong_inputs(layout: ModbusMap) -> Iterator[str]:
    word, gripper = layout.command_word, GRIPPER_INPUTS if layout.has_gripper else ()
    panel = PANEL_INPUTS if layout.has_panel else ()
    if word is None:
        if layout.leads or layout.coils:
            yield from _wrong_coils(layout.coils, gripper, panel)
        return
    if layout.coils:
        yield "command_word: there are coils too"
    first, second, echo = map(layout.find, (word.register, word.sequence, word.echo))
    for key, register in (("register", first), ("sequence", second), ("echo", echo)):
        if register is None or register.words != 1:
            yield (
                f"command_word.{key} = {getattr(word, key)}: must be the name of a register of "
                "one word"
            )
    if (
        first
        and second
        and not (first.write and second.write and second.address == first.address + 1)
    ):
        yield (
            "command_word: register and sequence must be neighbours with write: true, to be "
            "written at once"
        )
    known = INPUTS + gripper + panel
    for name in sorted(set(word.codes) - set(known)):
        yield f"command_word.codes.{name}: is unknown, allowed are {', '.join(known)}"
    for name in (name for name in COMMANDS + gripper + panel if name not in word.codes):
        yield f"command_word.codes.{name}: is missing"
    for name, code in word.codes.items():
        if (code.pulse is None) == (code.low is None) or (code.low is None) != (code.high is None):
            yield f"command_word.codes.{name}: needs either low and high or pulse"
        elif name in COMMANDS + gripper and (code.pulse is None) != (name in LEVELS):
            form = "low and high: it is set, and taken back" if name in LEVELS else "pulse"
            yield f"command_word.codes.{name}: needs {form}"
    every = (value for code in word.codes.values() for value in (code.low, code.high, code.pulse))
    codes = [value for value in every if value is not None]
    if len(set(codes)) != len(codes):
        yield "command_word.codes: a code occurs more than once"
    if layout.switches_word is not None:
        yield from _wrong_word(layout, "switches_word", layout.switches_word)


def _wrong_coils(
    coils: dict[str, Bit], gripper: tuple[str, ...], panel: tuple[str, ...]
) -> Iterator[str]:
    yield from _wrong_names("coils", coils, INPUTS + gripper + panel)
    for name in (name for name in COMMANDS + gripper if name in coils):
        if not coils[name].write:
            yield f"coils.{name}.write = false: must be true, the robot is commanded by it"
        if name not in LEVELS and not coils[name].pulse_ms:
            yield f"coils.{name}.pulse_ms = 0: must be above 0, it is pulsed"
    for name in (name for name in panel if name in coils and coils[name].write):
        yield f"coils.{name}.write = true: must be false, it is the button of whoever stands there"


def _wrong_names(key: str, found: Iterable[str], names: tuple[str, ...]) -> Iterator[str]:
    for name in sorted(set(names) ^ set(found)):
        what = "is missing" if name in names else "is unknown, allowed are " + ", ".join(names)
        yield f"{key}.{name}: {what}"
