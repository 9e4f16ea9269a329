"""Requests to the robot over Modbus TCP, each repeated until its answer is one that can be used.

PDUs: MODBUS Application Protocol V1.1b3 sec. 6.
"""

from __future__ import annotations

import dataclasses
import struct
import time
from collections import Counter
from collections.abc import Callable
from typing import TypeVar

from twin_controller.modbus.blocks import Block
from twin_controller.modbus.connection_io import Connection, UnansweredError
from twin_controller.robot.link import LinkLostError

__all__ = ["LinkLostError", "ModbusPort", "ModbusSettings", "UnansweredError", "WriteRefusedError"]

_READ_SIGNALS, _WRITE_COIL, _WRITE_REGISTERS = 2, 5, 16  # function codes
_READ_WORDS = {"holding_registers": 3, "input_registers": 4}
_ON, _OFF = 0xFF00, 0
T = TypeVar("T")


@dataclasses.dataclass(frozen=True, slots=True)
class ModbusSettings:
    """Address and times of the link [s].

    Attributes:
        poll_period: Of the state block and the signals, on average.
        drift_ppm: Largest drift between the robot's clock and ours, in parts per million.
        timeout: The longest wait for an answer of use, however often it is asked for, or for a
            connection.
        status_period: Of the program and alarm blocks, which are also read when FAULT, PROGRUN or
            PAUSED change.
        retry_first: Pause before the first new attempt, short enough for the robot's watchdog;
            doubled at each failure.
        retry_last: Longest pause.
        command_retry: A numbered command that is not confirmed is written again after this.
        command_attempts: It is written at most this often.
        heartbeat: Keep the robot's watchdog awake.
        alone: Somebody else has written the heartbeat: the link is used again once nobody has for
            so long.
    """

    host: str
    port: int
    poll_period: float = 0.01
    drift_ppm: float = 500.0
    timeout: float = 0.04
    status_period: float = 1.0
    retry_first: float = 0.02
    retry_last: float = 2.0
    command_retry: float = 0.1
    command_attempts: int = 5
    heartbeat: bool = True
    alone: float = 2.0


class WriteRefusedError(RuntimeError):
    """The robot answered a write with an exception; the connection is good."""


class Retries:
    """For how long one thing is asked for again, and what came instead.

    Args:
        name: Where the robot is.
        limit: From the first time that it was asked for [s].
        begun: When that was (monotonic) [s].
    """

    def __init__(self, name: str, limit: float, begun: float) -> None:
        self.end = begun + limit
        self._name = name
        self._seen: Counter[str] = Counter()

    def failed(self, error: UnansweredError) -> None:
        """Count what came instead.

        Raises:
            LinkLostError: That was too long; the text says what came how often.
        """
        self._seen[str(error)] += 1
        if time.monotonic() >= self.end:
            seen = [f"{what} ({n} times)" if n > 1 else what for what, n in self._seen.items()]
            raise LinkLostError(f"the robot at {self._name} {', '.join(seen)}") from error


class ModbusPort(Connection):
    """Read and write on a connection, see :class:`Connection`.

    Args:
        host: The robot's address.
        port: TCP port.
        device_id: Modbus device.
        timeout: The longest wait for a connection or an answer of use [s].
        repeats: False: an answer that is missing or of no use raises UnansweredError at once, and
            whoever asked decides what is asked next.
    """

    def __init__(
        self, host: str, port: int, device_id: int, timeout: float, repeats: bool = True
    ) -> None:
        super().__init__(host, port, device_id, timeout)
        self._repeats = repeats

    def retries(self, begun: float) -> Retries:
        """Return how long is left for what was asked for first at ``begun`` (monotonic) [s]."""
        return Retries(self.name, self._timeout, begun)

    def read_words(self, block: Block) -> list[int]:
        """Read registers of the block's table.

        Raises:
            LinkLostError: No answer of use within the time-out, or an exception.
        """
        request = struct.pack(">BHH", _READ_WORDS[block.table], block.offset, block.count)
        return self._settle(request, lambda answer: self._words(answer, block))

    def read_signals(self, block: Block) -> list[bool]:
        """Read discrete inputs.

        Raises:
            LinkLostError: No answer of use within the time-out, or an exception.
        """
        request = struct.pack(">BHH", _READ_SIGNALS, block.offset, block.count)
        return self._settle(request, lambda answer: self._signals(answer, block))

    def write_words(self, offset: int, words: list[int]) -> None:
        """Write holding registers.

        Raises:
            WriteRefusedError: The robot answers with an exception.
            LinkLostError: No answer within the time-out, or one that confirms another write.
            UnansweredError: No answer of use, of a port that does not repeat.
        """
        count = len(words)
        head = struct.pack(">BHH", _WRITE_REGISTERS, offset, count)
        request = head + struct.pack(f">B{count}H", 2 * count, *words)
        self._settle(request, lambda answer: self._confirmed("registers", offset, answer, head))

    def write_coil(self, offset: int, level: bool) -> None:
        """Write one coil.

        Raises:
            WriteRefusedError: The robot answers with an exception.
            LinkLostError: No answer within the time-out, or one that confirms another write.
            UnansweredError: No answer of use, of a port that does not repeat.
        """
        request = struct.pack(">BHH", _WRITE_COIL, offset, _ON if level else _OFF)
        self._settle(request, lambda answer: self._confirmed("coil", offset, answer, request))

    def _settle(self, request: bytes, check: Callable[[bytes], T]) -> T:
        """Ask until an answer passes the check."""
        retries = self.retries(time.monotonic())
        sent: dict[int, float] = {}
        while True:
            try:
                return check(self.ask(request, sent, retries.end))
            except UnansweredError as error:
                if not self._repeats:
                    raise
                retries.failed(error)

    def _words(self, answer: bytes, block: Block) -> list[int]:
        data = self._data(answer, _READ_WORDS[block.table], block)
        self._check_count(len(data) // 2 == block.count, f"{len(data) // 2} words", block)
        return list(struct.unpack(f">{block.count}H", data))

    def _signals(self, answer: bytes, block: Block) -> list[bool]:
        data = self._data(answer, _READ_SIGNALS, block)
        self._check_count(8 * len(data) >= block.count, f"{8 * len(data)} signals", block)
        return [bool(data[k >> 3] >> (k & 7) & 1) for k in range(block.count)]

    def _data(self, answer: bytes, function: int, block: Block) -> bytes:
        """Return the data of an answer to a read, whole words of it."""
        if answer[0] == function | 0x80 and len(answer) > 1:
            raise LinkLostError(
                f"the robot at {self.name} refused to read {block.offset + 1}:"
                f" exception {answer[1]}"
            )
        if answer[0] != function:
            raise LinkLostError(
                f"the robot at {self.name} answered function {answer[0]} instead of {function}"
            )
        # A count that is not the data's leaves nothing of them, and so they are asked for again.
        return answer[2:] if answer[1:2] == bytes([len(answer) - 2]) else b""

    def _check_count(self, fits: bool, got: str, block: Block) -> None:
        """Ask again for what is short of the block: who sent it may have been in the middle."""
        if not fits:
            self.tally["short"] += 1
            raise UnansweredError(f"answered {got} instead of {block.count}")

    def _confirmed(self, what: str, offset: int, answer: bytes, written: bytes) -> None:
        """Compare what the robot confirms with what was written.

        Nobody knows what a robot does that took something else.
        """
        if answer[0] == written[0] | 0x80 and len(answer) == 2:
            raise WriteRefusedError(
                f"the robot refused to write {offset + 1}: exception {answer[1]}"
            )
        if answer != written:
            raise LinkLostError(
                f"the robot at {self.name} confirmed another write than {what} at {offset + 1}"
            )
