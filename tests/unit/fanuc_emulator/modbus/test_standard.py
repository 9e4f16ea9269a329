"""The wire, byte by byte, as the MODBUS Application Protocol Specification V1.1b3 has it.

Requests and answers are written from the standard; 6001 is PDU address 0x1770, 11101 is 0x2B5C.
"""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING

import pytest
from harness.workspace import ROOT
from scara_config.modbus_map import load_modbus_map

from .conftest import answers, request

if TYPE_CHECKING:
    from .conftest import Asked

READ_OVERRIDE = "03 2B5C 0002"


@pytest.mark.parametrize(
    ("pdu", "answer"),
    [
        # what is right
        ("01 1770 0008", "01 01 87"),
        ("02 1770 0002", "02 01 03"),
        ("03 2B0A 0001", "03 02 00 01"),
        ("05 1776 FF00", "05 17 76 ff 00"),
        ("05 1776 0000", "05 17 76 00 00"),
        ("06 2B3F 0007", "06 2b 3f 00 07"),
        ("0F 1776 0002 01 02", "0f 17 76 00 02"),
        ("10 2B5C 0002 04 0032 0000", "10 2b 5c 00 02"),
        (READ_OVERRIDE, "03 04 00 32 00 00"),
        ("16 2B3D 00F0 0005", "16 2b 3d 00 f0 00 05"),
        ("17 2B5C 0002 2B5C 0002 04 0033 0000", "17 04 00 33 00 00"),
        # where nothing is assigned: 0, and what is written is lost
        ("03 2B36 0001", "03 02 00 00"),
        ("10 2B36 0001 02 0007", "10 2b 36 00 01"),
        # counts: exception 3
        ("01 1770 0000", "81 03"),
        ("01 1770 07D1", "81 03"),
        ("02 1770 0000", "82 03"),
        ("03 2AF8 0000", "83 03"),
        ("03 2AF8 007E", "83 03"),
        ("04 2AF8 007E", "84 03"),
        ("0F 1770 0000 00", "8f 03"),
        ("0F 1770 07B1 F7" + " 00" * 247, "8f 03"),
        ("0F 1770 0008 02 0000", "8f 03"),
        ("10 2B5C 0000 00", "90 03"),
        ("10 2B5C 007C F8" + " 00" * 248, "90 03"),
        ("10 2B5C 0002 03 0032 00", "90 03"),
        ("10 2B5C 0002 04 0032", "90 03"),
        ("17 2AF8 0000 2B5C 0001 02 0032", "97 03"),
        ("17 2AF8 007E 2B5C 0001 02 0032", "97 03"),
        ("17 2B5C 0002 2B5C 007A F4" + " 00" * 244, "97 03"),
        # lengths: exception 3
        ("03 2AF8", "83 03"),
        ("01 1770 0001 00", "81 03"),
        ("02 1770 0001 00", "82 03"),
        ("03 2AF8 0001 00", "83 03"),
        ("04 2AF8 0001 00", "84 03"),
        ("05 1770 FF", "85 03"),
        ("05 1776 FF00 00", "85 03"),
        ("06 2B5C", "86 03"),
        ("06 2B3F 0007 00", "86 03"),
        ("16 2B3E 00F0", "96 03"),
        ("16 2B3D 00F0 0005 00", "96 03"),
        # levels of a coil: exception 3
        ("05 1776 1234", "85 03"),
        ("05 1776 1200", "85 03"),
        ("05 1776 0001", "85 03"),
        ("05 1776 FFFF", "85 03"),
        # addresses: exception 2
        ("01 2AF8 0001", "81 02"),
        ("02 176F 0001", "82 02"),
        ("03 FFFF 0002", "83 02"),
        ("04 2AF8 0001", "84 02"),
        ("05 1782 FF00", "85 02"),
        ("06 2B0A 0000", "86 02"),
        ("0F 1780 0003 01 05", "8f 02"),
        ("10 2AF8 0001 02 0000", "90 02"),
        ("16 2B0A 0000 0001", "96 02"),
        # values: exception 3
        ("10 2B5C 0002 04 0000 0000", "90 03"),
        # functions that it does not have: exception 1, with the function's own code
        ("00", "80 01"),
        ("07", "87 01"),
        ("08 0000 1234", "88 01"),
        ("08 0001 0000", "88 01"),
        ("0B", "8b 01"),
        ("0C", "8c 01"),
        ("11", "91 01"),
        ("14 07 06 0001 0000 0001", "94 01"),
        ("15 09 06 0001 0000 0001 0000", "95 01"),
        ("18 2AF8", "98 01"),
        ("2B 0E 01 00", "ab 01"),
        ("41", "c1 01"),
        ("64 0000", "e4 01"),
        ("83 02", "83 01"),
        ("FF", "ff 01"),
    ],
)
def test_request_gets_the_answer_of_the_standard(asked: Asked, pdu: str, answer: str) -> None:
    """An exception carries the request's own function code plus 0x80."""
    assert asked.ask(pdu) == answer


def test_no_request_is_longer_than_253_bytes(asked: Asked) -> None:
    """Not even one that would say enough before its end; the longest right ones are taken."""
    assert asked.ask("10 2B5C 0002 04 0032 0000" + " 00" * 244) == "90 03"
    assert asked.ask("0F 1770 07B0 F6" + " 00" * 246) == "8f 02", "that many coils are not there"
    assert asked.ask("10 2B5C 007B F6" + " 00" * 246) == "90 02", "nor so many registers"


def test_nothing_is_written_by_a_request_that_cannot_be_read(asked: Asked) -> None:
    """Function 23 with an address that does not exist is refused whole."""
    asked.ask("10 2B5C 0002 04 0021 0000")
    assert asked.ask("17 FFFF 0002 2B5C 0002 04 0022 0000") == "97 02"
    assert asked.ask(READ_OVERRIDE) == "03 04 00 21 00 00"


def test_mask_writes_what_the_standards_example_says(asked: Asked) -> None:
    """0x12 with AND 0xF2 and OR 0x25 gives 0x17 (section 6.16)."""
    asked.ask("06 2B3D 0012")
    assert asked.ask("16 2B3D 00F2 0025") == "16 2b 3d 00 f2 00 25"
    assert asked.ask("03 2B3D 0001") == "03 02 00 17"


@pytest.mark.parametrize("unit", [0, 1, 255])
def test_units_of_a_server_that_is_addressed_by_its_ip_address_are_answered(
    asked: Asked, unit: int
) -> None:
    """A client on libmodbus asks unit 255, others 0; the answer names the unit that was asked."""
    with asked.connect() as line:
        line.sendall(request(7, "03 2B0A 0001", unit))
        assert answers(line, 1) == [(7, unit, "03 02 00 01")]


def test_another_unit_does_not_answer(asked: Asked) -> None:
    """As a gateway says it: the target device failed to respond."""
    assert asked.ask("03 2B0A 0001", unit=2) == "83 0b"
    assert asked.ask("07", unit=247) == "87 0b"


def test_a_refused_write_is_a_line_of_the_log(asked: Asked) -> None:
    """It says what and why, and is not repeated while a client repeats itself."""
    asked.told.clear()
    for _ in range(3):
        assert asked.ask("10 2B3E 0001 02 0065") == "90 03"
        assert asked.ask("10 2B3E 0001 02 0065") == "90 03"
    assert asked.told == [
        "refused to write holding registers 11071 to 11071: stream_speed = 101 is outside [1, 100]"
    ]
    assert asked.ask("05 1782 FF00") == "85 02"
    assert asked.told[1:] == ["refused to write coils 6019 to 6019: there is none"]
    assert asked.ask("10 2AF8 0002 04 0001 0002") == "90 02"
    assert asked.told[2].startswith("refused to write holding registers 11001 to 11002: ")


def test_behind_the_last_coil_and_before_the_first_there_is_none(asked: Asked) -> None:
    """What lies between is off; a request over an end of them is refused."""
    coils = [bit.offset for bit in load_modbus_map(ROOT / "config").coils.values()]
    for first, count, right in (
        (min(coils), max(coils) - min(coils) + 1, True),
        (max(coils), 2, False),
        (min(coils) - 1, 2, False),
    ):
        answer = asked.ask(f"01 {first:04X} {count:04X}")
        assert answer.startswith("01" if right else "81 02")


def test_free_digital_signals_can_be_wired_to_nothing(asked: Asked) -> None:
    """DI[3] keeps what is written; DO[118] to DO[185] are off, whatever a program sets."""
    assert asked.ask("05 0002 FF00") == "05 00 02 ff 00"
    assert asked.ask("01 0000 0008") == "01 01 04"
    assert asked.ask("02 0075 0004") == "02 01 00"
    assert asked.ask("01 0200 0001") == "81 02"


def test_each_request_of_a_segment_is_answered_in_order(asked: Asked) -> None:
    """Reads, writes, what is refused and what no one knows, 400 at once; a client may not wait."""
    pdus = [READ_OVERRIDE, "06 2B3E 0001", "01 1770 0000", "18 0000"] * 100
    with asked.connect() as line:
        line.sendall(b"".join(request(number, pdu) for number, pdu in enumerate(pdus)))
        found = answers(line, len(pdus))
    assert [transaction for transaction, _, _ in found] == list(range(len(pdus)))
    assert [pdu[:2] for _, _, pdu in found] == ["03", "06", "81", "98"] * 100


def test_requests_may_be_cut_anywhere(asked: Asked) -> None:
    """Each byte a segment of its own, the end of one request with the start of the next."""
    whole = b"".join(request(number, READ_OVERRIDE) for number in range(3))
    with asked.connect() as line:
        line.setsockopt(6, 1, 1)  # TCP_NODELAY
        for at in range(20):
            line.sendall(whole[at : at + 1])
        assert answers(line, 1)[0][0] == 0
        line.sendall(whole[20:30])
        assert answers(line, 1)[0][0] == 1
        line.sendall(whole[30:])
        assert answers(line, 1)[0][0] == 2


def test_what_is_not_modbus_is_let_pass(asked: Asked) -> None:
    """Another protocol number is no request; the next one is answered."""
    with asked.connect() as line:
        line.sendall(request(1, READ_OVERRIDE, protocol=5) + request(2, READ_OVERRIDE))
        assert answers(line, 1)[0][0] == 2


@pytest.mark.parametrize("length", [0, 1, 301, 65535])
def test_length_that_cannot_be_ends_the_connection(asked: Asked, length: int) -> None:
    """Where the next request begins cannot be known any more; the log says so."""
    with asked.connect() as line:
        line.sendall(b"\0\1\0\0" + length.to_bytes(2, "big") + b"\1\3\0\0\0\1")
        assert line.recv(1) == b""
    assert any(f"{length} bytes are no request" in text for text in asked.told)


def test_a_client_that_leaves_amid_a_request_disturbs_nobody(asked: Asked) -> None:
    """The other connection goes on."""
    with asked.connect() as stays:
        with asked.connect() as leaves:
            leaves.sendall(request(1, READ_OVERRIDE)[:9])
        stays.sendall(request(2, READ_OVERRIDE))
        assert answers(stays, 1)[0][0] == 2


@pytest.mark.parametrize("unit", ["0", "1", "255"])
def test_libmodbus_reads_the_joints(asked: Asked, unit: str) -> None:
    """mbpoll, which is libmodbus: J3 is the third number from 11001 on, -160 mm at home."""
    options = ("-m", "tcp", "-p", str(asked.port), "-a", unit, "-r", "11001", "-c", "3")
    command = ("mbpoll", *options, "-t", "4:float", "-1", "-q", "127.0.0.1")
    done = subprocess.run(command, capture_output=True, text=True, timeout=10)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "[11005]: \t-160" in done.stdout
