"""The robot's Modbus TCP server.

pymodbus knows the requests and their answers
(:mod:`fanuc_emulator.modbus.modbus_requests_io`). Its server answers only the first of several
requests that come in one TCP segment, so the connections are streams of asyncio: each request of a
connection is answered, in order, however it was cut.
"""

from __future__ import annotations

import asyncio
import struct
import threading
import traceback
from collections.abc import Callable
from typing import Any

import pymodbus
from pymodbus.constants import ExcCodes
from pymodbus.pdu import ExceptionResponse, ModbusPDU
from scara_config.modbus_map import ModbusMap

from fanuc_emulator.drives.servo_loop_io import ServoLoop
from fanuc_emulator.modbus.datastore_io import Datastore
from fanuc_emulator.modbus.modbus_requests_io import RequestParser
from fanuc_emulator.plant.delays import AnswerTimes
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.settings import ControllerSettings
from fanuc_emulator.tp.executor import ProgramState

_HEADER = struct.Struct(">HHHB")
"""MBAP: transaction, protocol, bytes that follow with the unit among them, unit."""
_LONGEST = 300
"""Unit and PDU [bytes]. 254 are allowed: a few too many are answered, more are no Modbus."""


class PortError(OSError):
    """The server cannot listen on its address."""


def say(text: str) -> None:
    """Write one line of the stand-in's log."""
    print(f"emulator: {text}", flush=True)


class RobotServer:
    """Serve ``layout`` on ``host:port`` in a thread of its own, as a context manager.

    Args:
        host: Address to bind.
        port: TCP port.
        layout: modbus_map.yaml.
        image: Words of the registers; used by the server's thread only.
        loop: Gives snapshots, takes writes.
        answers: How long each takes; None: no time.
        tell: Hears what was refused, a line each.
        settings: Of the controller; None: as the kit has them, for any number of clients.

    Raises:
        ConfigError: A register of the map names a variable that does not exist.
    """

    def __init__(
        self,
        host: str,
        port: int,
        layout: ModbusMap,
        image: RegisterImage,
        loop: ServoLoop,
        answers: AnswerTimes | None = None,
        tell: Callable[[str], object] = say,
        settings: ControllerSettings | None = None,
    ) -> None:
        self._address = (host, port)
        self._unit = layout.device_id
        self._image = image
        self._servo = loop
        self._answers = answers
        self._tell = tell
        self._datastore = Datastore(layout, image, loop, tell, settings)
        self._most = settings.num_modbus if settings is not None else None
        # Open connections, the one that has been silent for longest in front.
        self._open: list[asyncio.StreamWriter] = []
        self._requests = RequestParser(
            layout.device_id, bool(layout.coils), bool(layout.discrete_inputs)
        )
        self._asyncio: asyncio.AbstractEventLoop | None = None
        self._stop = asyncio.Event()
        self._failure: Exception | None = None
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._run, name="modbus_server", daemon=True)

    def __enter__(self) -> RobotServer:
        """Start listening.

        Raises:
            PortError: The port is taken, needs rights, or the address is not this machine's.
        """
        if self._most == 0:
            return self  # $SNPX_PARAM.$NUM_MODBUS is 0: nobody listens
        pymodbus.pymodbus_apply_logging_config("CRITICAL")
        self._image.show(self._servo.snapshot)
        self._thread.start()
        self._ready.wait()
        if self._failure is not None:
            host, port = self._address
            right = "; ports below 1024 need root or CAP_NET_BIND_SERVICE"
            hint = right if isinstance(self._failure, PermissionError) else ""
            text = f"cannot listen on {host}:{port}: {self._failure}{hint}"
            raise PortError(text) from self._failure
        return self

    @property
    def writes(self) -> int:
        """How many requests of any client came that write."""
        return self._datastore.writes

    def __exit__(self, *_: object) -> None:
        if self._asyncio is not None and self._thread.is_alive():
            self._asyncio.call_soon_threadsafe(self._stop.set)
            self._thread.join(timeout=1.0)

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except Exception as error:
            self._failure = error
        finally:
            self._ready.set()

    async def _serve(self) -> None:
        """Listen until :meth:`__exit__`."""
        server = await asyncio.start_server(self._connection, *self._address)
        async with server:
            self._asyncio = asyncio.get_running_loop()
            self._ready.set()
            await self._stop.wait()

    async def _connection(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one client's requests, each after the other."""
        self._open.append(writer)
        if self._most is not None and len(self._open) > self._most:
            self._open.pop(0).close()
        try:
            while True:
                transaction, protocol, length, unit = _HEADER.unpack(
                    await reader.readexactly(_HEADER.size)
                )
                if not 2 <= length <= _LONGEST:
                    peer = writer.get_extra_info("peername")
                    self._tell(f"closed the connection of {peer}: {length} bytes are no request")
                    return
                pdu = await reader.readexactly(length - 1)
                if writer in self._open:
                    self._open.remove(writer)
                    self._open.append(writer)
                if protocol != 0:
                    continue  # not Modbus; the standard says to let it pass
                answer = await self._answer(unit, pdu)
                body = bytes((answer.function_code,)) + answer.encode()
                writer.write(_HEADER.pack(transaction, 0, 1 + len(body), unit) + body)
                # A client that does not read its answers holds up its own connection alone.
                await writer.drain()
        except (asyncio.IncompleteReadError, ConnectionError):
            return  # the client has gone
        except asyncio.CancelledError:
            return  # we end
        finally:
            writer.close()
            if writer in self._open:
                self._open.remove(writer)

    async def _answer(self, unit: int, pdu: bytes) -> ModbusPDU:
        """Answer one request, in the time that the robot takes for it."""
        request = self._requests.decode(unit, pdu)
        if isinstance(request, ExceptionResponse):
            return request
        half = 0.0
        if self._answers is not None and not self._answers.at_once:
            running = self._servo.snapshot.program_state is ProgramState.RUNNING
            # Half before and half after, so that what is read is of the middle between question and
            # answer.
            half = 0.5 * self._answers.next(running)
            await asyncio.sleep(half)
        try:
            # The two methods of its context that a request uses are those of our datastore.
            store: Any = self._datastore
            answer = await request.datastore_update(store, self._unit)
        except Exception:
            self._tell(f"could not answer {pdu.hex()}:\n{traceback.format_exc()}")
            return ExceptionResponse(pdu[0], ExcCodes.DEVICE_FAILURE)
        if half:
            await asyncio.sleep(half)
        return answer
