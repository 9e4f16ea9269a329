"""What pyModbusTCP's documentation shows, against a robot: run by the Python of its own venv.

Usage: pymodbustcp_examples.py PORT. Prints one line of JSON for each check, see ../checks.py.
"""

from __future__ import annotations

import sys

import checks
from pyModbusTCP.client import ModbusClient
from pyModbusTCP.constants import VERSION
from pyModbusTCP.utils import decode_ieee, word_list_to_long
from registers import assignment, float32

client = ModbusClient(host="127.0.0.1", port=int(sys.argv[1]), unit_id=1, auto_open=True)


def check_connect() -> None:
    """Open the connection."""
    assert client.open(), client.last_error_as_txt


def check_read_the_joints() -> None:
    """Float32 values, the low word first."""
    words = client.read_holding_registers(11000, 18)
    values = [decode_ieee(number) for number in word_list_to_long(words, big_endian=False)]
    assert abs(values[2] + 160.0) < 0.01, values


def check_read_discrete_inputs() -> None:
    """Discrete inputs."""
    assert client.read_discrete_inputs(6000, 2) == [True, True]


def check_write_and_read_coils() -> None:
    """Coils, one and several."""
    assert client.write_single_coil(6006, True) and client.write_multiple_coils(6005, [False] * 2)
    assert client.read_coils(6000, 7) == [True] * 3 + [False] * 4


def check_write_and_read_registers() -> None:
    """Holding registers, one and several."""
    assert client.write_multiple_registers(11100, [50, 0]) and client.write_single_register(
        11070, 55
    )
    assert client.read_holding_registers(11100, 2) == [50, 0]
    assert client.read_holding_registers(11070, 1) == [55]


def check_functions_22_and_23() -> None:
    """Function 23; it has no 22."""
    assert client.write_read_multiple_registers(11100, [60, 0], 11100, 2) == [60, 0]


def check_units_0_and_255() -> None:
    """0 and 255."""
    for unit in (0, 255):
        client.unit_id = unit
        assert client.read_holding_registers(11018, 1) == [1]
    client.unit_id = 1


def check_exceptions_2_and_3() -> None:
    """An address that does not exist, a value outside its range."""
    assert client.read_coils(9000, 1) is None and client.last_except == 2
    assert not client.write_single_register(11070, 101) and client.last_except == 3


def check_assign_registers() -> None:
    """Assign by entry 80, write and read by the entry that was assigned."""
    for address, words in assignment(40, 15001, 2, "R[100]", 0.0):
        assert client.write_multiple_registers(address, words)
    assert client.write_multiple_registers(15000, float32(2.5))
    assert client.read_holding_registers(15000, 2) == float32(2.5)


checks.run("pyModbusTCP", VERSION, globals())
client.close()
