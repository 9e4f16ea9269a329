"""What is written to the real robot: set points, commands, the ends of pulses, and a heartbeat when nothing else was one."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable

from scara_config import Robot
from scara_config.modbus_map import ModbusMap

from twin_controller.io.modbus.outbox import Command, Outbox
from twin_controller.io.modbus.port import LinkLostError, ModbusPort, RefusedError
from twin_controller.io.modbus.settings import ModbusCounters, ModbusSettings
from twin_controller.registers import RegisterCodec
from twin_controller.robot_sample import SetpointError
from twin_controller.signalling import CommandLostError, CommandQueue, signal_names

BEAT = 1.5
"""A heartbeat is due so many poll periods after the last write that was one: set points come once in a period."""


class Writer:
    """A connection for writes with a thread of its own, which ends with the connection.

    Args:
        settings: Address and times.
        layout: modbus_map.yaml.
        robot: robot.yaml.
        codec: Makes words of set points.
        outbox: What is to be written.
        counters: Where set points and refusals are counted.
        on_reject: Told of a write that did not go through.
        alive: Whether the owner still decides; without it there is no heartbeat, so that the robot stops by itself.

    Attributes:
        idle_joints: Where the robot's joints were when the stream began, rad or m; empty while unknown.
        echo: Number of the command that the robot has taken last, of a map with numbered commands.
    """

    def __init__(
        self,
        settings: ModbusSettings,
        layout: ModbusMap,
        robot: Robot,
        codec: RegisterCodec,
        outbox: Outbox,
        counters: ModbusCounters,
        on_reject: Callable[[str], None],
        alive: Callable[[], bool],
    ) -> None:
        self.idle_joints: tuple[float, ...] = ()
        self.echo: int | None = None
        self._commands = CommandQueue(layout.command_word) if layout.command_word else None
        self._settings, self._layout, self._robot, self._codec = settings, layout, robot, codec
        self._outbox, self._counters, self._on_reject, self._alive = outbox, counters, on_reject, alive
        self._port = ModbusPort(settings.host, settings.port, layout.device_id, settings.timeout)
        self._heartbeat = 0
        self._due = 0.0
        self._broken: BaseException | None = None
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def open(self) -> None:
        """Connect and begin to write; what was left while there was no connection is dropped and told.

        Raises:
            LinkLostError: Nobody accepts the connection in time.
        """
        self._port.open()
        self.echo = None
        if dropped := self._outbox.discard() + (self._commands.discard() if self._commands else 0):
            self._counters.dropped += dropped
            self._on_reject(f"{dropped} writes dropped: there was no link")
        self._broken, self._due = None, 0.0
        self._ended.clear()
        self._thread = threading.Thread(target=self._run, name="modbus_writer", daemon=True)
        self._thread.start()

    def wait(self, until: float) -> None:
        """Wait until ``until`` (monotonic), or less if writing has ended.

        Raises:
            LinkLostError: A write was not answered.
        """
        self._ended.wait(max(0.0, until - time.monotonic()))
        if self._broken is not None:
            raise self._broken

    def end(self, farewell: bool) -> None:
        """Disconnect; with ``farewell`` disarm the robot's watchdog before. Without a connection nothing is done."""
        if self._thread is None:
            return
        if not farewell:
            self._port.interrupt()
        self._ended.set()
        self._thread.join()
        self._thread = None
        if farewell and self._settings.heartbeat and self._broken is None:
            with contextlib.suppress(LinkLostError):  # a robot that is gone needs no farewell
                self._beat(0)
        self._port.close()

    def _run(self) -> None:
        """Write until ended; an error is kept for whoever waits."""
        try:
            while not (self._ended.is_set() or self._outbox.closed):
                self._write_all()
        except BaseException as error:
            self._broken = error
        finally:
            self._ended.set()

    def _write_all(self) -> None:
        """Write what is there, or what comes until the next heartbeat or numbered command is due."""
        if self._commands is not None and self.echo is not None:
            self._commands.confirm(self.echo)
        wake = self._commands.due() if self._commands is not None else None
        setpoint, commands = self._outbox.take(self._due if wake is None else min(self._due, wake))
        if setpoint is not None:
            self._attempt(lambda: self._write_setpoint(*setpoint))
        for command in commands:
            self._attempt(lambda command=command: self._write(command))  # type: ignore[misc]
        self._attempt(self._write_command)
        for name in self._outbox.due_releases():
            self._attempt(lambda name=name: self._port.write_coil(self._layout.coils[name].offset, False))  # type: ignore[misc]
        if time.monotonic() >= self._due:
            if self._settings.heartbeat and self._alive():
                self._beat(self._next_heartbeat())
            self._beaten()

    def _attempt(self, write: Callable[[], None]) -> None:
        """Write; what the robot refuses or our own check does not let through is told and counted, the link stays."""
        try:
            write()
        except (RefusedError, SetpointError, CommandLostError) as error:
            self._counters.refused += 1
            self._on_reject(str(error))

    def _write_setpoint(self, positions: tuple[float, ...], speed_percent: float) -> None:
        """Write PR[1] with the heartbeat in one request."""
        if not self.idle_joints:
            raise SetpointError("set point: the robot's pose is not known yet")
        if len(positions) != len(self._robot.twin_joints):
            raise SetpointError(f"set point: {len(positions)} positions for {len(self._robot.twin_joints)} joints of the twin")
        twin = iter(positions)
        filled = [next(twin) if joint.twin else idle for joint, idle in zip(self._robot.joints, self.idle_joints)]
        heartbeat = self._next_heartbeat() if self._settings.heartbeat else 0
        ceiling = min(100.0, speed_percent * self._settings.stream_speed_margin)
        self._port.write_words(self._codec.setpoint.offset, self._codec.encode_setpoint(filled, heartbeat, ceiling))
        self._counters.setpoints += 1
        self._beaten()

    def _write(self, command: Command) -> None:
        """Write one signal or integer register."""
        if self._commands is not None and command.name in signal_names(self._layout):
            self._commands.put(command.name, bool(command.value), command.pulsed)
        elif command.name in self._layout.coils:
            self._port.write_coil(self._layout.coils[command.name].offset, bool(command.value))
            if command.pulsed:
                self._outbox.end_pulse(command.name, time.monotonic() + self._settings.pulse)
        else:
            register = self._layout.holding_registers[command.name]
            self._port.write_words(register.offset, self._codec.encode_int(command.name, command.value))

    def _write_command(self) -> None:
        """Write the numbered command that is due."""
        pending = self._commands.next(time.monotonic()) if self._commands else None
        if pending is not None:
            self._port.write_words(*self._codec.encode_command(pending.code, pending.sequence))

    def _next_heartbeat(self) -> int:
        """Count 1..32767; 0 would disarm."""
        self._heartbeat = self._heartbeat % 32767 + 1
        return self._heartbeat

    def _beat(self, value: int) -> None:
        self._attempt(lambda: self._port.write_words(self._layout.holding_registers["heartbeat"].offset, [value]))

    def _beaten(self) -> None:
        self._due = time.monotonic() + BEAT * self._settings.poll_period
