"""The robot's Modbus TCP server (pymodbus).

Reads answer from the newest snapshot, writes go to the servo loop's mailbox.

pymodbus answers only the first of several requests in one TCP segment, so a client must wait for
each answer.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable
from contextvars import Context
from functools import partial
from typing import Any

import pymodbus
from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice
from scara_config.modbus_map import Bit, ModbusMap, Register

from fanuc_emulator.controller import Controller
from fanuc_emulator.io.servo_loop import ServoLoop
from fanuc_emulator.plant.answers import AnswerTimes
from fanuc_emulator.program import ProgramState
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.registers import RegisterError
from fanuc_emulator.snapshot import Snapshot

_READ_COILS, _READ_DISCRETE, _READ_INPUT, _WRITE_COIL, _WRITE_COILS = 1, 2, 4, 5, 15


class PortError(OSError):
    """The server cannot listen on its address."""


class _OwnThreadLoop(asyncio.SelectorEventLoop):
    """A loop that does not wake itself.

    pymodbus answers each request by a call from the loop's own thread as if it came from another
    one. The loop's waking, through a socket of its own, took as long as the rest of the answer.
    """

    def __init__(self) -> None:
        super().__init__()
        self._own_thread = threading.get_ident()

    def call_soon_threadsafe(  # type: ignore[override]
        self,
        callback: Callable[..., object],
        *arguments: Any,
        context: Context | None = None,
    ) -> asyncio.Handle:
        """Call ``callback`` soon; wake the loop if the caller is another thread."""
        if threading.get_ident() == self._own_thread:
            return self.call_soon(callback, *arguments, context=context)
        return super().call_soon_threadsafe(callback, *arguments, context=context)


class RobotServer:
    """Serve ``layout`` on ``host:port`` in a thread of its own, as a context manager.

    Args:
        host: Address to bind.
        port: TCP port.
        layout: modbus_map.yaml.
        image: Words of the registers; used by the server's thread only.
        loop: Gives snapshots, takes writes.
        answers: How long each takes; None: no time.
    """

    def __init__(
        self,
        host: str,
        port: int,
        layout: ModbusMap,
        image: RegisterImage,
        loop: ServoLoop,
        answers: AnswerTimes | None = None,
    ) -> None:
        self._address = (host, port)
        self._layout = layout
        self._image = image
        self._servo = loop
        self._answers = answers
        self._coils = {bit.offset: name for name, bit in layout.coils.items()}
        self._asyncio: asyncio.AbstractEventLoop | None = None
        self._server: ModbusTcpServer | None = None
        self._failure: Exception | None = None
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, name="modbus_server", daemon=True)

    def __enter__(self) -> RobotServer:
        """Start listening.

        Raises:
            PortError: The port is taken or the address is not this machine's.
        """
        pymodbus.pymodbus_apply_logging_config("CRITICAL")
        self._image.show(self._servo.snapshot)
        self._thread.start()
        self._ready.wait()
        if self._failure is not None:
            host, port = self._address
            raise PortError(f"cannot listen on {host}:{port}: {self._failure}") from self._failure
        return self

    def __exit__(self, *_: object) -> None:
        if self._asyncio is not None and self._server is not None and self._thread.is_alive():
            shutdown = self._server.shutdown()  # type: ignore[no-untyped-call]
            asyncio.run_coroutine_threadsafe(shutdown, self._asyncio)
            self._thread.join(timeout=1.0)

    def _run(self) -> None:
        try:
            with contextlib.closing(_OwnThreadLoop()) as loop:
                loop.run_until_complete(self._serve())
                for task in (left := asyncio.all_tasks(loop)):
                    task.cancel()
                loop.run_until_complete(asyncio.gather(*left, return_exceptions=True))
        except Exception as error:
            self._failure = error
        finally:
            self._ready.set()

    async def _serve(self) -> None:
        """Listen until :meth:`__exit__`."""
        self._asyncio = asyncio.get_running_loop()
        host, port = self._address
        probe = await asyncio.start_server(
            lambda *_: None, host, port
        )  # pymodbus hides why it cannot listen
        probe.close()
        await probe.wait_closed()
        self._server = ModbusTcpServer(self._device(), address=self._address)
        await self._server.serve_forever(background=True)
        self._ready.set()
        await self._server.serving

    def _device(self) -> SimDevice:
        """Describe coils, discrete inputs and registers; everything else answers exception 2."""
        return SimDevice(
            self._layout.device_id,
            simdata=(
                _bits(self._layout.coils),
                _bits(self._layout.discrete_inputs),
                _words(self._layout.holding_registers),
                _words(self._layout.input_registers),
            ),
            action=self._act,
        )

    async def _act(
        self,
        function: int,
        start: int,
        address: int,
        count: int,
        current: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        """Answer one request.

        ``current`` is pymodbus' memory of the whole block, from ``start``.
        """
        if self._answers is None or self._answers.at_once:
            return self._answer(function, start, address, current, values)
        running = self._servo.snapshot.program_state is ProgramState.RUNNING
        half = 0.5 * self._answers.next(running)
        await asyncio.sleep(half)
        answer = self._answer(function, start, address, current, values)
        await asyncio.sleep(half)
        return answer

    def _answer(
        self,
        function: int,
        start: int,
        address: int,
        current: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        bits = {_READ_COILS: self._layout.coils, _READ_DISCRETE: self._layout.discrete_inputs}
        if function in bits and not bits[function]:
            return ExcCodes.ILLEGAL_FUNCTION
        if function in (_WRITE_COIL, _WRITE_COILS):
            return self._write_coils(address, [bool(value) for value in values or []])
        if function == _READ_DISCRETE:
            self._show_outputs(self._servo.snapshot, start, current)
        elif function != _READ_COILS and values is None:
            self._image.show(self._servo.snapshot)
            words = self._image.tables[
                "input_registers" if function == _READ_INPUT else "holding_registers"
            ]
            current[: len(words)] = words
        elif values is not None:
            return self._write_registers(address, [int(value) for value in values])
        return None

    def _write_coils(self, address: int, values: list[bool]) -> ExcCodes | None:
        names = [self._coils.get(address + i) for i in range(len(values))]
        if None in names:
            return ExcCodes.ILLEGAL_ADDRESS
        for name, value in zip(names, values):
            self._servo.post(partial(Controller.write_input, name=name or "", value=value))
        return None

    def _write_registers(self, address: int, words: list[int]) -> ExcCodes | None:
        try:
            touched = self._image.take(address, words)
        except RegisterError:
            return ExcCodes.ILLEGAL_VALUE
        self._servo.post(partial(self._image.apply, values=touched))
        return None

    def _show_outputs(self, snapshot: Snapshot, start: int, current: list[int]) -> None:
        """Pack UO into pymodbus' words of 16 bits."""
        for i in range(len(current)):
            current[i] = 0
        for name, bit in self._layout.discrete_inputs.items():
            if getattr(snapshot.outputs, name):
                current[bit.offset // 16 - start] |= 1 << (bit.offset % 16)


def _words(table: dict[str, Register]) -> list[SimData]:
    """Describe registers for pymodbus; the gaps between them answer exception 2."""
    if not table:
        return [SimData(0, datatype=DataType.INVALID)]
    return [
        SimData(
            register.offset,
            count=register.words,
            values=0,
            datatype=DataType.REGISTERS,
            readonly=not register.write,
        )
        for register in table.values()
    ]


def _bits(table: dict[str, Bit]) -> list[SimData]:
    """Describe bits for pymodbus, without gaps."""
    if not table:  # pymodbus wants bits; reading them is refused in any case
        return [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
    ordered = sorted(table.values(), key=lambda bit: bit.address)
    levels = [False] * (ordered[-1].offset - ordered[0].offset + 1)
    for bit in ordered:
        levels[bit.offset - ordered[0].offset] = bit.normal
    return [SimData(ordered[0].offset, values=levels, datatype=DataType.BITS)]
