"""What the Modbus client sees of a snapshot, and what its writes mean."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from scara_config import Robot
from scara_config.map_entries import FAST_CLOCK, GRIPPER_NUMBERS
from scara_config.modbus_map import RING_NUMBERS, TABLES, ModbusMap, Register, Table

from fanuc_emulator.controller import Controller
from fanuc_emulator.registers import NoRegisterError, RegisterError, Value, decode, encode
from fanuc_emulator.snapshot import Snapshot

# Registers of one number, and what of a snapshot they show.
_NUMBERS = {
    "control_type": "control_type",
    "program_speed": "program_speed",
    "heartbeat_echo": "heartbeat",
    "watchdog_state": "watchdog_state",
    "override_now": "override",
    "program_line": "program_line",
    "program_state": "program_state",
    "ring_read": "ring_read",
    "ring_underruns": "ring_underruns",
    "mode_b0": "mode_b0",
    "mode_b1": "mode_b1",
}
_RANGES = {
    "override": (1, 100),
    "stream_speed": (1, 100),
    "setpoint_valid": (0, 1),
    "heartbeat": (0, 32767),
    "ring_write": (0, RING_NUMBERS),
}


class RegisterImage:
    """The registers as words.

    Units change here: deg and mm on the wire, rad and m inside.

    Args:
        layout: modbus_map.yaml.
        robot: robot.yaml; a joint stands at the place of its ``axis_number``.
        payload_kg: What the robot was told that it carries [kg].

    Attributes:
        tables: Words by table, each from its lowest register on.
        first: PDU address of the first word of each table.
    """

    def __init__(self, layout: ModbusMap, robot: Robot, payload_kg: float = 0.0) -> None:
        self._layout = layout
        self._low_first = layout.word_order == "low_first"
        self._axes = [(joint.axis_number - 1, 1.0 / joint.scale) for joint in robot.joints]
        self._registers = {**layout.input_registers, **layout.holding_registers}
        self._table_of: dict[str, Table] = {}
        self.first: dict[Table, int] = {}
        self.tables: dict[Table, list[int]] = {}
        for table in TABLES:
            registers: dict[str, Register] = getattr(layout, table)
            if registers:
                first = min(register.offset for register in registers.values())
                end = max(register.offset + register.words for register in registers.values())
                self.first[table], self.tables[table] = first, [0] * (end - first)
                self._table_of |= dict.fromkeys(registers, table)
        self._offsets = {table: _offsets(getattr(layout, table).values()) for table in TABLES}
        held = layout.holding_registers.values()
        self._writable = _offsets(register for register in held if register.write)
        self._shown: Snapshot | None = None
        # The override that a tick or a request has brought last, and the first tick that knows it.
        self._override_known: tuple[float, int] = (0.0, 0)
        self._sequence = 0
        self._codes = _codes(layout)
        # A controller's plain clock goes on between two readings.
        clock = self._registers["clock_ms"]
        plain = clock.variable == FAST_CLOCK
        self._numbers = {"clock_ms": "plain_clock_ms" if plain else "clock_ms", **_NUMBERS}
        self._tick_ms = round(clock.scale)
        self._put("position_valid", (1,))
        self._put("stream_speed", (100,))
        self._put("payload_mass", (payload_kg,))

    def show(self, snapshot: Snapshot) -> None:
        """Bring all words up to date with ``snapshot``; what is as before is left alone."""
        before, self._shown = self._shown, snapshot
        # Snapshots never change, and several requests come within one tick.
        if before is snapshot:
            return
        if before is None or before.measured_positions != snapshot.measured_positions:
            self._put("position", self._by_axis(snapshot.measured_positions))
        if before is None or before.measured_velocities != snapshot.measured_velocities:
            self._put("velocity", self._by_axis(snapshot.measured_velocities))
        if before is None or before.torques != snapshot.torques:
            self._put("motor_torque", self._by_axis(snapshot.torques, in_percent=True))
        for name, field in self._numbers.items():
            number = getattr(snapshot, field)
            if before is None or getattr(before, field) != number:
                # A clock that ticks in longer steps shows the last one.
                number -= number % self._tick_ms if name == "clock_ms" else 0
                self._put(name, (number,))
        percent, (known, since) = snapshot.general_override, self._override_known
        differs = percent != known and "override" in self._registers
        # A tick that did not know what was written last changes nothing; while another one stands
        # there, a write has not been taken yet.
        if differs and snapshot.tick >= since and self._get("override")[0] == known:
            self._put("override", (percent,))
            self._override_known = float(percent), since
        self._show_signals(snapshot)
        if before is None or before.program_name != snapshot.program_name:
            self._put("program_name", snapshot.program_name)
            self._put("program_caller", snapshot.program_name)
        # By identity: an alarm is replaced, never changed.
        if before is None or before.alarm is not snapshot.alarm:
            self._show_alarm(snapshot)

    def read(self, table: Table, offset: int, count: int) -> list[int]:
        """Return ``count`` registers from PDU address ``offset`` on.

        Raises:
            NoRegisterError: The map names one of them not.
        """
        for at in range(offset, offset + count):
            if at not in self._offsets[table]:
                raise NoRegisterError(at + 1, f"the map has none there in {table}")
        begin = offset - self.first[table]
        return self.tables[table][begin : begin + count]

    def check_writable(self, offset: int, count: int) -> None:
        """Refuse holding registers that may not be written.

        Raises:
            NoRegisterError: One of them does not exist or is read only.
        """
        for at in range(offset, offset + count):
            if at not in self._writable:
                raise NoRegisterError(at + 1, "it does not exist or is read only")

    def take(self, offset: int, words: Sequence[int]) -> list[tuple[str, Value]]:
        """Store written words and return the registers that they touch, with their new values.

        Args:
            offset: PDU address of the first word.
            words: All inside writable registers.

        Raises:
            RegisterError: A value is outside its range; nothing is stored.
        """
        held, begin = self.tables["holding_registers"], offset - self.first["holding_registers"]
        old = held[begin : begin + len(words)]
        held[begin : begin + len(words)] = words
        touched = []
        for name, register in self._layout.holding_registers.items():
            if register.offset < offset + len(words) and offset < register.offset + register.words:
                value = self._get(name)
                low, high = _RANGES.get(name, (None, None))
                bounded = low is not None and high is not None
                if bounded and not low <= value[0] <= high:  # type: ignore[operator]
                    held[begin : begin + len(words)] = old
                    raise RegisterError(f"{name} = {value[0]} is outside [{low}, {high}]")
                touched.append((name, value))
        written, word = dict(touched), self._layout.command_word
        # A command counts by its number, whoever wrote the code when.
        if word is not None and word.sequence in written:
            touched.append((word.register, self._get(word.register)))
        return touched

    def joint_positions(self, values: Sequence[float]) -> tuple[float, ...]:
        """Convert axis values [deg or mm] to joint positions in robot.yaml's order [SI]."""
        return tuple(values[index] / factor for index, factor in self._axes)

    def apply(self, controller: Controller, values: Sequence[tuple[str, Value]]) -> None:
        """Hand registers that one request wrote to the controller."""
        newest: int | None = None
        for name, value in values:
            match name:
                case "setpoint":
                    controller.write_setpoint(self.joint_positions(value))  # type: ignore[arg-type]
                case "setpoint_valid":
                    controller.write_setpoint_valid(bool(value[0]))
                case "heartbeat":
                    controller.write_heartbeat(int(value[0]))
                case "stream_speed":
                    controller.source.speed_percent = round(float(value[0]))
                case "override":
                    controller.write_override(round(float(value[0])))
                    # The next tick tells what became of it: *SFSPD may cap it, a program set it.
                    self._override_known = float(value[0]), controller.snapshot().tick + 1
                case "ring_setpoint":
                    axes = self._registers["setpoint"].count
                    rows = [value[at : at + axes] for at in range(0, len(value), axes)]
                    controller.source.ring.write_rows([self.joint_positions(row) for row in rows])  # type: ignore[arg-type]
                case "ring_clock_ms":
                    controller.source.ring.write_times([int(time) for time in value])
                case "ring_write":
                    newest = int(value[0])
        # Behind what it says is there, wherever it stands in the request.
        if newest is not None:
            controller.source.ring.write_newest(newest)
        word, written = self._layout.command_word, dict(values)
        if word is not None and word.sequence in written:
            self._command(
                controller, int(written[word.register][0]), int(written[word.sequence][0])
            )

    def _command(self, controller: Controller, code: int, sequence: int) -> None:
        """Obey a numbered command once; a code that nobody knows is confirmed and does nothing."""
        if sequence == self._sequence:
            return
        self._sequence = sequence
        name, level = self._codes.get(code, ("", None))
        if level is not None:
            controller.write_input(name, level)
        elif name:
            controller.pulse_input(name)

    def _show_signals(self, snapshot: Snapshot) -> None:
        """Fill the words of outputs, inputs and the confirmed command, where the map has such."""
        layout = self._layout
        for output, name in GRIPPER_NUMBERS.items():
            self._put(name, (int(getattr(snapshot.outputs, output)),))
        if layout.status_word is not None:
            lit = [
                bit
                for name, bit in layout.status_word.bits.items()
                if getattr(snapshot.outputs, name)
            ]
            self._put_word(layout.status_word.register, sum(1 << bit for bit in lit))
        if layout.switches_word is not None:
            lit = [
                bit for name, bit in layout.switches_word.bits.items() if name in snapshot.inputs
            ]
            self._put_word(layout.switches_word.register, sum(1 << bit for bit in lit))
        if layout.command_word is not None:
            self._put_word(layout.command_word.echo, self._sequence)

    def _put_word(self, name: str, word: int) -> None:
        """Write a register of one word, without a sign."""
        table = self._table_of[name]
        self.tables[table][self._registers[name].offset - self.first[table]] = word & 0xFFFF

    def _get(self, name: str) -> Value:
        """Read one register."""
        register, table = self._registers[name], self._table_of[name]
        at = register.offset - self.first[table]
        return decode(register, self.tables[table][at : at + register.words], self._low_first)

    def _show_alarm(self, snapshot: Snapshot) -> None:
        """Fill ALM[1]."""
        alarm = snapshot.alarm
        code = alarm.code if alarm else None
        self._put("alarm_id", (code.facility if code else 0,))
        self._put("alarm_number", (code.number if code else 0,))
        self._put("alarm_severity", (code.severity if code else 0,))
        self._put("alarm_time", alarm.date if alarm else (0,) * 6)
        self._put("alarm_message", code.text if code else "")
        self._put("alarm_cause", alarm.cause if alarm else "")
        self._put("alarm_severity_text", code.severity.name if code else "")

    def _by_axis(self, values: Sequence[float], in_percent: bool = False) -> list[float]:
        """Place joint values at J1, J2 and so on in deg or mm; an axis without a joint is 0.

        Values ``in_percent`` stay so.
        """
        axes = [0.0] * self._registers["position"].count
        for (index, factor), value in zip(self._axes, values):
            axes[index] = value if in_percent else value * factor
        return axes

    def _put(self, name: str, values: Sequence[float] | Sequence[int] | str) -> None:
        """Write one register's words, if the map has it."""
        register = self._registers.get(name)
        if register is not None:
            table = self._table_of[name]
            at = register.offset - self.first[table]
            self.tables[table][at : at + register.words] = encode(register, values, self._low_first)


def _offsets(registers: Iterable[Register]) -> frozenset[int]:
    """Return the PDU addresses of all words of registers."""
    return frozenset(
        at
        for register in registers
        for at in range(register.offset, register.offset + register.words)
    )


def _codes(layout: ModbusMap) -> dict[int, tuple[str, bool | None]]:
    """Return for each command code the input and the level that it takes; None: a pulse."""
    found: dict[int, tuple[str, bool | None]] = {}
    for name, code in (layout.command_word.codes if layout.command_word else {}).items():
        for value, level in ((code.low, False), (code.high, True), (code.pulse, None)):
            if value is not None:
                found[value] = (name, level)
    return found
