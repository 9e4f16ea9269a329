"""One Modbus TCP connection (pymodbus): each request waits for its answer, which is checked."""

from __future__ import annotations

import contextlib
import dataclasses
import socket
from typing import Any

import pymodbus
from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException

from twin_controller.modbus.blocks import Block
from twin_controller.robot.link import LinkLostError

__all__ = ["LinkLostError", "ModbusPort", "ModbusSettings", "WriteRefusedError"]

_WRITE_COIL, _WRITE_REGISTERS = 5, 16  # function codes


@dataclasses.dataclass(frozen=True, slots=True)
class ModbusSettings:
    """Address and times of the link [s].

    Attributes:
        poll_period: Of the state block and the signals, on average.
        drift_ppm: Largest drift between the robot's clock and ours, in parts per million.
        timeout: The longest wait for one answer or for a connection.
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


class ModbusPort:
    """A connection that stays closed once it is lost, until :meth:`open` is called again.

    Args:
        host: The robot's address.
        port: TCP port.
        device_id: Modbus device.
        timeout: The longest wait for a connection or an answer [s].
    """

    def __init__(self, host: str, port: int, device_id: int, timeout: float) -> None:
        pymodbus.pymodbus_apply_logging_config("CRITICAL")  # what it would log is raised here
        self.name = f"{host}:{port}"
        self._device_id = device_id
        self._client: Any = ModbusTcpClient(host, port=port, timeout=timeout, retries=0)

    def open(self) -> None:
        """Connect.

        Raises:
            LinkLostError: Nobody accepts the connection in time.
        """
        if not self._client.connect():
            raise LinkLostError(f"no robot at {self.name}")
        self._client.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def close(self) -> None:
        """Disconnect."""
        self._client.close()

    def interrupt(self) -> None:
        """End a request that waits in another thread: it raises LinkLostError at once."""
        if (line := self._client.socket) is not None:
            with contextlib.suppress(OSError):  # it may be lost already
                line.shutdown(socket.SHUT_RDWR)

    def read_words(self, block: Block) -> list[int]:
        """Read registers of the block's table.

        Raises:
            LinkLostError: No answer, an exception, or another number of words than asked for.
        """
        words: list[int] = self._read(f"read_{block.table}", block).registers
        if len(words) != block.count:
            raise LinkLostError(
                f"the robot at {self.name} answered {len(words)} words instead of {block.count}"
            )
        return words

    def read_signals(self, block: Block) -> list[bool]:
        """Read discrete inputs.

        Raises:
            LinkLostError: No answer, an exception, or fewer signals than asked for.
        """
        signals: list[bool] = self._read("read_discrete_inputs", block).bits
        if len(signals) < block.count:
            raise LinkLostError(
                f"the robot at {self.name} answered {len(signals)} signals instead of {block.count}"
            )
        return signals[: block.count]

    def write_words(self, offset: int, words: list[int]) -> None:
        """Write holding registers.

        Raises:
            RefusedError: The robot answers with an exception.
            LinkLostError: No answer, or one that confirms another write.
        """
        answer = self._write("write_registers", offset, words)
        self._check_echo(
            "registers",
            offset,
            (answer.function_code, answer.address, answer.count),
            (_WRITE_REGISTERS, offset, len(words)),
        )

    def write_coil(self, offset: int, level: bool) -> None:
        """Write one coil.

        Raises:
            RefusedError: The robot answers with an exception.
            LinkLostError: No answer, or one that confirms another write.
        """
        answer = self._write("write_coil", offset, level)
        self._check_echo(
            "coil",
            offset,
            (answer.function_code, answer.address, answer.bits[:1]),
            (_WRITE_COIL, offset, [level]),
        )

    def _check_echo(
        self, what: str, offset: int, echo: tuple[Any, ...], written: tuple[Any, ...]
    ) -> None:
        """Compare what the robot confirms with what was written.

        Nobody knows what a robot does that took something else.
        """
        if echo != written:
            raise LinkLostError(
                f"the robot at {self.name} confirmed another write than {what} at {offset + 1}"
            )

    def _read(self, function: str, block: Block) -> Any:
        answer = self._request(function, block.offset, count=block.count)
        if answer.isError():
            raise LinkLostError(
                f"the robot at {self.name} refused to read {block.offset + 1}:"
                f" exception {answer.exception_code}"
            )
        return answer

    def _write(self, function: str, offset: int, value: list[int] | bool) -> Any:
        answer = self._request(function, offset, value)
        if answer.isError():
            raise WriteRefusedError(
                f"the robot refused to write {offset + 1}: exception {answer.exception_code}"
            )
        return answer

    def _request(self, function: str, offset: int, *arguments: Any, **options: Any) -> Any:
        """Send one request.

        pymodbus itself would silently connect again, so a closed connection is an error here.
        """
        if self._client.socket is None:
            raise LinkLostError(f"the robot at {self.name} closed the connection")
        try:
            return getattr(self._client, function)(
                offset, *arguments, device_id=self._device_id, **options
            )
        except (ModbusException, OSError) as error:
            what = "did not answer in time" if "No response" in str(error) else f"was lost: {error}"
            raise LinkLostError(f"the robot at {self.name} {what}") from error
