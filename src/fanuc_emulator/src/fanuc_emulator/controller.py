"""The robot controller.

It steps signals, override, alarms, programs and motion once per interpolation period.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial

import msgspec
import numpy as np
from scara_config import Robot
from scara_config.programs.files import Taught, joint_positions
from scara_config.programs.tp.values import ExecutionError
from scara_config.set_up.settings import STREAM_RSR

from fanuc_emulator import alarms
from fanuc_emulator.alarms import Alarm, AlarmCode, AlarmList, RefusedError, Severity
from fanuc_emulator.config import EmulatorConfig
from fanuc_emulator.drives.group import motion_of
from fanuc_emulator.gripping.cell_parts import CellParts
from fanuc_emulator.jobs import Jobs
from fanuc_emulator.places import Signals, registers_of
from fanuc_emulator.plant.delays import LateSignals
from fanuc_emulator.plant.readings import Readings
from fanuc_emulator.reset import FaultReset
from fanuc_emulator.settings import MODES, Mode
from fanuc_emulator.snapshot import ControlType, Snapshot
from fanuc_emulator.streaming.source import StreamSource
from fanuc_emulator.tp.background import HEARTBEAT, Background
from fanuc_emulator.tp.executor import MOVES, Executor, ProgramState, stream_program
from fanuc_emulator.tp.motions import StreamStep
from fanuc_emulator.uop import NORMALLY_ON, Asked, Inputs, Outputs, UopRequest, unlit

_CLOCK_WRAP = 2**31


class Controller:
    """Take writes, step, give snapshots.

    Args:
        config: emulator.yaml and the plant.
        robot: robot.yaml.
        programs: By RSR number, from 2 up; RSR1 is the stream program.
        boot_seconds: UTC at tick 0, for the dates of alarms [s].
        parts: What the gripper can hold; None: there is nothing.
        random: Draws what the plant leaves to chance; None: it leaves nothing to it.
        ring_places: Of the ring of set points ahead; 0: the robot has none.
        library: Programs that can be called, by name; None: those that have a number.

    Attributes:
        source: Set points of the stream program, PR[1] and those ahead.
        override: The general override, in force [percent].
    """

    def __init__(
        self,
        config: EmulatorConfig,
        robot: Robot,
        programs: Mapping[int, Taught],
        boot_seconds: float,
        parts: CellParts | None = None,
        random: np.random.Generator | None = None,
        ring_places: int = 0,
        library: Mapping[str, Taught] | None = None,
    ) -> None:
        self.parts, self._gripper = parts, False
        self._config, self._settings, self._boot_seconds = config, config.settings, boot_seconds
        self._tick, self._dt, self._period_ms = 0, config.dt, config.plant.servo_period_ms
        self._home = joint_positions(config.start_position, robot, lambda _: "start_position")
        plant = config.plant
        self._motion, planner = motion_of(plant, robot, self._home)
        self._motion.slow = config.settings.mode == "T1"
        self._readings = Readings(plant, robot.joints, random)
        late = plant.shown_after_ms
        self._late = LateSignals(late, plant.servo_period_ms) if late else None
        # What late signals show; None: everything is shown at once.
        self._shown: tuple[Outputs, Alarm | None] | None = None
        self.source = StreamSource(robot.joints, self._home, ring_places)
        shown = self._level, self._outputs, (lambda: self._gripper), (lambda: self._vacuum)
        signals = Signals(
            *shown, self.write_input, self.write_override, lambda: self._tick * self._dt, parts
        )
        self.registers = registers_of(signals, self.source, self._motion, planner, config)
        self._executor = Executor(self.registers)
        stream = {STREAM_RSR: stream_program(config.rsr_programs[0])}
        starts = plant.start_delay_ms / 1000.0, config.settings.start_for_continue
        self.registers.locked = lambda: self._executor.locks
        self._jobs = Jobs(stream, self._executor, *starts, self._start_obstacle)
        self.take_programs = self._jobs.take
        self.take_programs(programs, library)
        self._inputs = Inputs(config.settings)
        self._unlit = dict.fromkeys(unlit(config.settings.uop), False)
        self._alarms = AlarmList()
        self._reset = FaultReset(self._motion, self._alarms, plant.power_on_ms)
        self._background = Background(self.registers, config)
        # Inputs that were on and off again since the background program looked.
        self._pulsed: set[str] = set()
        self.override, self._aborting = config.cold_start_override_percent, False
        # The drives were cut on the way of a move: whoever resumes it plans the rest anew.
        self._cut = False
        for name in config.settings.unwired:
            self.write_input(name, False)
        self._show()

    def write_input(self, name: str, value: bool) -> None:
        """Set UI signal ``name``; a background program copies each ``gripper`` to RO[1]."""
        if name == "gripper":
            self._gripper = value
        else:
            self._obey(self._inputs.write(name, value, self._now_ms))

    def pulse_input(self, name: str) -> None:
        """Switch UI signal ``name`` on and off, as a background program does for a client."""
        self._pulsed.add(name)
        self._obey(self._inputs.pulse(name, self._now_ms))

    def _obey(self, asked: Iterable[Asked]) -> None:
        """Do what the edges of inputs ask for."""
        for request, number in asked:
            match request:
                case UopRequest.POWER_OFF | UopRequest.HOLD | UopRequest.END:
                    cut, hold, end = UopRequest.POWER_OFF, UopRequest.HOLD, UopRequest.END
                    stops = {cut: self._cut_drives, hold: self._pause, end: self._abort_all}
                    self._try(self._jobs.forget_here)
                    stops[request]()
                    # *SFSPD off lowers the override; only who sets one raises it again.
                    self.write_override(self.override)
                case UopRequest.CYCLE_STOP:
                    self._jobs.clear()
                    if self._settings.cstopi_for_abort:
                        self._abort()
                case UopRequest.RESET:
                    if refusal := self._reset.ask(self._inputs.lit, self._now_ms):
                        self._raise(alarms.RESET_REFUSED, refusal)
                case UopRequest.TURN:
                    self._turn(MODES[number])
                case UopRequest.RUN:
                    until_ms = self._now_ms + self._config.start_wait_ms
                    self._try(partial(self._jobs.run_here, number, until_ms))
                case _:
                    refusal = self._settings.refuses(request, number, STREAM_RSR)
                    if refusal:
                        self._raise(alarms.START_REFUSED, refusal)
                    else:
                        self._try(partial(self._jobs.ask, request, number))

    def _turn(self, mode: Mode) -> None:
        """Turn the mode switch, and the pendant's, which is on in T1 and T2: the robot halts."""
        if mode == self._settings.mode:
            return
        self._settings = self._settings.turned(mode)
        self._motion.slow = mode == "T1"
        self._jobs.clear()
        self._try(self._jobs.forget_here)
        self._cut_drives()
        self._raise(alarms.MODE_SELECTED[mode], "the mode switch was turned")

    def _try(self, start: Callable[[], str | None]) -> None:
        """Start a program or let it go on; a refusal is a warning that says why."""
        ran = self._executor.state is ProgramState.RUNNING
        reason = start()
        if reason is not None:
            self._raise(alarms.START_REFUSED, reason)
        elif self._executor.state is ProgramState.RUNNING and not ran:
            self.source.check_again()
            step, self._cut = self._executor.step if self._cut else None, False
            try:
                if isinstance(step, MOVES):
                    self._motion.start(step)
            except RefusedError as refused:
                self._refuse(refused)

    def write_override(self, percent: int) -> None:
        """Set the general override, 1..100; while ``*SFSPD`` is off it cannot be higher."""
        safe = 100 if self._inputs["sfspd"] else self._config.safety_speed_percent
        self.override = min(percent, safe)

    def write_setpoint(self, positions: Sequence[float]) -> None:
        """Set PR[1] [rad or m], in the order of robot.yaml; it is judged when it is used."""
        if self._executor.locks:
            self._raise(alarms.PR_KEPT, "PR[1] was written while a program has locked it")
        else:
            self.source.write(positions)

    def write_setpoint_valid(self, valid: bool) -> None:
        """Say whether PR[1] is complete; an incomplete one is not used."""
        self.source.valid = valid

    def write_heartbeat(self, heartbeat: int) -> None:
        """Set R[1]; a background program watches it."""
        self.registers.write(HEARTBEAT, heartbeat)

    def step(self) -> Snapshot:
        """Go on for one servo period."""
        self._tick += 1
        self._obey(self._inputs.due(self._now_ms))
        self._reset.step(self._now_ms)
        if self._background.scan(self._now_ms):
            self._pulsed.clear()
            for code, cause in self._background.told:
                self._raise(code, cause, elsewhere=True)
        if self._executor.state is ProgramState.RUNNING or self._executor.beside:
            self._execute()
        self.registers.end_pulses()
        self._motion.step(self.override / 100.0, self._executor.state is not ProgramState.RUNNING)
        if self.parts is not None:
            there = self._readings.true_positions(self._motion.positions)
            self.parts.step(there, self._gripper, self._dt)
        if self._aborting and self._motion.standing:
            self._motion.clear()
            self._end()
        if self._jobs.waits_here:
            self._try(partial(self._jobs.next_here, self._now_ms))
        if self._jobs.waiting:
            self._try(self._jobs.next)
        self._show()
        return self.snapshot()

    def _show(self) -> None:
        """Bring what a client can read up to date."""
        motion = self._motion
        measured = motion.measured_positions, motion.measured_velocities
        self._reading = self._readings.read(self._tick, *measured, self._now_ms, motion.torques)
        if self._late is not None:
            self._shown = self._late.step(self._outputs(), self._alarms.shown)

    def snapshot(self) -> Snapshot:
        """Return what can be read now."""
        program = self._executor.program
        outputs, alarm = self._shown or (self._outputs(), self._alarms.shown)
        return Snapshot(
            tick=self._tick,
            clock_ms=self._clock_at(self._reading.clock_ms),
            plain_clock_ms=self._clock_at(self._now_ms),
            measured_positions=self._reading.positions,
            measured_velocities=self._reading.velocities,
            positions=self._readings.true_positions(self._motion.positions),
            velocities=self._motion.velocities,
            control_type=self._control_type,
            program_speed=self._program_speed,
            override=self.override,
            general_override=self.override,
            heartbeat=self._background.echo,
            watchdog_state=self._background.state,
            program_name=program.name if program else "",
            program_line=self._executor.line,
            program_state=self._executor.state,
            alarm=alarm,
            outputs=outputs,
            inputs=self._inputs.lit,
            ring_read=self.source.ring.read,
            ring_underruns=self.source.ring.underruns,
            mode=self._settings.mode,
            tp_enabled=self._settings.tp_enabled,
            torques=self._reading.torques,
        )

    @property
    def _now_ms(self) -> int:
        """Milliseconds of the own clock since boot."""
        return self._tick * self._period_ms

    def _clock_at(self, now_ms: int) -> int:
        """Return what the robot's clock shows so many milliseconds after boot."""
        return (self._config.plant.clock.boot_offset_ms + now_ms) % _CLOCK_WRAP

    def _level(self, name: str) -> bool:
        """Return whether an input is on, or was since the background program looked last."""
        return self._inputs[name] or name in self._pulsed

    @property
    def _vacuum(self) -> bool:
        """RI[1]: a part closes the nozzle."""
        return self.parts is not None and self.parts.held is not None

    @property
    def _control_type(self) -> ControlType:
        program = self._executor.program
        if program is None or self._executor.state is ProgramState.ABORTED:
            return ControlType.NONE
        return ControlType.STREAM if program.streams else ControlType.PROGRAM

    @property
    def _program_speed(self) -> int:
        """Programmed speed of the running motion [percent]."""
        step = self._executor.step
        if isinstance(step, StreamStep):
            return self.source.speed_percent
        return round(step.speed_percent) if isinstance(step, MOVES) else 0

    def _outputs(self) -> Outputs:
        state, motion, lit = self._executor.state, self._motion, self._inputs.lit
        running, fault = state is ProgramState.RUNNING, self._alarms.fault
        outputs = Outputs(
            # A remote start is possible.
            cmdenbl=not (fault or self._settings.local)
            and (motion.powered and "sfspd" in lit and "enbl" in lit),
            sysrdy=motion.powered,
            progrun=running,
            paused=state is ProgramState.PAUSED,
            held=not ("hold" in lit and "panel_hold" in lit),
            fault=fault,
            atperch=motion.at(self._home),
            tpenbl=self._settings.tp_enabled,
            batalm=False,
            busy=running or not motion.standing,
            panel_estop="panel_imstp" not in lit,
            panel_held="panel_hold" not in lit,
            gripper=self._gripper,
            vacuum=self._vacuum,
        )
        return msgspec.structs.replace(outputs, **self._unlit) if self._unlit else outputs

    def _execute(self) -> None:
        """Let the program go on, and start what its line asks for."""
        motion = self._motion
        try:
            for code, cause in self._executor.advance_beside(self._dt):
                self._raise(code, cause, elsewhere=True)
            ends = motion.path_done, motion.arrived, motion.nears_end
            step = self._executor.advance(self._dt, *ends)
            if self._executor.state is not ProgramState.RUNNING:
                return
            if isinstance(step, MOVES):
                motion.start(step)
            elif isinstance(self._executor.step, StreamStep):
                wanted = self.source.wanted(self._clock_at(self._now_ms))
                motion.stream(wanted, self._executor.step.speed_percent / 100.0)
            elif late := self._executor.overdue(self._config.gripper_timeout_ms * 1e-3):
                # The program pauses when the gripper has not answered in time; START waits again.
                self._raise(alarms.NO_VACUUM, late)
        except ExecutionError as error:
            self._raise(alarms.LINE_REFUSED, str(error))
        except RefusedError as refused:
            self._refuse(refused)

    def _refuse(self, refused: RefusedError) -> None:
        """Make no motion; its line waits until the program goes on."""
        self._executor.refuse()
        self._raise(refused.code, str(refused))

    def _raise(self, code: AlarmCode, cause: str, elsewhere: bool = False) -> None:
        """Make an alarm active and do what its severity asks for, if not told ``elsewhere``."""
        self._alarms.add(Alarm(code, cause, self._boot_seconds + self._tick * self._dt))
        if elsewhere:
            return
        if code.severity in (Severity.PAUSE, Severity.STOP, Severity.SERVO):
            # Less than SERVO is for one program alone: B-83284EN/09, sections 6.1.3, 9.15.2.
            self._pause(others=code.severity is Severity.SERVO)
        elif code.severity > Severity.SERVO:
            self._abort()

    def _cut_drives(self) -> None:
        """Switch the drives off, and pause the program."""
        self._motion.power_off()
        self._reset.drop()
        self._cut = True
        for code in alarms.power_off_causes(self._inputs.lit):
            self._raise(code, "the input was switched off")

    def _pause(self, others: bool = True) -> None:
        """Hold the program, or all; no set point that was given before counts after it."""
        self.source.ring.empty()
        self._executor.pause(others)

    def _abort(self) -> None:
        """Decelerate along the path; the program is paused meanwhile and ended at standstill."""
        self._pause(others=False)
        self._jobs.clear()
        self._aborting = not self._executor.ended
        if self._aborting and not self._motion.powered:
            self._end()

    def _abort_all(self) -> None:
        """End all programs; CSTOPI ends the selected one. Source: B-83284EN/09, 9.14.4, 9.14.5."""
        self._executor.beside.clear()
        self._abort()

    def _end(self) -> None:
        """End the program by force; what was requested meanwhile is cleared with it."""
        self._executor.abort()
        self._jobs.clear()
        self._aborting = False

    def _start_obstacle(self) -> str | None:
        """Say why nothing may start now, or None."""
        if self._aborting:
            return "the program is being ended"
        if self._reset.pending:
            return "the drives are being switched on"
        if self._alarms.fault:
            return "FAULT is on"
        for name in NORMALLY_ON:
            if not self._inputs[name]:
                return f"{name.upper()} is off"
        return None if self._motion.powered else "the drives are off"
