"""What the twin controller reads from and writes to the robot's registers, as typed values.

Units change here: deg and mm on the wire, rad and m inside. Nothing doubtful passes: a sample is
whole or refused.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from scara_config import Robot
from scara_config.map_entries import FAST_CLOCK, GRIPPER_NUMBERS, MODE_BITS
from scara_config.modbus_map import ModbusMap, Register
from scara_config.set_up.kit_programs import STREAM
from scara_control.joint_motion import JointMotion

from twin_controller.modbus.axes import axes_of, efforts_of, positions_of, velocities_of
from twin_controller.modbus.blocks import (
    Block,
    alarm_block,
    check_robot,
    needs_name,
    outputs_block,
    program_block,
    ring_block,
    setpoint_block,
    state_block,
)
from twin_controller.modbus.words import numbers, text_of, to_words
from twin_controller.robot_sample import (
    CLOCK_WRAP_MS,
    NUMBERS,
    AlarmStatus,
    ControlType,
    ProgramState,
    ProgramStatus,
    RobotSample,
    SampleError,
    SetpointError,
    WatchdogState,
)

SEVERITIES = ("", "WARN", "PAUSE", "STOP", "SERVO", "ABORT", "SYSTEM")
"""Of alarms, by their numbers: the controller's own table (docs/sources.md)."""
TOLERANCE = 0.001
"""How far outside its range a position may be read, as a fraction of the range. Our choice."""


class RegisterCodec:
    """Plan of the requests, decoder of the answers, encoder of the writes.

    Args:
        layout: modbus_map.yaml.
        robot: robot.yaml; a joint stands at the place of its ``axis_number``.

    Attributes:
        state: Read in each cycle.
        setpoint: Written in each cycle of a stream; None: the robot is only followed.
        ring: Written behind set points ahead; None: the robot takes none.
        program: Read when it may have changed.
        alarm: Read when it may have changed.
        outputs: Signals, read in each cycle; None if they stand in a word of ``state``.

    Raises:
        ConfigError: A block has more words than one request may carry or lies in two tables, the
            written block has a gap, the robot has an axis without a place, or it is to be led by
            a map without a register that is written.
    """

    def __init__(self, layout: ModbusMap, robot: Robot) -> None:
        self._registers = {**layout.input_registers, **layout.holding_registers}
        self._low_first = layout.word_order == "low_first"
        self._joints = robot.joints
        self._status = layout.status_word
        self._command = layout.command_word
        self.state = state_block(layout)
        self._named = needs_name(layout)
        # A controller's own clock runs on between two renewals of the position.
        self._plain_clock = self._registers["clock_ms"].variable == FAST_CLOCK
        self.setpoint = setpoint_block(layout)
        self.ring = ring_block(layout)
        self._places = layout.ring_places
        self.program = program_block(layout)
        self.alarm = alarm_block(layout)
        check_robot(layout, robot)
        self.outputs = outputs_block(layout)
        # Where each signal stands in the answer to ``outputs``.
        self._outputs = {
            name: bit.offset - self.outputs.offset
            for name, bit in layout.discrete_inputs.items()
            if self.outputs is not None
        }

    def decode_sample(
        self,
        words: Sequence[int],
        bits: Sequence[bool] = (),
        told: frozenset[str] = frozenset(),
    ) -> RobotSample:
        """Return the reading in the answers to ``state`` and ``outputs``.

        Args:
            words: The answer to ``state``.
            bits: The answer to ``outputs``; nothing if the signals are in a word of ``state``.
            told: Outputs that are on and not allocated, as other blocks tell them.

        Raises:
            SampleError: An answer is too short or too long, the robot calls its position invalid, a
                number is not finite or out of range, an enumeration has an unknown value.
        """
        if len(words) != self.state.count:
            raise SampleError(f"{len(words)} words instead of {self.state.count}")
        if self.outputs is not None and len(bits) < self.outputs.count:
            raise SampleError(f"{len(bits)} signals instead of {self.outputs.count}")
        if self._number("position_valid", words) != 1:
            raise SampleError("the robot says that its position is not valid")
        axes = self._floats("position", words)
        q = positions_of(axes, self._joints, TOLERANCE)
        qdot: Sequence[float] = ()
        if "velocity" in self._registers:
            qdot = velocities_of(self._floats("velocity", words), self._joints)
        efforts: Sequence[float] = ()
        if "motor_torque" in self._registers:
            efforts = efforts_of(self._floats("motor_torque", words), self._joints)
        clock_ms = self._clock(words)
        on = frozenset(name for name, place in self._outputs.items() if bits[place])
        if self._status is not None:
            _, (word,) = self._take(self._status.register, words, None)
            on = frozenset(name for name, bit in self._status.bits.items() if word >> bit & 1)
        on |= told
        on |= {each for each, name in GRIPPER_NUMBERS.items() if self.given(name, words)}
        control = self._control_by_program(words, on)
        switch = self.given("mode_b0", words), self.given("mode_b1", words)
        watchdog = None
        try:
            if (number := self.given("control_type", words)) is not None:
                control = ControlType(number)
            if (number := self.given("watchdog_state", words)) is not None:
                watchdog = WatchdogState(number)
        except ValueError as error:
            raise SampleError(str(error)) from error
        speed = "program_speed"
        return RobotSample(
            motion=JointMotion.measured(q, qdot, clock_ms * 1e-3),
            clock_ms=clock_ms,
            control_type=control,
            program_speed=self._percent(speed, words) if speed in self._registers else None,
            override=self._percent("override_now", words),
            heartbeat_echo=self.given("heartbeat_echo", words),
            watchdog_state=watchdog,
            outputs=on,
            plain_clock=self._plain_clock,
            ring_places=self._places,
            operation_mode=next((mode for mode, bits in MODE_BITS.items() if bits == switch), ""),
            pendant_enabled="tpenbl" in on if self._outputs or self._status else None,
            efforts=tuple(efforts),
            axes=tuple([axis if math.isfinite(axis) else 0.0 for axis in axes]),
            **{name: self._number(name, words) for name in NUMBERS if name in self._registers},
        )

    def _control_by_program(self, words: Sequence[int], on: frozenset[str]) -> ControlType:
        """Return what moves a robot that does not tell it: the stream program has its name."""
        if not on & {"progrun", "paused"}:
            return ControlType.NONE
        if self._named and self._text("program_name", words, self.state) == STREAM:
            return ControlType.STREAM
        return ControlType.PROGRAM

    def clock_of(self, words: Sequence[int]) -> int:
        """Return the robot's clock in an answer to ``state`` [ms], whatever else is in it.

        Raises:
            SampleError: It is negative.
        """
        return self._clock(words)

    def given(self, name: str, words: Sequence[int]) -> int | None:
        """Return a number in an answer to ``state``; None if the robot does not give it."""
        return self._number(name, words) if name in self._registers else None

    def decode_program(self, words: Sequence[int]) -> ProgramStatus:
        """Return what the program block says.

        Raises:
            SampleError: Wrong number of words or unknown state.
        """
        self._expect(self.program, words)
        try:
            state = ProgramState(self._number("program_state", words, self.program))
        except ValueError as error:
            raise SampleError(str(error)) from error
        name, line = (
            self._text("program_name", words, self.program),
            self._number("program_line", words, self.program),
        )
        return ProgramStatus(name, line, state)

    def decode_alarm(self, words: Sequence[int]) -> AlarmStatus:
        """Return what the alarm block says.

        Raises:
            SampleError: Wrong number of words.
        """
        self._expect(self.alarm, words)
        severity = self._text("alarm_severity_text", words, self.alarm)
        if not severity and "alarm_severity" in self._registers:
            number = self._number("alarm_severity", words, self.alarm)
            severity = SEVERITIES[number] if 0 <= number < len(SEVERITIES) else ""
        return AlarmStatus(
            facility=self._number("alarm_id", words, self.alarm),
            number=self._number("alarm_number", words, self.alarm),
            severity=severity,
            message=self._text("alarm_message", words, self.alarm),
            cause=self._text("alarm_cause", words, self.alarm),
        )

    def encode_setpoint(
        self, positions: Sequence[float], heartbeat: int, speed_percent: float
    ) -> tuple[int, list[int]]:
        """Return PDU address and words of ``setpoint``: PR[1], its validity, R[1] and R[2].

        Args:
            positions: As :func:`~twin_controller.modbus.axes.axes_of` takes them.
            heartbeat: R[1], 0..32767.
            speed_percent: R[2]; rounded down to a whole percent, but 1 at least; 1..100.

        Raises:
            SetpointError: Wrong count, a value not finite or outside the joint's range, a speed
                outside 1..100.
        """
        axes = axes_of(positions, self._joints, self._registers["setpoint"].count)
        if not 0.0 < speed_percent <= 100.0:
            raise SetpointError(f"set point: speed_percent = {speed_percent} is outside (0, 100]")
        assert self.setpoint is not None
        values = {
            "setpoint": axes,
            "setpoint_valid": [1.0],
            "heartbeat": [float(heartbeat & 0x7FFF)],
            # Rounded down, or the robot would be faster than its limit.
            "stream_speed": [float(max(1, math.floor(speed_percent)))],
        }
        return self.setpoint.offset, self._block(self.setpoint, values)

    def encode_positions(self, positions: Sequence[float]) -> list[int]:
        """Return the words of one set point, as it stands in a place of the ring.

        Raises:
            SetpointError: Wrong count, a value not finite or outside the joint's range.
        """
        axes = axes_of(positions, self._joints, self._registers["setpoint"].count)
        return [word for value in axes for word in self._encode("setpoint", value)]

    def place_offset(self, place: int) -> int:
        """Return the PDU address of a place of the ring, counted from 0."""
        return self._registers["ring_setpoint"].offset + place * self._registers["setpoint"].words

    def encode_ring(
        self, heartbeat: int, speed_percent: int, newest: int, times: Sequence[int]
    ) -> tuple[int, list[int]]:
        """Return PDU address and words of ``ring``.

        Args:
            heartbeat: R[1], 0..32767.
            speed_percent: R[2], 1..100.
            newest: Number of the last set point that is given.
            times: Of each place [ms of the robot's clock]; -1: none.
        """
        assert self.ring is not None
        values = {
            "heartbeat": [float(heartbeat & 0x7FFF)],
            "stream_speed": [float(speed_percent)],
            "ring_write": [float(newest)],
            "ring_clock_ms": [float(time) for time in times],
        }
        return self.ring.offset, self._block(self.ring, values)

    def encode_int(self, name: str, value: int) -> list[int]:
        """Return the words of one integer register.

        Raises:
            SetpointError: The value does not fit the register.
        """
        return self._encode(name, value)

    def encode_command(self, code: int, sequence: int) -> tuple[int, list[int]]:
        """Return PDU address and words of a numbered command, which go in one request."""
        assert self._command is not None
        return self._registers[self._command.register].offset, [code, sequence]

    def _block(self, block: Block, values: Mapping[str, Sequence[float]]) -> list[int]:
        """Return the words of all registers of a block."""
        words = [0] * block.count
        for name, given in values.items():
            if name not in self._registers:
                continue
            begin = self._registers[name].offset - block.offset
            encoded = [word for value in given for word in self._encode(name, value)]
            words[begin : begin + len(encoded)] = encoded
        return words

    def _expect(self, block: Block, words: Sequence[int]) -> None:
        if len(words) != block.count:
            raise SampleError(f"{len(words)} words instead of {block.count}")

    def _take(
        self, name: str, words: Sequence[int], block: Block | None
    ) -> tuple[Register, Sequence[int]]:
        register = self._registers[name]
        begin = register.offset - (block or self.state).offset
        return register, words[begin : begin + register.words]

    def _number(self, name: str, words: Sequence[int], block: Block | None = None) -> int:
        """Return a whole number, after its scale."""
        return round(self._floats(name, words, block)[0])

    def _floats(self, name: str, words: Sequence[int], block: Block | None = None) -> list[float]:
        """Return the values of a register in its unit."""
        return numbers(*self._take(name, words, block), self._low_first)

    def _encode(self, name: str, value: float) -> list[int]:
        """Return the words of one value given in the register's unit."""
        return to_words(name, self._registers[name], value, self._low_first)

    def _text(self, name: str, words: Sequence[int], block: Block) -> str:
        if name not in self._registers:
            return ""
        return text_of(self._take(name, words, block)[1])

    def _clock(self, words: Sequence[int]) -> int:
        clock = self._number("clock_ms", words)
        if self._registers["clock_ms"].scale != 1.0:
            # A controller's own clock counts on where ours, of milliseconds, begins again.
            return clock % CLOCK_WRAP_MS
        if clock < 0:
            raise SampleError(f"clock_ms = {clock} is negative")
        return clock

    def _percent(self, name: str, words: Sequence[int]) -> int:
        value = self._number(name, words)
        if not 0 <= value <= 100:
            raise SampleError(f"{name} = {value} is outside [0, 100]")
        return value
