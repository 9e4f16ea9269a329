"""RobotLink over Modbus TCP: a thread polls, writes and reconnects, and never blocks its owner.

Reads and writes have a connection each, so that neither waits for the other's answer: on a slow
line that is half of the time. On each of them one request follows the other. An answer that is
busy, late, lost, doubled or short is asked for again: only silence for longer than the time-out, a
refused reading and what is no Modbus end both.

Where somebody else writes the heartbeat, the link counts as lost at once, but its connections stay
until the stop that follows is written: the robot's watchdog would not stop it.
"""

from __future__ import annotations

import contextlib
import threading
import time

from scara_config import Robot
from scara_config.modbus_map import ModbusMap

from twin_controller.core.actions import StreamAhead, StreamReal
from twin_controller.modbus.heartbeat import Echo, heard, reconnected, stranger_text
from twin_controller.modbus.outbox_io import Command, Outbox
from twin_controller.modbus.poll_times import PollTimes
from twin_controller.modbus.port_io import ModbusPort, ModbusSettings
from twin_controller.modbus.signalling import may_write_signal, signal_names
from twin_controller.modbus.writer_io import Writer
from twin_controller.registers import RegisterCodec
from twin_controller.robot.link import (
    REPEATED,
    LinkLostError,
    NotWritableError,
    RobotCounters,
    RobotListener,
)
from twin_controller.robot_sample import RobotSample, SampleError, told_outputs

END_WAIT = 2.0
"""How long the end waits for what was left to be written [s]."""
_STATUS_SIGNALS = frozenset(("fault", "progrun", "paused"))


class StrangerError(RuntimeError):
    """Somebody else writes the robot's heartbeat; the text says so."""


class ModbusRobotLink:
    """Poll the robot and write to it; all calls return at once, the listener hears from threads.

    Args:
        settings: Address and times.
        layout: modbus_map.yaml.
        robot: robot.yaml.
        listener: Told of samples, changes and refusals.
        reads_status: Read the program and alarm blocks too.
    """

    def __init__(
        self,
        settings: ModbusSettings,
        layout: ModbusMap,
        robot: Robot,
        listener: RobotListener,
        reads_status: bool = True,
    ) -> None:
        self._settings, self._layout, self._listener = settings, layout, listener
        self._reads_status = reads_status
        self._counters = RobotCounters()
        self._codec = RegisterCodec(layout, robot)
        self._port = ModbusPort(settings.host, settings.port, layout.device_id, settings.timeout)
        self._outbox = Outbox()
        # A robot that is only followed hears nothing at all.
        self._writes = robot.lead
        self._writer = Writer(
            settings, layout, self._codec, self._outbox, self._counters, listener, self._writes
        )
        self._times = PollTimes(settings.poll_period, settings.drift_ppm)
        self._echo = Echo()
        self._disarm = True
        self._signals: list[bool] | None = None
        # Else program and alarm tell what its outputs would.
        self._shows_all = robot.stopping.shows_all and layout.has_outputs
        # What they told last; None: nobody knows, and no sample counts.
        self._told: frozenset[str] | None = frozenset()
        self._outputs: frozenset[str] | None = None
        self._status_due = 0.0
        self._retry = settings.retry_first
        self._thread = threading.Thread(target=self._run, name="modbus_link", daemon=True)

    @property
    def name(self) -> str:
        """Where the robot is."""
        return self._port.name

    @property
    def counters(self) -> RobotCounters:
        """What went over the link."""
        for kind in (*REPEATED, "doubled"):
            count = self._port.tally[kind] + self._writer.tally[kind]
            setattr(self._counters, f"{kind}_answers", count)
        return self._counters

    def start(self) -> None:
        """Begin to connect."""
        self._thread.start()

    def close(self, disarm: bool = True) -> None:
        """End the link; ``disarm`` the robot's watchdog first, so that the end is no alarm.

        The listener hears of commands that the robot has not taken by then: nobody sends them.
        """
        self._disarm = disarm
        self._outbox.close()
        self._thread.join(END_WAIT)
        if left := self._writer.left:
            self._listener.rejected(f"the link has ended, not sent or not confirmed: {left}")

    def write_setpoint(self, setpoint: StreamReal) -> None:
        """Write a set point of all joints at its time; forget those for then or later."""
        self._may_write()
        self._outbox.put_setpoint(setpoint)

    def write_ahead(self, ahead: StreamAhead) -> None:
        """Write set points ahead of their time."""
        self._may_write()
        self._outbox.put_ahead(ahead)

    def drop_setpoints(self) -> None:
        """Forget the set points that wait for their time: the robot is to stop."""
        self._outbox.drop_setpoints()

    def take_back_setpoints(self) -> None:
        """Tell the robot that none of its set points counts any longer."""
        if self._layout.find("setpoint_valid"):
            self.write_integer("setpoint_valid", 0)
        if self._layout.ring_places:
            self.write_integer("ring_write", 0)

    def write_integer(self, name: str, value: int) -> None:
        """Write one integer register.

        Raises:
            NotWritableError: The map does not mark it ``write: true``, or it is no single integer.
        """
        self._may_write()
        register = self._layout.find(name)
        if register is None or register.type not in ("int16", "int32") or register.count != 1:
            raise NotWritableError(f"{name}: modbus_map.yaml has no integer register of this name")
        self._command(Command(name, value, False))

    def set_signal(self, name: str, level: bool) -> None:
        """Set one UI signal.

        Raises:
            NotWritableError: The map does not mark it ``write: true``.
        """
        self._check_signal(name)
        self._command(Command(name, level, False))

    def pulse(self, name: str, behind: bool = False) -> None:
        """Switch one UI signal on and, a pulse length later, off.

        Args:
            name: Of the signal.
            behind: Not before a set point that waits.

        Raises:
            NotWritableError: The map does not mark it ``write: true``.
        """
        self._check_signal(name)
        self._command(Command(name, True, True, behind))

    def _may_write(self) -> None:
        if not self._writes:
            raise NotWritableError("robot.yaml: lead is false: nothing is written to the robot")

    def _check_signal(self, name: str) -> None:
        self._may_write()
        if name not in signal_names(self._layout):
            raise NotWritableError(f"{name}: modbus_map.yaml has no signal of this name")

    def _command(self, command: Command) -> None:
        """Leave a command if the map allows it."""
        if command.name in signal_names(self._layout):
            allowed = may_write_signal(self._layout, command.name)
        else:
            register = self._layout.holding_registers.get(command.name)
            allowed = register is not None and register.write
        if not allowed:
            raise NotWritableError(f"{command.name}: modbus_map.yaml does not mark it write: true")
        self._outbox.put(command)

    def _run(self) -> None:
        """Connect and serve until closed; an error of a callback ends the link for good."""
        try:
            while not self._outbox.closed:
                try:
                    self._serve_alone()
                except LinkLostError as error:
                    self._port.close()
                    self._listener.lost(str(error))
                    self._writer.end(farewell=False)
                    # Before the next attempt it waits, longer each time.
                    pause = self._retry
                    self._retry = min(2.0 * pause, self._settings.retry_last)
                    self._outbox.pause(time.monotonic() + pause)
            numbered = self._layout.command_word is not None
            # Each one that is left waits until the robot shows the one before. Where that cannot be
            # read, the writer gives it up after its attempts.
            with contextlib.suppress(LinkLostError):
                while numbered and not self._writer.ended:
                    self._writer.wait(time.monotonic() + self._settings.poll_period)
                    self._read_state()
            # An armed watchdog ends what runs, and a stop that was left goes before it.
            self._writer.beats = self._writer.beats and self._disarm
            self._writer.end(farewell=True)
        except BaseException as error:
            self._listener.died(error)
            raise
        finally:
            self._writer.end(farewell=False)
            self._port.close()

    def _serve_alone(self) -> None:
        """Serve until closed or lost, or until somebody else has written the heartbeat and ended.

        Meanwhile what was left for the robot is still written, a stop above all, but no heartbeat:
        where the other one ends too, the robot stops itself.
        """
        try:
            self._serve()
        except StrangerError as error:
            self._outbox.drop_setpoints()
            self._writer.beats = False
            self._listener.lost(str(error))
            quiet_since = time.monotonic()
            while not self._outbox.closed and time.monotonic() < quiet_since + self._settings.alone:
                self._writer.wait(time.monotonic() + self._settings.poll_period)
                before = self._echo.shown
                shown = self._codec.given("heartbeat_echo", self._read_state())
                assert shown is not None  # nobody else could be told without it
                self._echo, _ = heard(self._echo, shown, self._writer.beat)
                if shown != before:
                    quiet_since = time.monotonic()
            if not self._outbox.closed:
                self._port.close()
                self._writer.end(farewell=False)

    def _serve(self) -> None:
        """Connect, poll when it is time while the writer writes, until closed or lost."""
        self._port.open()
        self._writer.open()
        self._listener.opened()
        self._echo = reconnected(self._echo)
        self._status_due, self._signals = 0.0, None
        self._times.begin(time.monotonic())
        while not self._outbox.closed:
            self._writer.wait(self._times.due)
            if time.monotonic() >= self._times.due:
                self._poll()

    def _poll(self) -> None:
        """Read signals and state, and hand the sample over.

        The state comes last: nothing stands between its answer and who waits for it. Those of a
        slow robot are read behind it, and belong to the states after them.
        """
        self._counters.polls += 1
        self._counters.aimed += self._times.aimed
        if self._signals is None or not self._times.slow:
            self._signals = self._read_signals()
        words = self._read_state()
        sent, received = self._port.sent, time.monotonic()
        self._counters.round_trip = received - sent
        self._counters.longest_round_trip = max(self._counters.longest_round_trip, received - sent)
        sample, clock_ms = self._decode(words, self._signals), None
        shown = sample.heartbeat_echo if sample is not None else None
        if shown is not None and self._settings.heartbeat and self._writes:
            # An echo that is none of ours tells of somebody else who writes.
            self._echo, stranger = heard(self._echo, shown, self._writer.beat)
            if stranger:
                raise StrangerError(stranger_text(self._layout, shown))
        if self._told is None:
            # Not sooner: a stranger's heartbeat ends the link whatever program runs.
            sample = None
        if sample is not None and self._listener.sampled(sample, sent, received):
            clock_ms = sample.clock_ms
            self._follow_up(sample, received)
        self._counters.late += self._times.polled(clock_ms, sent, received)
        if self._times.reads_signals():
            self._signals = self._read_signals()

    def _read_state(self) -> list[int]:
        """Read the state block, and tell the writer which numbered command the robot took last."""
        words = self._port.read_words(self._codec.state)
        if (word := self._layout.command_word) is not None:
            # Also where the rest is not believed: the robot ignores a stop under an old number.
            self._writer.echo = self._codec.given(word.echo, words)
        return words

    def _read_signals(self) -> list[bool]:
        """Read the outputs, and the program and alarm blocks where these tell what they do not."""
        signals = self._port.read_signals(self._codec.outputs) if self._codec.outputs else []
        if not self._shows_all:
            self._told = self._read_status()
        return signals

    def _decode(self, words: list[int], signals: list[bool]) -> RobotSample | None:
        """Return the sample of both answers; None, and a word to the listener, if it is wrong."""
        try:
            return self._codec.decode_sample(words, signals, self._told or frozenset())
        except SampleError as error:
            self._counters.rejected += 1
            self._listener.rejected(f"sample: {error}")
            return None

    def _follow_up(self, sample: RobotSample, received: float) -> None:
        """Do what a believed sample asks for; read the status blocks if they may have changed."""
        changed = self._outputs is None or (self._outputs ^ sample.outputs) & _STATUS_SIGNALS
        self._outputs = sample.outputs
        # Not with the connection: a port that gives nothing to believe is tried less often.
        self._retry = self._settings.retry_first
        if self._reads_status and self._shows_all and (changed or received >= self._status_due):
            self._status_due = received + self._settings.status_period
            self._read_status()

    def _read_status(self) -> frozenset[str] | None:
        """Read the program and alarm blocks; return the outputs that they tell, None if wrong."""
        program = self._port.read_words(self._codec.program)
        alarm = self._port.read_words(self._codec.alarm)
        try:
            found = self._codec.decode_program(program), self._codec.decode_alarm(alarm)
        except SampleError as error:
            self._counters.rejected += 1
            self._listener.rejected(f"status: {error}")
            return None
        self._listener.told(*found)
        return told_outputs(*found)
