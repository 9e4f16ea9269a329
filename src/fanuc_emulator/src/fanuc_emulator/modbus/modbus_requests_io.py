"""Requests as the standard has them: which there are, what is wrong with one, who is asked.

pymodbus decodes and answers; where it takes what the standard refuses, a subclass refuses it.

Source:
    MODBUS Application Protocol Specification V1.1b3, section 6; MODBUS Messaging on TCP/IP
    Implementation Guide V1.0b, section 3.1.3 (the MBAP header).
"""

from __future__ import annotations

from typing import Any

from pymodbus.constants import ExcCodes, ModbusStatus
from pymodbus.pdu import DecodePDU, ExceptionResponse, ModbusPDU
from pymodbus.pdu.bit_message import WriteMultipleCoilsRequest, WriteSingleCoilRequest
from pymodbus.pdu.register_message import ReadWriteMultipleRegistersRequest

from fanuc_emulator.modbus.datastore_io import READ_COILS, READ_DISCRETE, WRITE_COIL, WRITE_COILS

REGISTER_FUNCTIONS = frozenset({3, 4, 6, 16, 22, 23})
_LENGTHS = dict.fromkeys((1, 2, 3, 4, 5, 6), 5) | {22: 7}
"""How long a request of these functions is, its function code included [bytes]; the others say so
themselves, and pymodbus refuses what is longer or shorter."""
ANY_UNIT = (0, 255)
"""Units by which a server is asked that is addressed by its IP address alone."""


class _WriteSingleCoil(WriteSingleCoilRequest):
    """Only 0x0000 and 0xFF00 are levels; pymodbus takes whatever is not 0 for ON."""

    def decode(self, data: bytes) -> None:
        super().decode(data)
        if int.from_bytes(data[2:4], "big") not in (ModbusStatus.ON, ModbusStatus.OFF):
            raise ValueError("a coil is written by 0x0000 or 0xFF00")


class _WriteMultipleCoils(WriteMultipleCoilsRequest):
    """1968 coils at once; pymodbus takes 2000."""

    MAX_COUNT = 0x7B0


class _ReadWriteMultipleRegisters(ReadWriteMultipleRegistersRequest):
    """Nothing is written if it cannot be read; pymodbus writes first and looks then."""

    async def datastore_update(self, context: Any, device_id: int) -> ModbusPDU:
        found = await context.async_getValues(
            device_id, self.function_code, self.read_address, self.read_count
        )
        if isinstance(found, ExcCodes):
            return ExceptionResponse(self.function_code, found)
        return await super().datastore_update(context, device_id)


class RequestParser:
    """Turns bytes into requests of a robot.

    Args:
        unit: The robot's own unit.
        coils: It has coils.
        discrete_inputs: It has discrete inputs.
    """

    def __init__(self, unit: int, coils: bool, discrete_inputs: bool) -> None:
        self._units = (unit, *ANY_UNIT)
        self._functions = set(REGISTER_FUNCTIONS)
        self._functions |= {READ_COILS, WRITE_COIL, WRITE_COILS} if coils else set()
        self._functions |= {READ_DISCRETE} if discrete_inputs else set()
        self._decoder = DecodePDU(True)
        for kind in (_WriteSingleCoil, _WriteMultipleCoils, _ReadWriteMultipleRegisters):
            self._decoder.register(kind)

    def decode(self, unit: int, pdu: bytes) -> ModbusPDU:
        """Return the request, or the exception that answers it.

        Args:
            unit: Who is asked.
            pdu: Function code and data, one byte at least.
        """
        function = pdu[0]
        if unit not in self._units:
            return ExceptionResponse(function, ExcCodes.GATEWAY_NO_RESPONSE)
        if function not in self._functions:
            return ExceptionResponse(function, ExcCodes.ILLEGAL_FUNCTION)
        if len(pdu) != _LENGTHS.get(function, len(pdu)):
            return ExceptionResponse(function, ExcCodes.ILLEGAL_VALUE)
        return self._decoder.decode(pdu) or ExceptionResponse(function, ExcCodes.ILLEGAL_VALUE)
