"""What a request reads and writes: registers, coils and discrete inputs of the stand-in.

pymodbus' requests ask for it by these two methods; what is wrong is answered by its exception and
told, once for each thing that is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from pymodbus.constants import ExcCodes
from scara_config.modbus_map import Bit, ModbusMap
from scara_config.set_up.slots import has_slots

from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.registers import NoRegisterError, RegisterError
from fanuc_emulator.settings import ControllerSettings
from fanuc_emulator.snpx.access import AssignedRegisters
from fanuc_emulator.snpx.variables import FAMILIES

READ_COILS, READ_DISCRETE, READ_INPUT, WRITE_COIL, WRITE_COILS = 1, 2, 4, 5, 15
_BITS = (READ_COILS, READ_DISCRETE, WRITE_COIL, WRITE_COILS)


class Datastore:
    """Reads come from the newest snapshot, writes go to the servo loop's mailbox.

    Args:
        layout: modbus_map.yaml.
        image: Words of its registers.
        servo: Gives snapshots, takes writes.
        tell: Hears why a write was refused.
        settings: Of the controller; None: as the kit has them.

    Attributes:
        writes: How many requests came that write, refused ones too.

    Raises:
        ConfigError: A register names a variable that does not exist.
    """

    def __init__(
        self,
        layout: ModbusMap,
        image: RegisterImage,
        servo: ServoLoop,
        tell: Callable[[str], object],
        settings: ControllerSettings | None = None,
    ) -> None:
        self._layout, self._image, self._servo, self._tell = layout, image, servo, tell
        self._told = ""
        self.writes = 0
        self._inputs = {bit.offset: name for name, bit in layout.coils.items()}
        # As they were written last, in whatever way the robot obeyed.
        self._coils = _between(layout.coils)
        has_table = has_slots(layout)
        # Free signals: DI[1..] hear coil 1.., DO[1..] are off. Programs have levels of their own.
        self._free = [False] * (FAMILIES["DI"].highest if has_table else 0)
        self.assigned: AssignedRegisters | None = None
        if has_table:
            self.assigned = AssignedRegisters(layout, image, self._free, settings, servo.frame)

    async def async_getValues(
        self, device_id: int, func_code: int, address: int, count: int = 1
    ) -> list[int] | list[bool] | ExcCodes:
        """Return ``count`` values from PDU address ``address`` on, or what is wrong."""
        if func_code in _BITS:
            return self._bits(func_code, address, count)
        snapshot = self._servo.snapshot
        self._image.show(snapshot)
        try:
            if func_code == READ_INPUT:
                return self._image.read("input_registers", address, count)
            if self.assigned is not None:
                return self.assigned.read(address, count, snapshot)
            return self._image.read("holding_registers", address, count)
        except NoRegisterError:
            return ExcCodes.ILLEGAL_ADDRESS

    async def async_setValues(
        self, device_id: int, func_code: int, address: int, values: Sequence[int] | Sequence[bool]
    ) -> ExcCodes | None:
        """Store values from PDU address ``address`` on, all or none; return what is wrong."""
        self.writes += 1
        if func_code in _BITS:
            return self._write_coils(address, [bool(value) for value in values])
        words = [int(value) for value in values]
        try:
            if self.assigned is not None:
                # A request may hold a part of a value: the words beside it are those of now.
                self._image.show(self._servo.snapshot)
                touched = self.assigned.write(address, words, self._servo.snapshot)
                if lost := self.assigned.unassigned(address, len(words)):
                    self._refuse(f"holding registers {lost}: nothing is assigned to them")
            else:
                self._image.check_writable(address, len(words))
                touched = self._image.take(address, words)
        except NoRegisterError as error:
            self._refuse(f"holding registers {address + 1} to {address + len(words)}: {error}")
            return ExcCodes.ILLEGAL_ADDRESS
        except RegisterError as error:
            self._refuse(f"holding registers {address + 1} to {address + len(words)}: {error}")
            return ExcCodes.ILLEGAL_VALUE
        if touched:
            # In one piece: all registers of a request count in the same tick.
            self._servo.post(partial(self._image.apply, values=touched))
        return None

    def _bits(self, function: int, address: int, count: int) -> list[bool] | ExcCodes:
        """Return coils or discrete inputs."""
        if function == READ_DISCRETE:
            outputs = self._servo.snapshot.outputs
            levels = dict.fromkeys(_between(self._layout.discrete_inputs), False) | {
                bit.offset: getattr(outputs, name)
                for name, bit in self._layout.discrete_inputs.items()
            }
        else:
            levels = self._coils
        if address + count <= len(self._free):
            if function == READ_DISCRETE:
                return [False] * count
            return self._free[address : address + count]
        if any(at not in levels for at in range(address, address + count)):
            return ExcCodes.ILLEGAL_ADDRESS
        return [levels[at] for at in range(address, address + count)]

    def _write_coils(self, address: int, values: list[bool]) -> ExcCodes | None:
        """Hand inputs to the robot; free ones are only kept."""
        if address + len(values) <= len(self._free):
            self._free[address : address + len(values)] = values
            return None
        names = [self._inputs.get(address + i) for i in range(len(values))]
        if None in names:
            self._refuse(f"coils {address + 1} to {address + len(values)}: there is none")
            return ExcCodes.ILLEGAL_ADDRESS
        for i, (name, value) in enumerate(zip(names, values)):
            self._coils[address + i] = value
            self._servo.post(partial(Controller.write_input, name=name or "", value=value))
        return None

    def _refuse(self, why: str) -> None:
        """Tell why a write was refused, but not the same again and again."""
        if why != self._told:
            self._told = why
            self._tell(f"refused to write {why}")


def _between(table: dict[str, Bit]) -> dict[int, bool]:
    """Return the level at rest of each signal; what lies between them reads as off."""
    if not table:
        return {}
    offsets = [bit.offset for bit in table.values()]
    levels = dict.fromkeys(range(min(offsets), max(offsets)), False)
    return levels | {bit.offset: bit.normal for bit in table.values()}
