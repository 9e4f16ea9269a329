"""What is written to the real robot: set points, commands, ends of pulses, heartbeats.

A heartbeat of its own is written only when no set point carried one. What is not confirmed is
written again, before all that came after it: all of it may be written twice. Of set points only the
newest is, and the heartbeats go on.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import ParamSpec

from scara_config.modbus_map import ModbusMap

from twin_controller.core.actions import StreamAhead, StreamReal
from twin_controller.modbus.heartbeat import next_beat
from twin_controller.modbus.outbox_io import Command, Outbox
from twin_controller.modbus.port_io import (
    ModbusPort,
    ModbusSettings,
    Retries,
    UnansweredError,
    WriteRefusedError,
)
from twin_controller.modbus.ring import RingCodec
from twin_controller.modbus.signalling import (
    CommandLostError,
    CommandQueue,
    NumberedCommand,
    patience,
    signal_names,
)
from twin_controller.registers import RegisterCodec
from twin_controller.robot.link import LinkLostError, RobotCounters, RobotListener
from twin_controller.robot_sample import SetpointError

BEAT = 1.5
"""A heartbeat is due this many poll periods after the last write that was one.

Set points come once in a period."""
P = ParamSpec("P")


class Writer:
    """A connection for writes with a thread of its own, which ends with the connection.

    Args:
        settings: Address and times.
        layout: modbus_map.yaml.
        codec: Makes words of set points.
        outbox: What is to be written.
        counters: Where set points and refusals are counted.
        writes: False: nothing is ever written, and there is no connection for it.
        listener: Told of a write that did not go through; without a living one there is no
            heartbeat.

    Attributes:
        echo: Number of the command that the robot has taken last, of a map with numbered commands.
        beat: The heartbeat that was written last, or is being written; 0 before the first.
        beats: Heartbeats are written. Not while somebody else writes them,
            nor behind an end that leaves the watchdog armed.
    """

    def __init__(
        self,
        settings: ModbusSettings,
        layout: ModbusMap,
        codec: RegisterCodec,
        outbox: Outbox,
        counters: RobotCounters,
        listener: RobotListener,
        writes: bool = True,
    ) -> None:
        self._writes = writes
        self.echo: int | None = None
        self.beat = 0
        self.beats = settings.heartbeat
        self._commands: CommandQueue | None = None
        if layout.command_word is not None:
            limits = patience(settings.command_retry, settings.command_attempts)
            self._commands = CommandQueue(layout.command_word, limits)
        self._settings, self._layout, self._codec = settings, layout, codec
        self._outbox, self._counters, self._listener = outbox, counters, listener
        where = (settings.host, settings.port, layout.device_id, settings.timeout)
        self._port = ModbusPort(*where, repeats=False)
        # With what is not confirmed yet, by how it is written.
        self._retries: dict[str, Retries] = {}
        # It is not confirmed that it was written.
        self._numbered: NumberedCommand | None = None
        self._ring = RingCodec(layout, codec)
        self._due = 0.0
        self._broken: BaseException | None = None
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def tally(self) -> Counter[str]:
        """How many answers were busy, late, lost, doubled, short."""
        return self._port.tally

    @property
    def ended(self) -> bool:
        """Nothing is written any longer, or not yet."""
        return self._thread is None or self._ended.is_set()

    @property
    def left(self) -> str:
        """Names of the commands that the robot has not taken, in their order."""
        numbered = self._commands.left if self._commands is not None else []
        return ", ".join([*numbered, *self._outbox.left])

    def open(self) -> None:
        """Connect and begin to write; drop what was left while there was no connection, and say so.

        Raises:
            LinkLostError: Nobody accepts the connection in time.
        """
        if not self._writes:
            return
        self._port.open()
        self._ring.empty()
        self.echo = None
        self.beats = self._settings.heartbeat
        if dropped := self._outbox.discard() + (self._commands.discard() if self._commands else 0):
            self._counters.dropped += dropped
            self._listener.rejected(f"{dropped} writes dropped: there was no link")
        self._broken, self._due, self._numbered = None, 0.0, None
        self._retries.clear()
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
        """Disconnect if connected.

        With ``farewell`` what was left in the closed outbox is written first, the end of its pulses
        too, and the robot's watchdog disarmed where there were heartbeats.
        """
        if self._thread is None:
            return
        if not farewell:
            # Else the thread would wait for an answer that nobody needs any more.
            self._port.interrupt()
            self._ended.set()
        self._thread.join()
        self._thread = None
        if farewell and self.beats and self._broken is None:
            with contextlib.suppress(LinkLostError):  # a robot that is gone needs no farewell
                while not self._beat(0):
                    pass
        self._port.close()

    def _run(self) -> None:
        """Write until ended; an error is kept for whoever waits."""
        try:
            while not (self._ended.is_set() or self._outbox.closed):
                self._write_all()
            # What was left when the outbox was closed, and the ends of its pulses.
            left = True
            while left and not self._ended.is_set():
                self._write_all()
                left = self._outbox.unfinished or self._numbered is not None
                if self._commands is not None and self._commands.due() is not None:
                    left = True
                    # A closed outbox does not wait, and the robot's number comes with a poll.
                    self._ended.wait(self._settings.poll_period)
        except BaseException as error:
            self._broken = error
        finally:
            self._ended.set()

    def _write_all(self) -> None:
        """Write what is there, or what comes until a heartbeat or a numbered command is due."""
        if self._commands is not None and self.echo is not None:
            self._commands.confirm(self.echo)
        wake = self._commands.due() if self._commands is not None else None
        until = self._due if wake is None else min(self._due, wake)
        if self._numbered is not None:
            until = 0.0
        self._write_taken(*self._outbox.take(until))
        with contextlib.suppress(UnansweredError):
            self._attempt(self._write_command)
        for name in self._outbox.due_releases():
            # What is not confirmed stays due, also when the link is lost in it.
            with contextlib.suppress(UnansweredError):
                self._attempt(self._release, name)
                self._outbox.pulse_ended(name)
        # A heartbeat before a set point that is not confirmed would make that one late.
        if (
            time.monotonic() >= self._due
            and not self._outbox.beats_soon
            and (not (self.beats and self._listener.alive()) or self._beat(self._next_heartbeat()))
        ):
            self._beaten()

    def _write_taken(
        self, setpoint: StreamReal | None, ahead: StreamAhead | None, commands: list[Command]
    ) -> None:
        """Write what was taken; give back what is not confirmed, and all that came after it."""
        try:
            fresh = True
            if setpoint is not None:
                fresh = self._attempt(self._write_setpoint, setpoint)
                setpoint = None
            if ahead is not None:
                fresh = self._attempt(self._write_ahead, ahead) and fresh
                ahead = None
            if not fresh:
                commands = [command for command in commands if not command.behind]
            while commands:
                # A start without the set point that it waited for begins with an old one.
                if not (commands[0].behind and self._outbox.dropped):
                    self._attempt(self._write, commands[0])
                commands = commands[1:]
        except UnansweredError:
            self._outbox.put_back(setpoint, ahead, commands)

    def _attempt(self, write: Callable[P, None], *args: P.args, **options: P.kwargs) -> bool:
        """Write; tell and count what the robot or our own check refuses. The link stays.

        Returns:
            Whether it was not refused.

        Raises:
            UnansweredError: It is not confirmed; it may be written or not.
            LinkLostError: That is so for too long.
        """
        begun, refused = time.monotonic(), False
        try:
            write(*args, **options)
        except UnansweredError as error:
            retries = self._retries.get(write.__name__)
            # Nobody went on with what ended before: this is another one.
            if retries is None or retries.end < begun:
                retries = self._retries[write.__name__] = self._port.retries(begun)
            retries.failed(error)
            raise
        except (WriteRefusedError, SetpointError, CommandLostError) as error:
            refused = True
            self._counters.refused += 1
            self._listener.rejected(str(error))
        self._retries.pop(write.__name__, None)
        return not refused

    def _write_setpoint(self, action: StreamReal) -> None:
        """Write PR[1] with the heartbeat in one request."""
        heartbeat = self._next_heartbeat()
        request = self._codec.encode_setpoint(action.setpoint.q, heartbeat, action.speed_percent)
        self._port.write_words(*request)
        self._counters.setpoints += 1
        self._beaten()

    def _write_ahead(self, ahead: StreamAhead) -> None:
        """Write the set points that are new, then their times and the newest one's number.

        In this order the robot never finds a number before its set point. A stop that comes between
        two requests goes before what is left of them, and takes it back.
        """
        heartbeat = self._next_heartbeat()
        for offset, words in self._ring.setpoints(ahead):
            self._port.write_words(offset, words)
            self._write_taken(None, None, self._outbox.take_between())
            if self._outbox.dropped:
                return
        self._port.write_words(*self._ring.times(ahead, heartbeat))
        self._counters.setpoints += len(ahead.points)
        self._beaten()

    def _write(self, command: Command) -> None:
        """Write one signal or integer register."""
        if command.name == "ring_write":
            # It takes the set points ahead back: what stands in the ring counts no longer.
            self._ring.empty()
        if self._commands is not None and command.name in signal_names(self._layout):
            self._commands.put(command.name, bool(command.value), command.pulsed, command.behind)
        elif command.name in self._layout.coils:
            coil, ends = self._layout.coils[command.name], command.pulsed
            try:
                self._port.write_coil(coil.offset, bool(command.value))
            except WriteRefusedError:  # it is not on
                ends = False
                raise
            finally:
                # It may be on also where nobody has confirmed it, and the link is lost.
                if ends:
                    due = time.monotonic() + coil.pulse_ms * 1e-3
                    self._outbox.end_pulse(command.name, due)
        else:
            register = self._layout.holding_registers[command.name]
            self._port.write_words(
                register.offset, self._codec.encode_int(command.name, command.value)
            )

    def _write_command(self) -> None:
        """Write the numbered command that is due, or the one that is not known to be written."""
        again, self._numbered = self._numbered, None
        due = self._commands.next(time.monotonic()) if self._commands else None
        if (command := due or again) is not None:
            try:
                self._port.write_words(*self._codec.encode_command(command.code, command.sequence))
            except UnansweredError:
                # It is written again at once, under its old number; what the robot refuses is not.
                self._numbered = command
                raise

    def _release(self, name: str) -> None:
        """End a pulse."""
        self._port.write_coil(self._layout.coils[name].offset, False)

    def _next_heartbeat(self) -> int:
        """Count; whoever reads the echo meanwhile knows of the value before it can be shown."""
        if self.beats:
            self.beat = next_beat(self.beat)
        return self.beat

    def _beat(self, value: int) -> bool:
        """Write a heartbeat; return whether it is confirmed."""
        offset = self._layout.holding_registers["heartbeat"].offset
        try:
            self._attempt(
                self._port.write_words, offset, self._codec.encode_int("heartbeat", value)
            )
        except UnansweredError:
            return False
        return True

    def _beaten(self) -> None:
        self._due = time.monotonic() + BEAT * self._settings.poll_period
