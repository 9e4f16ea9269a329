"""What uModbus' documentation shows, against a robot: run by the Python of its own venv.

Usage: umodbus_examples.py PORT. Prints one line of JSON for each check, see ../checks.py. The last
checks are those of a driver for a real R-30iB: it lays out the registers by itself, in the manner
of fanuc-hmi-jointstreaming, which speaks with uModbus too.
"""

from __future__ import annotations

import socket
import struct
import sys
import time
from importlib.metadata import version
from typing import Any

import checks
from registers import assignment, float32
from umodbus import conf
from umodbus.client import tcp
from umodbus.exceptions import IllegalDataAddressError, IllegalDataValueError

conf.SIGNED_VALUES = True
line = socket.create_connection(("127.0.0.1", int(sys.argv[1])), timeout=3)

ALARMS, PROGRAMS, NUMBERS, POSITIONS, TARGET = 1, 1001, 1361, 1761, 1780
LAYOUT = (
    (ALARMS, 1000, "ALM[1]", -1.0),
    (PROGRAMS, 360, "PRG[1]", -1.0),
    (NUMBERS, 0, "", 1.0),
    (NUMBERS, 400, "R[1]", 1.0),
    (POSITIONS, 19, "POS[0]@27.19", 0.0),
    (TARGET, 19, "PR[1]@27.19", 0.0),
)
"""One behind the other from address 1 on: ten alarms, twenty programs, 200 numbers, positions."""
ENTRIES = 75
SERVO, STREAM = 11, 8
"""The number of the alarms that begin with SRVO; the coil that starts the streaming program."""


def ask(message: bytes) -> Any:
    """Send a request and return what is answered."""
    return tcp.send_message(message, line)


def read(address: int, count: int, unit: int = 1) -> list[int]:
    """Return registers; 1 is the first."""
    found: list[int] = ask(tcp.read_holding_registers(unit, address - 1, count))
    return found


def write(address: int, words: list[int]) -> None:
    """Write registers, which are signed here; 1 is the first."""
    signed = struct.unpack(f"<{len(words)}h", struct.pack(f"<{len(words)}H", *words))
    ask(tcp.write_multiple_registers(1, address - 1, list(signed)))


def number(words: list[int]) -> float:
    """Return the float32 of two words, the low one first."""
    return float(struct.unpack("<f", struct.pack("<2h", *words))[0])


def text(words: list[int]) -> str:
    """Return the text of words, the first character in the high byte."""
    return struct.pack(f">{len(words)}h", *words).decode("ascii").strip("\0 ")


def wait_for(words: tuple[int, int], such: Any) -> list[int]:
    """Read until the words are as they should be, for 3 s at most."""
    deadline = time.monotonic() + 3.0
    while not such(found := read(*words)):
        assert time.monotonic() < deadline, found
    return found


def check_connect() -> None:
    """The connection is open."""
    assert line.getpeername()


def check_read_the_joints() -> None:
    """Float32 values, the low word first."""
    assert abs(number(read(11001, 18)[4:6]) + 160.0) < 0.01


def check_read_discrete_inputs() -> None:
    """Discrete inputs."""
    assert ask(tcp.read_discrete_inputs(1, 6000, 2)) == [1, 1]


def check_write_and_read_coils() -> None:
    """Coils, one and several."""
    ask(tcp.write_single_coil(1, 6006, 1))
    ask(tcp.write_multiple_coils(1, 6005, [0, 0]))
    assert ask(tcp.read_coils(1, 6000, 7)) == [1] * 3 + [0] * 4


def check_write_and_read_registers() -> None:
    """Holding registers, one and several."""
    write(11101, [50, 0])
    ask(tcp.write_single_register(1, 11070, 55))
    assert read(11101, 2) == [50, 0] and read(11071, 1) == [55]


def check_units_0_and_255() -> None:
    """0 and 255."""
    assert [read(11019, 1, unit) for unit in (0, 255)] == [[1], [1]]


def check_exceptions_2_and_3() -> None:
    """An address that does not exist, a value outside its range."""
    for request, error in (
        (tcp.read_coils(1, 9000, 1), IllegalDataAddressError),
        (tcp.write_single_register(1, 11070, 101), IllegalDataValueError),
    ):
        try:
            found = ask(request)
        except error:
            continue
        raise AssertionError(f"{found} instead of {error.__name__}")


def check_assign_registers() -> None:
    """Assign by entry 80, write and read by the entry that was assigned."""
    for address, words in assignment(40, 15001, 2, "R[100]", 0.0):
        write(address + 1, words)
    write(15001, float32(2.5))
    assert number(read(15001, 2)) == 2.5


def check_layout_of_a_driver() -> None:
    """All entries but those that show entry 80 are written anew; the joints are where they were."""
    joints = read(11001, 19)
    rest = [(0, 0, "", 1.0)] * (ENTRIES - len(LAYOUT))
    for slot, entry in enumerate((*LAYOUT, *rest), start=1):
        for address, words in assignment(slot, *entry):
            write(address + 1, words)
    assert read(POSITIONS, 19) == joints and joints[18] == 1
    assert abs(number(read(POSITIONS + 4, 2)) + 160.0) < 0.01


def check_set_point_and_numbers_of_a_driver() -> None:
    """The set point is where the robot is; a numeric register keeps an int32."""
    here = read(POSITIONS, 19)
    write(TARGET, [word & 0xFFFF for word in here])
    assert read(TARGET, 19) == here
    write(NUMBERS + 2 * 99, [1, 1])
    assert read(NUMBERS + 2 * 99, 2) == [1, 1]


def check_programs_of_a_driver() -> None:
    """The first one runs after its signal, and has a name; the second does not exist."""
    assert read(PROGRAMS, 18)[9] == 0
    for level in (1, 0):
        ask(tcp.write_single_coil(1, 6000 + STREAM, level))
    program = wait_for((PROGRAMS, 18), lambda words: words[9] == 2)
    assert text(program[:8]) and program[8] > 0, program
    assert not any(read(PROGRAMS + 18, 18)[:10])


def check_alarms_of_a_driver() -> None:
    """One stands after *IMSTP, with its time and text, and goes by FAULT_RESET."""
    ask(tcp.write_single_coil(1, 6000, 0))
    alarm = wait_for((ALARMS, 100), lambda words: words[0] != 0)
    assert alarm[0] == SERVO and alarm[1] > 0 and text(alarm[11:51]) and text(alarm[91:100])
    assert alarm[5] >= 2020 and 1 <= alarm[6] <= 12, alarm[5:11]
    ask(tcp.write_single_coil(1, 6000, 1))
    for level in (1, 0):
        ask(tcp.write_single_coil(1, 6004, level))
    wait_for((ALARMS, 100), lambda words: words[0] == 0)


checks.run("uModbus", version("uModbus"), globals())
line.close()
