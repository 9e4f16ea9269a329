"""What pymodbus' documentation shows, against a robot: run by the Python of its own venv.

Usage: pymodbus_examples.py PORT. Prints one line of JSON for each check, see checks.py.
"""

from __future__ import annotations

import struct
import sys

import checks
from pymodbus import __version__
from pymodbus.client import ModbusTcpClient

client = ModbusTcpClient("127.0.0.1", port=int(sys.argv[1]), timeout=3)


def connect() -> None:
    """Open the connection."""
    assert client.connect()


def joints() -> None:
    """Float32 values, the low word first."""
    words = client.read_holding_registers(1000, count=18, device_id=1).registers
    values = client.convert_from_registers(words, client.DATATYPE.FLOAT32, word_order="little")
    assert abs(values[2] + 160.0) < 0.01, values


def outputs() -> None:
    """Discrete inputs."""
    assert client.read_discrete_inputs(6000, count=2, device_id=1).bits[:2] == [True, True]


def inputs() -> None:
    """Coils, one and several."""
    assert not client.write_coil(6006, True, device_id=1).isError()
    assert not client.write_coils(6005, [False, False], device_id=1).isError()
    assert client.read_coils(6000, count=7, device_id=1).bits[:7] == [True] * 3 + [False] * 4


def registers() -> None:
    """Holding registers, one and several."""
    assert not client.write_registers(1100, [50, 0], device_id=1).isError()
    assert not client.write_register(1070, 55, device_id=1).isError()
    assert client.read_holding_registers(1100, count=2, device_id=1).registers == [50, 0]
    assert client.read_holding_registers(1070, count=1, device_id=1).registers == [55]


def both() -> None:
    """Function 23, and 22."""
    answer = client.readwrite_registers(
        read_address=1100, read_count=2, write_address=1100, values=[60, 0], device_id=1
    )
    assert answer.registers == [60, 0]
    assert not client.mask_write_register(
        address=1069, and_mask=0, or_mask=7, device_id=1
    ).isError()


def units() -> None:
    """0 and 255."""
    for unit in (0, 255):
        assert client.read_holding_registers(1018, count=1, device_id=unit).registers == [1]


def refusals() -> None:
    """An address that does not exist, a value outside its range."""
    assert client.read_holding_registers(0, count=1, device_id=1).exception_code == 2
    assert client.write_register(1070, 101, device_id=1).exception_code == 3


def assignment() -> None:
    """Assign by entry 80, write and read by the entry that was assigned."""
    for field, words, factor in checks.entry(40, 5001, 2, "R[100]", 0.0):
        name = f"$SNPX_ASG[40].{field}".encode().ljust(80, b"\0")
        head = [16000, 0, len(words), 0, *struct.unpack(">40H", name), *checks.float32(factor)]
        assert not client.write_registers(16299, head, device_id=1).isError()
        assert not client.write_registers(15999, words, device_id=1).isError()
    assert not client.write_registers(5000, checks.float32(2.5), device_id=1).isError()
    found = client.read_holding_registers(5000, count=2, device_id=1).registers
    assert found == checks.float32(2.5)


checks.run(
    ("pymodbus", __version__),
    {
        "connect": connect,
        "read the joints": joints,
        "read discrete inputs": outputs,
        "write and read coils": inputs,
        "write and read registers": registers,
        "functions 22 and 23": both,
        "units 0 and 255": units,
        "exceptions 2 and 3": refusals,
        "assign registers": assignment,
    },
)
client.close()
