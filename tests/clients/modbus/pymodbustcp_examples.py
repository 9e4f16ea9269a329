"""What pyModbusTCP's documentation shows, against a robot: run by the Python of its own venv.

Usage: pymodbustcp_examples.py PORT. Prints one line of JSON for each check, see checks.py.
"""

from __future__ import annotations

import struct
import sys

import checks
from pyModbusTCP.client import ModbusClient
from pyModbusTCP.constants import VERSION
from pyModbusTCP.utils import decode_ieee, word_list_to_long

client = ModbusClient(host="127.0.0.1", port=int(sys.argv[1]), unit_id=1, auto_open=True)


def connect() -> None:
    """Open the connection."""
    assert client.open(), client.last_error_as_txt


def joints() -> None:
    """Float32 values, the low word first."""
    words = client.read_holding_registers(1000, 18)
    values = [decode_ieee(number) for number in word_list_to_long(words, big_endian=False)]
    assert abs(values[2] + 160.0) < 0.01, values


def outputs() -> None:
    """Discrete inputs."""
    assert client.read_discrete_inputs(6000, 2) == [True, True]


def inputs() -> None:
    """Coils, one and several."""
    assert client.write_single_coil(6006, True) and client.write_multiple_coils(6005, [False] * 2)
    assert client.read_coils(6000, 7) == [True] * 3 + [False] * 4


def registers() -> None:
    """Holding registers, one and several."""
    assert client.write_multiple_registers(1100, [50, 0]) and client.write_single_register(1070, 55)
    assert client.read_holding_registers(1100, 2) == [50, 0]
    assert client.read_holding_registers(1070, 1) == [55]


def both() -> None:
    """Function 23; it has no 22."""
    assert client.write_read_multiple_registers(1100, [60, 0], 1100, 2) == [60, 0]


def units() -> None:
    """0 and 255."""
    for unit in (0, 255):
        client.unit_id = unit
        assert client.read_holding_registers(1018, 1) == [1]
    client.unit_id = 1


def refusals() -> None:
    """An address that does not exist, a value outside its range."""
    assert client.read_holding_registers(0, 1) is None and client.last_except == 2
    assert not client.write_single_register(1070, 101) and client.last_except == 3


def assignment() -> None:
    """Assign by entry 80, write and read by the entry that was assigned."""
    for field, words, factor in checks.entry(40, 5001, 2, "R[100]", 0.0):
        name = f"$SNPX_ASG[40].{field}".encode().ljust(80, b"\0")
        head = [16000, 0, len(words), 0, *struct.unpack(">40H", name), *checks.float32(factor)]
        assert client.write_multiple_registers(16299, head)
        assert client.write_multiple_registers(15999, words)
    assert client.write_multiple_registers(5000, checks.float32(2.5))
    assert client.read_holding_registers(5000, 2) == checks.float32(2.5)


checks.run(
    ("pyModbusTCP", VERSION),
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
