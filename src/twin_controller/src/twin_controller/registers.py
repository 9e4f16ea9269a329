"""What the twin controller reads from and writes to the robot's registers, as typed values.

Units change here: deg and mm on the wire, rad and m inside. Nothing doubtful passes: a sample is whole or refused.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

import msgspec
from scara_config import ConfigError, Robot
from scara_config.modbus_map import ModbusMap, Register, Table

from twin_controller.robot_sample import (
    AlarmStatus,
    ControlType,
    ProgramState,
    ProgramStatus,
    RobotSample,
    SampleError,
    SetpointError,
    WatchdogState,
)

STATE = ("position", "position_valid", "clock_ms", "velocity", "control_type", "program_speed", "heartbeat_echo",
         "watchdog_state", "override_now")  # fmt: skip
SETPOINT = ("setpoint", "setpoint_valid", "heartbeat", "stream_speed")
PROGRAM = ("program_name", "program_line", "program_state")
# The first two registers of ALARM are needed, the rest is shown if it is there.
ALARM = ("alarm_id", "alarm_number", "alarm_severity", "alarm_message", "alarm_cause", "alarm_severity_text")
MOST_WORDS = 125
MOST_WRITTEN = 123


class Block(msgspec.Struct, frozen=True):
    """Neighbouring registers that one request carries: PDU address and number of words (or bits), and their table."""

    offset: int
    count: int
    table: Table = "holding_registers"


class RegisterCodec:
    """Plan of the requests, decoder of the answers, encoder of the writes.

    Args:
        layout: modbus_map.yaml.
        robot: robot.yaml; a joint stands at the place of its ``axis_number``.
        tolerance: How far outside its range a position may be read, as a fraction of the range.

    Raises:
        ConfigError: A block has more words than one request may carry or lies in two tables, the written block has a gap,
            or the robot has an axis without a place.
    """

    def __init__(self, layout: ModbusMap, robot: Robot, tolerance: float = 0.001) -> None:
        self._registers = {**layout.input_registers, **layout.holding_registers}
        self._table_of = layout.table_of
        self._low_first = layout.word_order == "low_first"
        self._joints = robot.joints
        self._tolerance = tolerance
        self._status = layout.status_word
        self._command = layout.command_word
        shown = ((self._status.register,) if self._status else ()) + ((self._command.echo,) if self._command else ())
        self.state = self._block((*STATE, *shown), MOST_WORDS)
        self.setpoint = self._block(SETPOINT, MOST_WRITTEN)
        self.program = self._block(PROGRAM, MOST_WORDS)
        self.alarm = self._block([name for name in ALARM if name in self._registers], MOST_WORDS)
        if self.setpoint.count != sum(self._registers[name].words for name in SETPOINT):
            raise ConfigError(
                f"modbus_map.yaml: {', '.join(SETPOINT)}: must follow each other without a gap to be written at once"
            )
        axes = self._registers["position"].count
        for joint in robot.joints:
            if joint.axis_number > axes:
                raise ConfigError(f"modbus_map.yaml: position has {axes} values, {joint.name} is axis {joint.axis_number}")
        self._outputs = {name: bit.offset for name, bit in layout.discrete_inputs.items()}
        self.outputs: Block | None = None
        if self._outputs:
            first, last = min(self._outputs.values()), max(self._outputs.values())
            self.outputs = Block(first, last - first + 1)

    def decode_sample(self, words: Sequence[int], bits: Sequence[bool] = ()) -> RobotSample:
        """Return the reading in the answers to ``state`` and ``outputs`` (nothing, if the signals are in a word of ``state``).

        Raises:
            SampleError: An answer is too short or too long, the robot calls its position invalid, a number is not finite or
                out of range, an enumeration has an unknown value.
        """
        if len(words) != self.state.count:
            raise SampleError(f"{len(words)} words instead of {self.state.count}")
        if self.outputs is not None and len(bits) < self.outputs.count:
            raise SampleError(f"{len(bits)} signals instead of {self.outputs.count}")
        if self._number("position_valid", words) != 1:
            raise SampleError("the robot says that its position is not valid")
        try:
            control = ControlType(self._number("control_type", words))
            watchdog = WatchdogState(self._number("watchdog_state", words))
        except ValueError as error:
            raise SampleError(str(error)) from error
        return RobotSample(
            positions=self._positions(words),
            velocities=self._velocities(words),
            clock_ms=self._clock(words),
            control_type=control,
            program_speed=self._percent("program_speed", words),
            override=self._percent("override_now", words),
            heartbeat_echo=self._number("heartbeat_echo", words),
            watchdog_state=watchdog,
            outputs=self._signals(words, bits),
            command_echo=self._number(self._command.echo, words) if self._command else 0,
        )

    def clock_of(self, words: Sequence[int]) -> int:
        """Return the robot's clock in an answer to ``state`` [ms], whatever else is in it.

        Raises:
            SampleError: It is negative.
        """
        return self._clock(words)

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
        name, line = self._text("program_name", words, self.program), self._number("program_line", words, self.program)
        return ProgramStatus(name, line, state)

    def decode_alarm(self, words: Sequence[int]) -> AlarmStatus:
        """Return what the alarm block says.

        Raises:
            SampleError: Wrong number of words.
        """
        self._expect(self.alarm, words)
        return AlarmStatus(
            facility=self._number("alarm_id", words, self.alarm),
            number=self._number("alarm_number", words, self.alarm),
            severity=self._text("alarm_severity_text", words, self.alarm),
            message=self._text("alarm_message", words, self.alarm),
            cause=self._text("alarm_cause", words, self.alarm),
        )

    def encode_setpoint(self, positions: Sequence[float], heartbeat: int, speed_percent: float) -> list[int]:
        """Return the words of ``setpoint``: PR[1], its validity, R[1] and R[2].

        Args:
            positions: Joint positions in the order of robot.yaml [rad or m].
            heartbeat: R[1], 0..32767.
            speed_percent: R[2]; rounded up to a whole percent, 1..100.

        Raises:
            SetpointError: Wrong count, a value not finite or outside the joint's range, a speed outside 1..100.
        """
        if len(positions) != len(self._joints):
            raise SetpointError(f"set point: {len(positions)} positions for {len(self._joints)} joints")
        axes = [0.0] * self._registers["setpoint"].count
        for joint, position in zip(self._joints, positions):
            if not math.isfinite(position) or not joint.lower - 1e-9 <= position <= joint.upper + 1e-9:
                raise SetpointError(
                    f"{joint.name} = {position} {joint.si_unit} is outside [{joint.lower:.6g}, {joint.upper:.6g}]"
                )
            axes[joint.axis_number - 1] = position / joint.scale
        if not 0.0 < speed_percent <= 100.0:
            raise SetpointError(f"set point: speed_percent = {speed_percent} is outside (0, 100]")
        words = [0] * self.setpoint.count
        beat, speed = float(heartbeat & 0x7FFF), float(math.ceil(speed_percent))
        values = {"setpoint": axes, "setpoint_valid": [1.0], "heartbeat": [beat], "stream_speed": [speed]}
        for name, numbers in values.items():
            begin = self._registers[name].offset - self.setpoint.offset
            words[begin : begin + self._registers[name].words] = [word for value in numbers for word in self._encode(name, value)]
        return words

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

    def _block(self, names: Sequence[str], most: int) -> Block:
        """Return the span of the named registers."""
        registers = [self._registers[name] for name in names]
        first = min(register.offset for register in registers)
        count = max(register.offset + register.words for register in registers) - first
        if count > most:
            raise ConfigError(f"modbus_map.yaml: {', '.join(names)}: span {count} words, one request carries {most}")
        tables = {self._table_of(name) for name in names}
        table = tables.pop()
        if tables or table is None:
            raise ConfigError(f"modbus_map.yaml: {', '.join(names)}: stand in two tables, one request reads one")
        return Block(first, count, table)

    def _expect(self, block: Block, words: Sequence[int]) -> None:
        if len(words) != block.count:
            raise SampleError(f"{len(words)} words instead of {block.count}")

    def _take(self, name: str, words: Sequence[int], block: Block | None) -> tuple[Register, Sequence[int]]:
        register = self._registers[name]
        begin = register.offset - (block or self.state).offset
        return register, words[begin : begin + register.words]

    def _number(self, name: str, words: Sequence[int], block: Block | None = None) -> int:
        """Return a whole number, after its scale."""
        return round(self._floats(name, words, block)[0])

    def _floats(self, name: str, words: Sequence[int], block: Block | None = None) -> list[float]:
        """Return the values of a register in its unit."""
        register, taken = self._take(name, words, block)
        if register.type == "int16":
            return [((word ^ 0x8000) - 0x8000) * register.scale for word in taken]
        pairs = [self._join(taken[i : i + 2]) for i in range(0, len(taken), 2)]
        if register.type == "int32":
            return [int.from_bytes(pair, "big", signed=True) * register.scale for pair in pairs]
        return [float(struct.unpack(">f", pair)[0]) * register.scale for pair in pairs]

    def _encode(self, name: str, value: float) -> list[int]:
        """Return the words of one value given in the register's unit.

        Raises:
            SetpointError: It does not fit.
        """
        register = self._registers[name]
        if register.type == "float32":
            return self._split(struct.pack(">f", value / register.scale))
        counts, limit = round(value / register.scale), 1 << (31 if register.type == "int32" else 15)
        if not -limit <= counts < limit:
            raise SetpointError(f"{name} = {value} is outside [{-limit * register.scale:g}, {(limit - 1) * register.scale:g}]")
        return self._split(struct.pack(">i", counts)) if register.type == "int32" else [counts & 0xFFFF]

    def _signals(self, words: Sequence[int], bits: Sequence[bool]) -> frozenset[str]:
        """Return the names of the outputs that are on."""
        if self._status is not None:
            _, (word,) = self._take(self._status.register, words, None)
            return frozenset(name for name, bit in self._status.bits.items() if word >> bit & 1)
        first = self.outputs.offset if self.outputs else 0
        return frozenset(name for name, offset in self._outputs.items() if bits[offset - first])

    def _text(self, name: str, words: Sequence[int], block: Block) -> str:
        if name not in self._registers:
            return ""
        _, taken = self._take(name, words, block)
        text = b"".join(word.to_bytes(2, "big") for word in taken)
        return text.partition(b"\0")[0].decode("ascii", "replace").rstrip()

    def _join(self, pair: Sequence[int]) -> bytes:
        low, high = pair if self._low_first else reversed(pair)
        return high.to_bytes(2, "big") + low.to_bytes(2, "big")

    def _split(self, value: bytes) -> list[int]:
        high, low = int.from_bytes(value[:2], "big"), int.from_bytes(value[2:], "big")
        return [low, high] if self._low_first else [high, low]

    def _clock(self, words: Sequence[int]) -> int:
        clock = self._number("clock_ms", words)
        if clock < 0:
            raise SampleError(f"clock_ms = {clock} is negative")
        return clock

    def _percent(self, name: str, words: Sequence[int]) -> int:
        value = self._number(name, words)
        if not 0 <= value <= 100:
            raise SampleError(f"{name} = {value} is outside [0, 100]")
        return value

    def _positions(self, words: Sequence[int]) -> tuple[float, ...]:
        axes, positions = self._floats("position", words), []
        for joint in self._joints:
            value = axes[joint.axis_number - 1] * joint.scale
            margin = self._tolerance * (joint.upper - joint.lower)
            if not joint.lower - margin <= value <= joint.upper + margin:
                low, high = joint.lower / joint.scale, joint.upper / joint.scale
                raise SampleError(f"{joint.name} = {axes[joint.axis_number - 1]} {joint.unit} is outside [{low:.6g}, {high:.6g}]")
            positions.append(value)
        return tuple(positions)

    def _velocities(self, words: Sequence[int]) -> tuple[float, ...]:
        axes, velocities = self._floats("velocity", words), []
        for joint in self._joints:
            value, limit = axes[joint.axis_number - 1] * joint.scale, 1.5 * joint.velocity
            if not -limit <= value <= limit:
                shown = f"{axes[joint.axis_number - 1]} {joint.unit}/s"
                raise SampleError(f"{joint.name} moves at {shown}, more than 1.5 times its greatest speed")
            velocities.append(value)
        return tuple(velocities)
