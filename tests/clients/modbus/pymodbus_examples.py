"""What pymodbus' documentation shows, against a robot: run by the Python of its own venv.

Usage: pymodbus_examples.py PORT. Prints one line of JSON for each check, see ../checks.py.
"""

from __future__ import annotations

import sys

import checks
from pymodbus import __version__
from pymodbus.client import ModbusTcpClient
from registers import assignment, float32

client = ModbusTcpClient("127.0.0.1", port=int(sys.argv[1]), timeout=3)


def check_connect() -> None:
    """Open the connection."""
    assert client.connect()


def check_read_the_joints() -> None:
    """Float32 values, the low word first."""
    words = client.read_holding_registers(11000, count=18, device_id=1).registers
    values = client.convert_from_registers(words, client.DATATYPE.FLOAT32, word_order="little")
    assert abs(values[2] + 160.0) < 0.01, values


def check_read_discrete_inputs() -> None:
    """Discrete inputs."""
    assert client.read_discrete_inputs(6000, count=2, device_id=1).bits[:2] == [True, True]


def check_write_and_read_coils() -> None:
    """Coils, one and several."""
    assert not client.write_coil(6006, True, device_id=1).isError()
    assert not client.write_coils(6005, [False, False], device_id=1).isError()
    assert client.read_coils(6000, count=7, device_id=1).bits[:7] == [True] * 3 + [False] * 4


def check_write_and_read_registers() -> None:
    """Holding registers, one and several."""
    assert not client.write_registers(11100, [50, 0], device_id=1).isError()
    assert not client.write_register(11070, 55, device_id=1).isError()
    assert client.read_holding_registers(11100, count=2, device_id=1).registers == [50, 0]
    assert client.read_holding_registers(11070, count=1, device_id=1).registers == [55]


def check_functions_22_and_23() -> None:
    """Function 23, and 22."""
    answer = client.readwrite_registers(
        read_address=11100, read_count=2, write_address=11100, values=[60, 0], device_id=1
    )
    assert answer.registers == [60, 0]
    assert not client.mask_write_register(
        address=11069, and_mask=0, or_mask=7, device_id=1
    ).isError()


def check_units_0_and_255() -> None:
    """0 and 255."""
    for unit in (0, 255):
        assert client.read_holding_registers(11018, count=1, device_id=unit).registers == [1]


def check_exceptions_2_and_3() -> None:
    """An address that does not exist, a value outside its range."""
    assert client.read_coils(9000, count=1, device_id=1).exception_code == 2
    assert client.write_register(11070, 101, device_id=1).exception_code == 3


def check_assign_registers() -> None:
    """Assign by entry 80, write and read by the entry that was assigned."""
    for address, words in assignment(40, 15001, 2, "R[100]", 0.0):
        assert not client.write_registers(address, words, device_id=1).isError()
    assert not client.write_registers(15000, float32(2.5), device_id=1).isError()
    assert client.read_holding_registers(15000, count=2, device_id=1).registers == float32(2.5)


checks.run("pymodbus", __version__, globals())
client.close()
