"""Read and write slots of $SNPX_ASG over Modbus, through slot 80 as slots 76 to 79 show it."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

import pymodbus
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException
from scara_config.set_up.slots import BOOTSTRAP, Assignment

_SHOWN = 16000
"""Here slot 80 shows one value at a time; below slots 76 to 79, above all else; our choice."""
_FIELDS = (("$ADDRESS", 2), ("$SIZE", 2), ("$VAR_NAME", 40), ("$MULTIPLY", 2))
_TEXT = 40


class SlotError(Exception):
    """The controller cannot be asked; the text says what to do."""


class SlotWriter:
    """A connection to a controller's table; a context manager.

    Args:
        host: The robot's address.
        port: Of its Modbus server.
        unit: Modbus device.
        timeout: For one answer [s].
    """

    def __init__(self, host: str, port: int, unit: int, timeout: float = 2.0) -> None:
        pymodbus.pymodbus_apply_logging_config("CRITICAL")
        self._client: Any = ModbusTcpClient(host, port=port, timeout=timeout, retries=0)
        self._unit, self._name = unit, f"{host}:{port}"

    def __enter__(self) -> SlotWriter:
        """Connect.

        Raises:
            SlotError: Nobody answers, or slots 76 to 79 are not typed.
        """
        if not self._client.connect():
            raise SlotError(f"{self._name} accepts no connection: is Modbus on?")
        self._reach(76, "$ADDRESS", 2)
        if _whole(self._read(_SHOWN, 2)) != BOOTSTRAP:
            self._client.close()
            raise SlotError(f"{self._name}: slots 76 to 79 are not there: type them first")
        return self

    def __exit__(self, *_: object) -> None:
        """Leave slot 80 empty, and disconnect."""
        self._write(BOOTSTRAP, [0, 0, 0, 0, *_text(""), *_float(1.0)])
        self._client.close()

    def read(self, number: int) -> Assignment:
        """Return a slot.

        Raises:
            SlotError: It cannot be read.
        """
        words = {}
        for field, size in _FIELDS:
            self._reach(number, field, size)
            words[field] = self._read(_SHOWN, size)
        text = struct.pack(f">{_TEXT}H", *words["$VAR_NAME"]).split(b"\0")[0]
        name = text.decode("ascii", "replace")
        (multiply,) = struct.unpack("<f", struct.pack("<2H", *words["$MULTIPLY"]))
        return Assignment(_whole(words["$ADDRESS"]), _whole(words["$SIZE"]), name, multiply)

    def write(self, number: int, slot: Assignment) -> None:
        """Write a slot, its size last: until then it is empty.

        Raises:
            SlotError: It cannot be written.
        """
        values = {
            "$ADDRESS": _words(slot.address),
            "$VAR_NAME": _text(slot.name),
            "$MULTIPLY": _float(slot.multiply),
            "$SIZE": _words(slot.size),
        }
        self._reach(number, "$SIZE", 2)
        self._write(_SHOWN, _words(0))
        for field, words in values.items():
            self._reach(number, field, len(words))
            self._write(_SHOWN, words)

    def _reach(self, number: int, field: str, size: int) -> None:
        """Let slot 80 show one value of a slot."""
        factor = {"$VAR_NAME": -1.0, "$MULTIPLY": 0.0}.get(field, 1.0)
        name = _text(f"$SNPX_ASG[{number}].{field}")
        self._write(BOOTSTRAP, [*_words(_SHOWN), *_words(size), *name, *_float(factor)])

    def _read(self, address: int, count: int) -> list[int]:
        try:
            answer = self._client.read_holding_registers(
                address - 1, count=count, device_id=self._unit
            )
        except ModbusException as error:
            raise SlotError(f"{self._name} does not answer: {error}") from error
        if answer.isError() or len(answer.registers) != count:
            raise SlotError(f"{self._name} refuses to read {address}: {answer}")
        found: list[int] = answer.registers
        return found

    def _write(self, address: int, words: Sequence[int]) -> None:
        try:
            answer = self._client.write_registers(address - 1, list(words), device_id=self._unit)
        except ModbusException as error:
            raise SlotError(f"{self._name} does not answer: {error}") from error
        if answer.isError():
            raise SlotError(f"{self._name} refuses to write {address}: {answer}")


def _whole(words: Sequence[int]) -> int:
    return words[0] | words[1] << 16


def _words(value: int) -> list[int]:
    return [value & 0xFFFF, value >> 16]


def _float(value: float) -> list[int]:
    return list(struct.unpack("<2H", struct.pack("<f", value)))


def _text(value: str) -> list[int]:
    return list(struct.unpack(f">{_TEXT}H", value.encode("ascii").ljust(2 * _TEXT, b"\0")))
