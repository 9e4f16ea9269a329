"""Read and write slots of $SNPX_ASG over Modbus, through slot 80 as slots 76 to 79 show it."""

from __future__ import annotations

import struct

from scara_config.modbus_map import Register
from scara_config.set_up.slots import BOOTSTRAP, LAST_OWN, Assignment
from twin_controller.modbus.blocks import Block
from twin_controller.modbus.port_io import LinkLostError, ModbusPort, WriteRefusedError
from twin_controller.modbus.words import numbers, text_of, to_words

_TIMEOUT_S = 2.0
"""For one answer. Our choice."""
_SHOWN = 16000
"""Here slot 80 shows one value at a time; below slots 76 to 79, above all else; our choice."""
_WHOLE = Register(_SHOWN, "int32", "", "$ADDRESS or $SIZE")
_FACTOR = Register(_SHOWN, "float32", "", "$MULTIPLY")
_NAME = Register(_SHOWN, "string", "", "$VAR_NAME", count=40)


class SlotError(Exception):
    """The controller cannot be asked; the text says what to do."""


class SlotWriter:
    """A connection to a controller's table; a context manager.

    Args:
        host: The robot's address.
        port: Of its Modbus server.
        unit: Modbus device.
    """

    def __init__(self, host: str, port: int, unit: int) -> None:
        self._port = ModbusPort(host, port, unit, _TIMEOUT_S)

    def __enter__(self) -> SlotWriter:
        """Connect.

        Raises:
            SlotError: Nobody accepts the connection, or slots 76 to 79 are not typed.
            LinkLostError: No answer, or an exception.
            WriteRefusedError: The controller answers with an exception.
        """
        try:
            self._port.open()
        except LinkLostError as error:
            name = self._port.name
            raise SlotError(f"{name} accepts no connection: is Modbus on?") from error
        # Without slots 76 to 79 what was written is lost, and this reads 0: no exception tells.
        try:
            if self._read(LAST_OWN + 1, "$ADDRESS", _WHOLE) != [BOOTSTRAP, 0]:
                text = "slots 76 to 79 are not there: type them first"
                raise SlotError(f"{self._port.name}: {text}")
        # Nobody leaves a context that was never entered.
        except BaseException:
            self._port.close()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Leave slot 80 empty, and disconnect.

        Raises:
            LinkLostError, WriteRefusedError: It cannot be left empty, and nothing else went wrong.
        """
        # A slot 80 that is left would go on showing one value of the table to every client.
        try:
            self._port.write_words(BOOTSTRAP - 1, [0, 0, 0, 0, *_text(""), *_words(_FACTOR, 1.0)])
        except (LinkLostError, WriteRefusedError):
            # What came first says more: on a link that is lost this fails too.
            if kind is None:
                raise
        finally:
            self._port.close()

    def read(self, number: int) -> Assignment:
        """Return a slot.

        Raises:
            LinkLostError, WriteRefusedError: It cannot be read.
        """
        (address,) = numbers(_WHOLE, self._read(number, "$ADDRESS", _WHOLE), low_first=True)
        (size,) = numbers(_WHOLE, self._read(number, "$SIZE", _WHOLE), low_first=True)
        name = text_of(self._read(number, "$VAR_NAME", _NAME))
        (multiply,) = numbers(_FACTOR, self._read(number, "$MULTIPLY", _FACTOR), low_first=True)
        return Assignment(int(address), int(size), name, multiply)

    def write(self, number: int, slot: Assignment) -> None:
        """Write a slot, its size last: until then it is empty.

        Raises:
            LinkLostError, WriteRefusedError: It cannot be written.
        """
        for field, register, words in (
            ("$SIZE", _WHOLE, _words(_WHOLE, 0)),
            ("$ADDRESS", _WHOLE, _words(_WHOLE, slot.address)),
            ("$VAR_NAME", _NAME, _text(slot.name)),
            ("$MULTIPLY", _FACTOR, _words(_FACTOR, slot.multiply)),
            ("$SIZE", _WHOLE, _words(_WHOLE, slot.size)),
        ):
            self._reach(number, field, register)
            self._port.write_words(_SHOWN - 1, words)

    def _read(self, number: int, field: str, register: Register) -> list[int]:
        self._reach(number, field, register)
        return self._port.read_words(Block(register.offset, register.words))

    def _reach(self, number: int, field: str, register: Register) -> None:
        """Let slot 80 show one value of a slot."""
        place = [*_words(_WHOLE, _SHOWN), *_words(_WHOLE, register.words)]
        form = [*_text(f"$SNPX_ASG[{number}].{field}"), *_words(_FACTOR, register.multiply)]
        self._port.write_words(BOOTSTRAP - 1, [*place, *form])


def _words(register: Register, value: float) -> list[int]:
    return to_words(register.meaning, register, value, low_first=True)


def _text(value: str) -> list[int]:
    size = _NAME.words
    return list(struct.unpack(f">{size}H", value.encode("ascii").ljust(2 * size, b"\0")))
