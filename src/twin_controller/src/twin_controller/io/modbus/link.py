"""The real robot's link: a thread that polls, writes and reconnects, and never blocks its owner.

Reads and writes have a connection each, so that neither waits for the other's answer: on a slow line that is half of the
time. On each of them one request follows the other. One time-out or wrong answer ends both: an answer that comes late would
be taken for the next one's.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Self

from scara_config import Robot
from scara_config.modbus_map import ModbusMap

from twin_controller.io.modbus.outbox import Command, Outbox
from twin_controller.io.modbus.port import LinkLostError, ModbusPort
from twin_controller.io.modbus.settings import ModbusCounters, ModbusSettings
from twin_controller.io.modbus.writer import Writer
from twin_controller.plausible import Plausibility, Reading, Verdict, judge
from twin_controller.registers import RegisterCodec
from twin_controller.robot_sample import AlarmStatus, ControlType, ProgramStatus, RobotSample, SampleError
from twin_controller.signalling import may_write_signal, signal_names

OnSample = Callable[[RobotSample, float, float], None]
OnChange = Callable[[bool, str], None]
OnStatus = Callable[[ProgramStatus, AlarmStatus], None]
OnReject = Callable[[str], None]

__all__ = ["ModbusCounters", "ModbusLink", "ModbusSettings", "NotWritableError"]

_STATUS_SIGNALS = frozenset(("fault", "progrun", "paused"))
_CLOCK_WRAP = 2.0**31 * 1e-3


class NotWritableError(ValueError):
    """The map does not allow the twin controller to write there."""


class ModbusLink:
    """Poll the robot and write to it; a context manager. All calls return at once; all callbacks come from the link's threads.

    Args:
        settings: Address and times.
        layout: modbus_map.yaml.
        robot: robot.yaml.
        on_sample: Gets each checked sample with the monotonic times at which its request was sent and its answer complete.
        on_change: Told that the link is up (with the first good sample) or lost, and why.
        on_status: Gets program and alarm when they may have changed.
        on_reject: Told of an answer that was not believed and of a write that did not go through.
        alive: Whether the owner still decides; without it there is no heartbeat, so that the robot stops by itself.
    """

    def __init__(
        self,
        settings: ModbusSettings,
        layout: ModbusMap,
        robot: Robot,
        on_sample: OnSample,
        on_change: OnChange,
        on_status: OnStatus | None = None,
        on_reject: OnReject | None = None,
        alive: Callable[[], bool] = lambda: True,
    ) -> None:
        self.settings = settings
        self.counters = ModbusCounters()
        self.failure: BaseException | None = None
        self._layout, self._robot = layout, robot
        self._codec = RegisterCodec(layout, robot)
        self._on_sample, self._on_change, self._on_status = on_sample, on_change, on_status
        self._on_reject: OnReject = on_reject or (lambda reason: None)
        self._port = ModbusPort(settings.host, settings.port, layout.device_id, settings.timeout)
        self._outbox = Outbox()
        self._writer = Writer(settings, layout, robot, self._codec, self._outbox, self.counters, self._on_reject, alive)
        self._up: bool | None = None
        self._disarm = True
        self._signals: list[bool] | None = None
        self._plausible = Plausibility()
        self._outputs: frozenset[str] | None = None
        self._status_due = 0.0
        self._retry = settings.retry_first
        self._thread = threading.Thread(target=self._run, name="modbus_link", daemon=True)

    def __enter__(self) -> Self:
        """Start connecting."""
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """End; see :meth:`close`."""
        self.close()

    @property
    def connected(self) -> bool:
        """Good samples come."""
        return self._up is True

    def close(self, disarm: bool = True) -> None:
        """End the link; ``disarm`` tells the robot's watchdog first, so that the end is no alarm."""
        self._disarm = disarm
        self._outbox.close()
        self._thread.join(timeout=2.0)

    def write_setpoint(self, positions: Sequence[float], speed_percent: float, at: float = 0.0) -> None:
        """Write a set point of the twin's joints [rad or m] at ``at`` (monotonic) or at once; an older unwritten one is replaced.

        Joints that the twin does not have stay where they were when the stream began.
        """
        self._outbox.put_setpoint((tuple(positions), speed_percent), at)

    def drop_setpoints(self) -> None:
        """Forget the set points that wait for their time: the robot is to stop."""
        self._outbox.drop_setpoints()

    def write_override(self, percent: int) -> None:
        """Set the robot's override, 1..100."""
        self.write_integer("override", percent)

    def write_integer(self, name: str, value: int) -> None:
        """Write one integer register.

        Raises:
            NotWritableError: The map does not mark it ``write: true``, or it holds no single integer.
        """
        register = self._layout.find(name)
        if register is None or register.type not in ("int16", "int32") or register.count != 1:
            raise NotWritableError(f"{name}: modbus_map.yaml has no integer register of this name")
        self._command(Command(name, value, False))

    def set_coil(self, name: str, level: bool) -> None:
        """Set one UI signal.

        Raises:
            NotWritableError: The map does not mark it ``write: true``.
        """
        self._check_signal(name)
        self._command(Command(name, level, False))

    def pulse(self, name: str, behind: bool = False) -> None:
        """Switch one UI signal on and, a pulse length later, off; with ``behind`` not before a set point that waits.

        Raises:
            NotWritableError: The map does not mark it ``write: true``.
        """
        self._check_signal(name)
        self._command(Command(name, True, True, behind))

    def _check_signal(self, name: str) -> None:
        if name not in signal_names(self._layout):
            raise NotWritableError(f"{name}: modbus_map.yaml has no signal of this name")

    def _command(self, command: Command) -> None:
        register = self._layout.holding_registers.get(command.name)
        signal = command.name in signal_names(self._layout)
        if not (may_write_signal(self._layout, command.name) if signal else register is not None and register.write):
            raise NotWritableError(f"{command.name}: modbus_map.yaml does not mark it write: true")
        self._outbox.put(command)

    def _run(self) -> None:
        """Connect and serve until closed; an error of a callback ends the link and is kept in ``failure``."""
        try:
            while not self._outbox.closed:
                try:
                    self._serve()
                except LinkLostError as error:
                    self._lost(str(error))
            self._writer.end(farewell=self._disarm)
        except BaseException as error:
            self.failure = error
            self._up = False
            self._on_change(False, f"the link died: {error!r}")
            raise
        finally:
            self._writer.end(farewell=False)
            self._port.close()

    def _lost(self, reason: str) -> None:
        """Tell the owner once, then wait before the next attempt."""
        self._port.close()
        self.counters.losses += self._up is True
        if self._up is not False:
            self._up = False
            self._on_change(False, reason)
        self._writer.end(farewell=False)
        pause, self._retry = self._retry, min(2.0 * self._retry, self.settings.retry_last)
        self._outbox.pause(time.monotonic() + pause)

    def _serve(self) -> None:
        """Connect, poll on absolute deadlines while the writer writes, until closed or lost."""
        self._port.open()
        self._writer.open()
        self._status_due, self._plausible, self._signals = 0.0, Plausibility(), None
        due = time.monotonic()
        while not self._outbox.closed:
            self._writer.wait(due)
            if (now := time.monotonic()) >= due:
                self._poll()
                due += self.settings.poll_period
                if due < now:
                    self.counters.late += 1
                    due = now + self.settings.poll_period

    def _poll(self) -> None:
        """Read state and signals and hand the sample over.

        Where the answers take so long that both do not fit into a cycle, the signals are read in every other one.
        """
        self.counters.polls += 1
        sent = time.monotonic()
        words = self._port.read_words(self._codec.state)
        received = time.monotonic()
        slow = 2.0 * (received - sent) > self.settings.poll_period
        if slow and self._signals is not None:
            signals, self._signals = self._signals, None
        else:
            signals = self._signals = self._port.read_signals(self._codec.outputs) if self._codec.outputs else []
        self.counters.round_trip = received - sent
        self.counters.longest_round_trip = max(self.counters.longest_round_trip, received - sent)
        self._take(words, signals, sent, received)

    def _take(self, words: list[int], signals: list[bool], sent: float, received: float) -> None:
        """Check one answer and hand it over; one that is not believed is counted."""
        try:
            sample = self._codec.decode_sample(words, signals)
        except SampleError as error:
            self.counters.rejected += 1
            self._on_reject(f"sample: {error}")
            return
        if self._follows(sample, received):
            self._accept(sample, sent, received)

    def _follows(self, sample: RobotSample, received: float) -> bool:
        """Return whether a sample can follow the one before; readings that have really jumped end the connection."""
        reading = Reading(sample.positions, sample.velocities, sample.clock_ms * 1e-3, received)
        self._plausible, verdict = judge(self._plausible, reading, self._robot.joints, wrap=_CLOCK_WRAP)
        if verdict in (Verdict.ACCEPTED, Verdict.FIRST):
            return verdict is Verdict.ACCEPTED
        self.counters.rejected += 1
        self._on_reject(f"sample: {self._plausible.reason}")
        if verdict is Verdict.JUMPED:
            raise LinkLostError(f"the readings of the robot at {self._port.name} jumped: {self._plausible.reason}")
        return False

    def _accept(self, sample: RobotSample, sent: float, received: float) -> None:
        """Hand over a checked sample, and the status blocks if they may have changed."""
        changed = self._outputs is None or (self._outputs ^ sample.outputs) & _STATUS_SIGNALS
        self._outputs = sample.outputs
        self._writer.echo = sample.command_echo
        if sample.control_type is not ControlType.STREAM or not self._writer.idle_joints:
            self._writer.idle_joints = sample.positions
        self.counters.samples += 1
        if not self._up:
            self._up = True
            self.counters.connects += 1
            self._retry = self.settings.retry_first
            self._on_change(True, f"connected to {self._port.name}")
        self._on_sample(sample, sent, received)
        if self._on_status is not None and (changed or received >= self._status_due):
            self._status_due = received + self.settings.status_period
            self._read_status(self._on_status)

    def _read_status(self, on_status: OnStatus) -> None:
        """Read the program and alarm blocks."""
        program, alarm = self._port.read_words(self._codec.program), self._port.read_words(self._codec.alarm)
        try:
            on_status(self._codec.decode_program(program), self._codec.decode_alarm(alarm))
        except SampleError as error:
            self.counters.rejected += 1
            self._on_reject(f"status: {error}")
