"""The real side in virtual time: the stand-in, its registers, the link that reads and writes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import msgspec
import numpy as np
from fanuc_emulator.controller import Controller
from fanuc_emulator.plant.delays import AnswerTimes
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.tp.executor import ProgramState
from twin_controller.core.actions import Command, StreamAhead, StreamReal
from twin_controller.core.events import RealMeasured
from twin_controller.modbus.blocks import Block
from twin_controller.modbus.poll_times import PollTimes
from twin_controller.modbus.ring import RingCodec
from twin_controller.registers import RegisterCodec
from twin_controller.robot.intake import measured
from twin_controller.robot.signals import (
    UI_SIGNALS,
    DropSetpoints,
    Number,
    Pulse,
    Signal,
    StandHere,
    TakeBack,
    steps,
)
from twin_controller.robot_sample import ControlType, RobotSample, told_outputs

from harness.virtual_cell.files import CellFiles
from harness.virtual_cell.schedule import Schedule, SideClock, Wire
from harness.virtual_cell.timing import Delays

SEED = 1
TRUTH_EVERY = 2
"""The ground truth is published at 250 Hz."""
Row = tuple[float, ...]


class RealSide:
    """The stand-in on its own clock, and both connections of the link to it."""

    def __init__(
        self,
        schedule: Schedule,
        files: CellFiles,
        delays: Delays,
        write: Wire,
        clock: Callable[[], float],
        put: Callable[[RealMeasured], None],
    ) -> None:
        """Stand at the start position.

        Args:
            schedule: Virtual time.
            files: The cell.
            delays: How late requests are.
            write: The way of everything that is written.
            clock: The controller's monotonic clock.
            put: Takes each sample when its decision begins.
        """
        self._schedule, self._files, self._delays = schedule, files, delays
        self._answers = AnswerTimes(files.emulator.plant.answers, np.random.default_rng(SEED))
        self._write, self._clock, self._put = write, clock, put
        self.robot = Controller(
            files.emulator,
            files.robot,
            files.programs,
            boot_seconds=0.0,
            random=np.random.default_rng(SEED),
            ring_places=files.layout.ring_places,
        )
        self.robot.source.valid = files.layout.find("setpoint_valid") is None
        self.shown = self.robot.step()
        self._image = RegisterImage(files.layout, files.robot)
        self._codec = RegisterCodec(files.layout, files.robot)
        self._ring = RingCodec(files.layout, self._codec)
        self._columns = [k for k, joint in enumerate(files.robot.joints) if joint.twin]
        self._waiting: list[StreamReal] = []
        self._idle: Row = ()
        self._paused = False
        self._here: Row = ()
        self._heartbeat = 0
        # What the stamp of the next reading is wrong by.
        self.stamps_off_ms: Callable[[], int] = lambda: 0
        # So often its client wrote to it; what is done at its pendant is no write.
        self.writes = 0
        self.truth: list[tuple[float, Row, Row]] = []
        quartz = SideClock(schedule, 0.0, files.emulator.plant.clock.drift_ppm)
        schedule.every(quartz.period(files.emulator.dt), self._servo, first=0.0007)
        self._period = files.controller.real.poll_period_ms * 1e-3
        self._times = PollTimes(self._period, files.controller.real.clock_drift_ppm)
        self._times.begin(self._clock() + 0.0101)
        self._levels: list[bool] | None = None
        self._status = frozenset[str]()
        schedule.after(0.0101, self._poll)

    @property
    def running(self) -> bool:
        """Whether a program of its own runs."""
        kind = ControlType(int(self.shown.control_type))
        return self.shown.program_state is ProgramState.RUNNING and kind is ControlType.PROGRAM

    def pendant(self, override: float, number: int) -> None:
        """Set the override and start a program, as on the robot's own pendant."""
        self._write.send(partial(self.robot.write_override, round(override)))
        self._write.send(partial(self.signal, f"panel_run{number}", None))

    def stream(self, action: StreamReal) -> None:
        """Leave a set point to be written at its time; it replaces those for then or later."""
        self._waiting = [left for left in self._waiting if left.send_at < action.send_at]
        self._waiting.append(action)
        self._schedule.after(action.send_at - self._clock(), partial(self._due, action))

    def stream_ahead(self, action: StreamAhead) -> None:
        """Write set points ahead of their time at once, in the link's own requests."""
        replace = msgspec.structs.replace
        points = tuple(replace(point, q=self._filled(point.q)) for point in action.points)
        ahead = replace(action, points=points)
        for offset, words in self._ring.setpoints(ahead):
            self._tell(partial(self._take, offset, words))
        self._heartbeat = self._heartbeat % 32767 + 1
        self._tell(partial(self._take, *self._ring.times(ahead, self._heartbeat)))

    def perform(self, command: Command) -> None:
        """Carry out one command by the product's own table, as RealLink does."""
        for step in steps(UI_SIGNALS, command, self._paused):
            match step:
                case DropSetpoints():
                    self._waiting = []
                case TakeBack():
                    self._ring.empty()
                    if self._files.layout.find("setpoint_valid"):
                        self._tell(partial(self.robot.write_setpoint_valid, False))
                    self._tell(partial(self.robot.source.ring.write_newest, 0))
                case StandHere():
                    here = self._here
                    self._tell(partial(self.robot.write_setpoint, here))
                case Signal():
                    self._tell(partial(self.signal, step.name, step.level))
                case Pulse():
                    if step.behind and self._waiting:
                        self._due(self._waiting[0])
                    self._tell(partial(self.signal, step.name, None))
                case Number():
                    take = getattr(self.robot, f"write_{step.name}")
                    self._tell(partial(take, step.value))

    def _tell(self, write: Callable[[], object]) -> None:
        """Write to the robot, as a client."""
        self.writes += 1
        self._write.send(write)

    def override(self, speed_percent: float) -> None:
        """Set the override."""
        self._tell(partial(self.robot.write_override, round(speed_percent)))

    def _servo(self) -> None:
        """Step the stand-in by one of its own periods; each second state is the published truth."""
        self.shown = self.robot.step()
        if self.shown.tick % TRUTH_EVERY == 0:
            self.truth.append(
                (
                    self._schedule.now,
                    self._of_twin(self.shown.positions),
                    self._of_twin(self.shown.velocities),
                )
            )

    def _poll(self) -> None:
        """Read the signals, unless they take too long, then the state; as RobotLink does."""
        if self._files.robot.lead:
            self._heartbeat = self._heartbeat % 32767 + 1
            self._tell(partial(self.robot.write_heartbeat, self._heartbeat))
        if self._levels is None or not self._times.slow:
            self._read_signals(self._read_state)
        else:
            self._read_state()

    def _read_signals(self, then: Callable[[], None]) -> None:
        """Read the discrete inputs, and what program and alarm tell, and go on."""

        def read() -> None:
            self._levels, self._status = self._signals(), self._told()

        if self._codec.outputs is None:
            read()
            then()
        else:
            self._ask(read, then)

    def _ask(self, read: Callable[[], None], then: Callable[[], None]) -> None:
        """Let the robot answer a request half-way, and go on when the answer is there.

        The network's part is that of the delays, the robot's own that of the plant.
        """
        busy = self.shown.program_state is ProgramState.RUNNING
        half = 0.5 * (self._delays.request + self._answers.next(busy))

        def answer() -> None:
            self._image.show(self.shown)
            read()
            self._schedule.after(half, then)

        self._schedule.after(half, answer)

    def _read_state(self) -> None:
        """Read the state block, and hand the sample over when it is there."""
        sent, words = self._clock(), list[int]()

        def arrive() -> None:
            received = self._clock()
            sample = self._codec.decode_sample(words, self._levels or [], self._status)
            off_ms = self.stamps_off_ms()
            sample = msgspec.structs.replace(sample, clock_ms=sample.clock_ms + off_ms)
            self._paused, self._here = "paused" in sample.outputs, sample.motion.q
            if sample.control_type is not ControlType.STREAM or self._paused or not self._idle:
                self._idle = sample.motion.q
            decide = partial(self._hand_over, sample, sent, received)
            self._schedule.after(self._delays.decision, decide)
            self._times.polled(sample.clock_ms, sent, received)
            if self._times.reads_signals():
                self._read_signals(self._wait)
            else:
                self._wait()

        self._ask(lambda: words.extend(self._block(self._codec.state)), arrive)

    def _wait(self) -> None:
        """Poll when it is time."""
        self._schedule.after(self._times.due - self._clock(), self._poll)

    def _signals(self) -> list[bool]:
        """Return the discrete inputs as the robot answers them."""
        block = self._codec.outputs
        if block is None:
            return []
        levels = [False] * block.count
        for name, bit in self._files.layout.discrete_inputs.items():
            levels[bit.offset - block.offset] = bool(getattr(self.shown.outputs, name))
        return levels

    def _told(self) -> frozenset[str]:
        """Return what program and alarm tell of outputs that are not allocated."""
        if self._files.robot.stopping.shows_all and self._files.layout.has_outputs:
            return frozenset()
        blocks = [self._block(block) for block in (self._codec.program, self._codec.alarm)]
        program, alarm = blocks
        return told_outputs(self._codec.decode_program(program), self._codec.decode_alarm(alarm))

    def _block(self, block: Block) -> list[int]:
        """Return the words of a block as the robot answers them."""
        begin = block.offset - self._image.first[block.table]
        return self._image.tables[block.table][begin : begin + block.count]

    def _hand_over(self, sample: RobotSample, sent: float, received: float) -> None:
        """Give a sample to the core, as RealLink does."""
        program = self.shown.program_name
        grips = self._files.layout.find("suction_now") is not None
        event = measured(sample, sent, received, self._files.robot, grips, program)
        self._put(msgspec.structs.replace(event, now=self._clock()))

    def _due(self, action: StreamReal) -> None:
        """Write a set point, unless it has been replaced or dropped meanwhile."""
        if not any(left is action for left in self._waiting):
            return
        self._waiting = [left for left in self._waiting if left.send_at > action.send_at]
        self._heartbeat = self._heartbeat % 32767 + 1
        filled = self._filled(action.setpoint.q)
        request = self._codec.encode_setpoint(filled, self._heartbeat, action.speed_percent)
        self._tell(partial(self._take, *request))

    def _filled(self, q: Row) -> Row:
        """Return all joints of the robot; those without a twin stay where they were."""
        twin = iter(q)
        joints = zip(self._files.robot.joints, self._idle)
        return tuple([next(twin) if joint.twin else idle for joint, idle in joints])

    def _take(self, offset: int, words: list[int]) -> None:
        """Let the robot take a written block."""
        touched = self._image.take(offset, words)
        self._image.apply(self.robot, touched)

    def signal(self, name: str, level: bool | None) -> None:
        """Set a signal at the robot itself; None pulses it."""
        coil = self._files.layout.coils.get(name)
        if level is None and coil is None:
            self.robot.pulse_input(name)
            return
        self.robot.write_input(name, level is None or level)
        if level is None:
            self._schedule.after(coil.pulse_ms * 1e-3, partial(self.robot.write_input, name, False))

    def _of_twin(self, full: Row) -> Row:
        return tuple(full[column] for column in self._columns)
