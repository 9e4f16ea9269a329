"""Holding registers whose addresses are assigned by $SNPX_ASG.

A request becomes parts: stretches of the image, where a variable is assigned with the form that
modbus_map.yaml has for it, and single values that are converted. Parts are found once and kept
until an entry changes; at power-up a request is one stretch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import msgspec
from scara_config.frames import LETTERS, Kind
from scara_config.map_entries import FAST_CLOCK, FAST_CLOCK_MS, INPUTS, OUTPUTS
from scara_config.modbus_map import WORDS, ModbusMap, Register, Table
from scara_config.set_up.slots import delivered_table

from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.registers import NoRegisterError, RegisterError, Value
from fanuc_emulator.registers import decode as decode_register
from fanuc_emulator.registers import encode as encode_register
from fanuc_emulator.settings import ControllerSettings
from fanuc_emulator.snapshot import Snapshot
from fanuc_emulator.snpx.assignments import AssignmentTable, power_up
from fanuc_emulator.snpx.screens import panel_inputs, panel_outputs, variable
from fanuc_emulator.snpx.variables import FAMILIES, FRAME_KINDS, Cell, Field, ValueKind, parse
from fanuc_emulator.snpx.words import decode, encode, signed

_TABLE: Table = "holding_registers"
_LAST = 65536
"""The last address that a request can name."""
_KEPT = 256
"""So many requests are kept with their parts."""
_JOINT_FORM = range(27, 46)
"""Words of a position that say where its joints are: the stand-in keeps no Cartesian form."""
_SIGNALS_A_WORD = 16


@dataclass(slots=True)
class Stretch:
    """Registers in a row that stand in the image as they are.

    Where nothing is assigned to them they read 0, and a write is lost.
    """

    offset: int
    count: int
    assigned: bool = True


@dataclass(slots=True)
class Piece:
    """Words of one value.

    Attributes:
        cell: The value.
        first: Its first word that is asked for, counted from 0.
        count: How many are asked for.
        multiply: How it is converted.
        short: The slice ends before the value does: what is written is a number of one word.
    """

    cell: Cell
    first: int
    count: int
    multiply: float
    short: bool


Part = Stretch | Piece


@dataclass(slots=True)
class Changes:
    """What a request asks for, checked, before anything of it is done."""

    image: list[tuple[int, list[int]]] = field(default_factory=list)
    table: list[tuple[int, str, float | str]] = field(default_factory=list)
    others: dict[Cell, float | str] = field(default_factory=dict)


class AssignedRegisters:
    """Read and write by addresses that a client may assign.

    Args:
        layout: modbus_map.yaml; each of its registers names its variable.
        image: Words of those registers.
        digital_inputs: Levels of DI[1], DI[2] and so on, as the coils hold them.
        settings: Of the controller; None: the table and the programs of the kit, and no variable
            that shows a setting.
        frame: Gives X Y Z W P R of a frame.

    Raises:
        ConfigError: A register has no variable, or one that does not fit.
    """

    def __init__(
        self,
        layout: ModbusMap,
        image: RegisterImage,
        digital_inputs: Sequence[bool] = (),
        settings: ControllerSettings | None = None,
        frame: Callable[[Kind, int], Sequence[float]] = lambda kind, number: (0.0,) * len(LETTERS),
    ) -> None:
        self._frame = frame
        factory = settings is not None and settings.slots == "factory"
        self.table = AssignmentTable(delivered_table() if factory else power_up(layout))
        self._settings = settings
        self._image = image
        self._low_first = layout.word_order == "low_first"
        self._digital_inputs = digital_inputs
        # R[] that only a background program writes keep 0 where there is none.
        bare = settings is not None and settings.programs == "none"
        self._homes = {
            cell: register
            for cell, register in _homes(layout.holding_registers.values())
            if not bare or cell.family != "R" or register.write
        }
        # What clients wrote into R and PR that the map does not name; programs have their own.
        self._others: dict[Cell, float | str] = {}
        self._parts = lru_cache(maxsize=_KEPT)(self._find)
        self._version = self.table.version

    def read(self, offset: int, count: int, snapshot: Snapshot) -> list[int]:
        """Return ``count`` registers from PDU address ``offset`` on; 0 where nothing is assigned.

        Raises:
            NoRegisterError: The request goes on behind the last address.

        Source:
            The maker's manual of the HMI device, section 3.2.1: docs/sources.md.
        """
        words: list[int] = []
        for part in self._request(offset, count):
            if isinstance(part, Stretch) and not part.assigned:
                words += [0] * part.count
            elif isinstance(part, Stretch):
                begin = part.offset - self._image.first[_TABLE]
                words += self._image.tables[_TABLE][begin : begin + part.count]
            else:
                words += self._words(part, snapshot)[part.first : part.first + part.count]
        return words

    def write(
        self, offset: int, words: Sequence[int], snapshot: Snapshot
    ) -> list[tuple[str, Value]]:
        """Store words from PDU address ``offset`` on; return the image's registers they touch.

        Raises:
            NoRegisterError: One of them may not be written, or is behind the last address.
            RegisterError: A value is outside its range; nothing is stored.
        """
        changes, at = Changes(), 0
        for part in self._request(offset, len(words)):
            given = list(words[at : at + part.count])
            at += part.count
            if isinstance(part, Stretch) and part.assigned:
                changes.image.append((part.offset, given))
            elif isinstance(part, Piece):
                self._change(part, given, snapshot, changes)
        touched = self._store(changes.image)
        for slot, name, value in changes.table:
            self.table.put(slot, name, value)
        self._others |= changes.others
        return touched

    def unassigned(self, offset: int, count: int) -> str:
        """Return those of ``count`` registers to which nothing is assigned, counted from 1."""
        return ", ".join(
            f"{part.offset + 1} to {part.offset + part.count}"
            for part in self._request(offset, count)
            if isinstance(part, Stretch) and not part.assigned
        )

    def _request(self, offset: int, count: int) -> list[Part]:
        """Return the parts of a request."""
        # A client may assign anew at any time, and every request that was understood is stale then.
        if self._version != self.table.version:
            self._parts.cache_clear()
            self._version = self.table.version
        return self._parts(offset, count)

    def _find(self, offset: int, count: int) -> list[Part]:
        """Find the parts of a request, word by word."""
        if offset + count > _LAST:
            raise NoRegisterError(_LAST + 1, "there is none behind the last address")
        parts: list[Part] = []
        for address in range(offset + 1, offset + 1 + count):
            part = self._part(address)
            last = parts[-1] if parts else None
            if last is None or not _joins(last, part):
                parts.append(part)
            else:
                last.count += 1
        return parts

    def _part(self, address: int) -> Part:
        """Return what stands at one register, counted from 1."""
        found = self.table.at(address)
        if found is None:
            return Stretch(address - 1, 1, assigned=False)
        entry, variable = found
        word = address - entry.address
        packed = (
            FAMILIES[variable.family].fields[0].kind is ValueKind.SIGNAL and entry.multiply == 0.0
        )
        place = variable.place(word * _SIGNALS_A_WORD if packed else word)
        if place is None:
            return Stretch(address - 1, 1, assigned=False)
        cell, within = place
        end = variable.first + variable.words
        short = cell.field.kind is ValueKind.NUMBER and end < cell.field.first + cell.field.words
        home = self._homes.get(cell)
        if home is not None and _same_form(home, cell.field, entry.multiply, short):
            return Stretch(home.offset + within, 1)
        return Piece(cell, within, 1, entry.multiply, short)

    def _words(self, piece: Piece, snapshot: Snapshot) -> list[int]:
        """Return all words of one value."""
        kind, cell = piece.cell.field.kind, piece.cell
        if kind is ValueKind.SIGNAL and piece.multiply == 0.0:
            last = min(cell.element + _SIGNALS_A_WORD, FAMILIES[cell.family].highest + 1)
            levels = [self._level(cell.family, n, snapshot) for n in range(cell.element, last)]
            return [sum(1 << bit for bit, level in enumerate(levels) if level)]
        return encode(kind, cell.field.words, piece.multiply, self._value(cell, snapshot))

    def _value(self, cell: Cell, snapshot: Snapshot) -> float | str:
        """Return one value as it is now."""
        if cell.family == FAST_CLOCK:
            return snapshot.plain_clock_ms // round(FAST_CLOCK_MS)
        home = self._homes.get(cell)
        if home is not None:
            begin = home.offset - self._image.first[_TABLE]
            words = self._image.tables[_TABLE][begin : begin + home.words]
            value = decode_register(home, words, self._low_first)
            if isinstance(value, str):
                return value
            (number,) = value
            return number
        if cell.family.startswith("$SNPX_ASG"):
            return self.table.value(cell.element, cell.family.partition(".")[2])
        if kind := FRAME_KINDS.get(cell.family):
            numbers = self._frame(kind, cell.element)
            at = (cell.field.first - 1) // cell.field.words
            return numbers[at] if at < len(numbers) else 0
        if cell.field.kind is ValueKind.SIGNAL:
            return float(self._level(cell.family, cell.element, snapshot))
        if self._settings is not None:
            shown = variable(self._settings, cell.family, cell.element)
            if shown is not None:
                return shown
        return self._others.get(cell, "" if cell.field.kind is ValueKind.TEXT else 0)

    def _level(self, family: str, index: int, snapshot: Snapshot) -> bool:
        """Return the level of one signal; what is not wired is off."""
        if family == "UI":
            return INPUTS[index - 1] in snapshot.inputs
        if family == "UO":
            return index <= len(OUTPUTS) and bool(getattr(snapshot.outputs, OUTPUTS[index - 1]))
        if self._settings is not None and family in ("SI", "SO"):
            at, there = snapshot.mode, snapshot.tp_enabled
            now = msgspec.structs.replace(self._settings, mode=at, tp_enabled=there)
            shown = panel_inputs if family == "SI" else panel_outputs
            return index in shown(now, snapshot)
        if family == "DI":
            return index <= len(self._digital_inputs) and self._digital_inputs[index - 1]
        wired = {"RO": snapshot.outputs.gripper, "RI": snapshot.outputs.vacuum}
        return index == 1 and wired.get(family, False)

    def _change(self, piece: Piece, given: list[int], snapshot: Snapshot, changes: Changes) -> None:
        """Add to ``changes`` what words of one value ask for."""
        cell, kind = piece.cell, piece.cell.field.kind
        home = self._homes.get(cell)
        # A value that is in no map may be written all the same: a joint position, a register.
        free = cell.family == "R" or cell.family.startswith("$SNPX_ASG")
        free = free or (cell.family == "PR" and cell.field.first in _JOINT_FORM)
        if home is None and not free:
            raise NoRegisterError(None, f"{cell} cannot be written through it")
        if home is not None and not home.write:
            raise NoRegisterError(None, f"{cell} is read only")
        words = self._words(piece, snapshot)
        words[piece.first : piece.first + piece.count] = given
        if piece.short:
            words = encode(kind, cell.field.words, 1.0, signed(given[0]))
        value = decode(kind, 1.0 if piece.short else piece.multiply, words)
        if home is not None:
            whole = home.type != "float32" and not isinstance(value, str)
            stored = round(value) if whole else value  # type: ignore[arg-type]
            given_to = stored if isinstance(stored, str) else (stored,)
            words = encode_register(home, given_to, self._low_first)
            changes.image.append((home.offset, words))
        elif cell.family.startswith("$SNPX_ASG"):
            name = cell.family.partition(".")[2]
            self.table.check(cell.element, name, value)
            changes.table.append((cell.element, name, value))
        else:
            changes.others[cell] = value

    def _store(self, pieces: list[tuple[int, list[int]]]) -> list[tuple[str, Value]]:
        """Store words of the image, all or none."""
        for offset, words in pieces:
            self._image.check_writable(offset, len(words))
        # One piece is stored whole or not at all by itself; of several the first may be in already.
        before = self._image.tables[_TABLE][:] if len(pieces) > 1 else None
        touched: dict[str, Value] = {}
        try:
            for offset, words in pieces:
                touched |= dict(self._image.take(offset, words))
        except RegisterError:
            if before is not None:
                self._image.tables[_TABLE][:] = before
            raise
        return list(touched.items())


def _joins(last: Part, part: Part) -> bool:
    """Return whether the one word ``part`` goes on where ``last`` ends."""
    if isinstance(last, Stretch) and isinstance(part, Stretch):
        return last.assigned == part.assigned and last.offset + last.count == part.offset
    if isinstance(last, Stretch) or isinstance(part, Stretch):
        return False
    same = (last.cell, last.multiply, last.short) == (part.cell, part.multiply, part.short)
    return same and last.first + last.count == part.first


def _homes(registers: Iterable[Register]) -> Iterable[tuple[Cell, Register]]:
    """Yield where each value of the map's registers stands, as a register of one value."""
    for register in registers:
        variable = parse(register.variable)
        step = register.words if register.type == "string" else WORDS[register.type]
        for word in range(0, register.words, step):
            place = variable.place(word)
            if place is not None:
                count = register.count if register.type == "string" else 1
                address = register.address + word
                yield place[0], msgspec.structs.replace(register, address=address, count=count)


def _same_form(home: Register, field: Field, multiply: float, short: bool) -> bool:
    """Return whether a value is assigned in the form in which the image holds it."""
    if field.kind is ValueKind.SIGNAL:
        return False
    if field.kind is not ValueKind.NUMBER:
        return True
    if home.type == "float32":
        return multiply == 0.0 and not short
    if home.type == "int16":
        return short and multiply in (1.0, -1.0) and home.scale == 1.0
    return multiply in (home.multiply, -1.0) and not short
