"""A robot that is asked over a socket, one for the tests of a module."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest
from fanuc_emulator.config import EmulatorConfig
from harness.emulated.served import running
from scara_config import Robot


@dataclass
class Asked:
    """A running robot, asked in bytes."""

    port: int
    told: list[str] = field(default_factory=list)

    def connect(self) -> socket.socket:
        """Open a connection."""
        return socket.create_connection(("127.0.0.1", self.port), timeout=2.0)

    def ask(self, pdu: str, unit: int = 1) -> str:
        """Return the answer to one request on a connection of its own, in hexadecimal digits."""
        with self.connect() as line:
            line.sendall(request(1, pdu, unit))
            return answers(line, 1)[0][2]


def request(transaction: int, pdu: str, unit: int = 1, protocol: int = 0) -> bytes:
    """Return the bytes of a request: MBAP header and PDU."""
    body = bytes((unit,)) + bytes.fromhex(pdu)
    header = b"".join(number.to_bytes(2, "big") for number in (transaction, protocol, len(body)))
    return header + body


def answers(line: socket.socket, count: int) -> list[tuple[int, int, str]]:
    """Read so many answers: transaction, unit, PDU in hexadecimal digits."""
    found = []
    with line.makefile("rb") as stream:
        for _ in range(count):
            header = stream.read(7)
            assert header[2:4] == b"\0\0"
            pdu = stream.read(int.from_bytes(header[4:6], "big") - 1)
            found.append((int.from_bytes(header[:2], "big"), header[6], pdu.hex(" ")))
    return found


@pytest.fixture(scope="module")
def asked(config: EmulatorConfig, robot: Robot) -> Iterator[Asked]:
    """Run a robot."""
    told: list[str] = []
    with running(config, robot, tell=told.append) as stand_in:
        yield Asked(stand_in.port, told)
