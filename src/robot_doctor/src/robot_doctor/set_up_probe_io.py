"""Read what a robot shows, its set-up and its answers for a while; nothing is written."""

from __future__ import annotations

import contextlib
import socket
import struct
import time

from scara_config import Robot
from scara_config.modbus_map import ModbusMap
from scara_config.set_up.settings import WATCHED_COUNT
from scara_config.set_up.slots import FRAMES, WATCHED, own_slots
from twin_controller.modbus.blocks import MOST_WORDS, Block
from twin_controller.modbus.port_io import LinkLostError, ModbusPort
from twin_controller.registers import RegisterCodec

from robot_doctor.link_checks import Answer
from robot_doctor.set_up_checks import SetUp

LATER_S = 0.05
"""A clock of milliseconds has gone on after it."""
_WATCHED = Block(WATCHED[0].address - 1, WATCHED_COUNT)


def ask(
    robot: Robot,
    layout: ModbusMap,
    host: str,
    port: int,
    period: float,
    seconds: float,
    timeout: float,
) -> list[Answer]:
    """Poll the robot for a while, as the twin controller does; nothing is written.

    Args:
        robot: The profile.
        layout: Its map.
        host: The robot's address.
        port: Of its Modbus server.
        period: Between two requests [s].
        seconds: How long.
        timeout: For one answer [s].

    Raises:
        LinkLostError: Nobody there, or an answer is missing or refused.
    """
    codec, answers = RegisterCodec(layout, robot), []
    link = ModbusPort(host, port, layout.device_id, timeout)
    link.open()
    try:
        end = time.monotonic() + seconds
        while (sent := time.monotonic()) < end:
            words = link.read_words(codec.state)
            received = time.monotonic()
            signals = link.read_signals(codec.outputs) if codec.outputs else []
            answers.append(Answer(sent, received, tuple(words), tuple(signals)))
            time.sleep(max(0.0, sent + period - time.monotonic()))
    finally:
        link.close()
    return answers


def probe_set_up(layout: ModbusMap, host: str, port: int, timeout: float, needed: int) -> SetUp:
    """Ask a robot how it is set up.

    Args:
        layout: modbus_map.yaml; its registers name variables.
        host: The robot's address.
        port: Of its Modbus server.
        timeout: For one answer [s].
        needed: So many clients are needed at once.

    Raises:
        LinkLostError: It serves its first client and does not answer.
    """
    one = ModbusPort(host, port, layout.device_id, timeout)
    try:
        one.open()
    except LinkLostError as error:
        return SetUp(0, needed, {}, (0,) * WATCHED_COUNT, why=str(error))
    try:
        first, watched = _slots(one, layout), one.read_words(_WATCHED)
        time.sleep(LATER_S)
        later = _slots(one, layout)
        frames = {
            kind: tuple(one.read_words(Block(slot.address - 1, slot.size)))
            for kind, slot in FRAMES.items()
        }
    finally:
        one.close()
    words = {address: (first[address], later[address]) for address in first}
    # Only once ours is closed, which would be one of them.
    served = _served(host, port, layout.device_id, timeout, needed)
    return SetUp(served, needed, words, tuple(watched), frames)


def _slots(port: ModbusPort, layout: ModbusMap) -> dict[int, tuple[int, ...]]:
    """Return the words of each slot of the map, as many as one request carries."""
    return {
        slot.address: tuple(port.read_words(Block(slot.address - 1, min(slot.size, MOST_WORDS))))
        for slot in own_slots(layout)
    }


def _served(host: str, port: int, unit: int, timeout: float, needed: int) -> int:
    """Return how many of the clients that are needed are served at once.

    Plain sockets: a Modbus client would connect again where it was put out.
    """
    # Number 1, protocol 0, six bytes behind it: read one holding register.
    request = struct.pack(">HHHBBHH", 1, 0, 6, unit, 3, _WATCHED.offset, 1)
    with contextlib.ExitStack() as lines:
        clients = []
        for _ in range(needed):
            with contextlib.suppress(OSError):
                line = socket.create_connection((host, port), timeout=timeout)
                clients.append(lines.enter_context(line))
        # Whoever answers has been accepted: only then has one too many put another one out.
        for line in clients:
            _answers(line, request)
        return sum([_answers(line, request) for line in clients])


def _answers(line: socket.socket, request: bytes) -> bool:
    """Return whether a connection is served."""
    with contextlib.suppress(OSError):
        line.sendall(request)
        # Who was put out reads the end of the connection: nothing.
        return len(line.recv(len(request))) > 0
    return False
