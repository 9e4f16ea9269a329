"""A pair whose real robot is the stand-in's controller.

Its filters, servo lag and ramps, in virtual time, without a wire.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from fanuc_emulator.config import load_emulator
from fanuc_emulator.controller import Controller
from fanuc_emulator.snapshot import ControlType
from fanuc_emulator.tp.executor import Program, ProgramState
from scara_config.programs.steps import MoveStep
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import AnyAction, Command, OverrideReal, SendReal, StreamReal
from twin_controller.core.events import RealMeasured
from twin_controller.core.setup import Setup
from twin_controller.robot.signals import UI_SIGNALS, Number, Pulse, Signal, TakeBack, steps

from harness.pair import ROBOT, SETUP, Pair
from harness.programs import program_of
from harness.sides import Joints
from harness.workspace import ROOT

EMULATOR = load_emulator(ROBOT, ROOT / "config")
COLUMNS = [k for k, joint in enumerate(ROBOT.joints) if joint.twin]
PULSE_S = 0.12
WRITE_S = 0.002
"""From a command until the robot has it [s]."""
RSR = 2
"""What starts the program."""


def moves(*targets: dict[str, float], speed_percent: float = 100.0) -> Program:
    """Return a program of joint moves.

    Targets by joint in degrees and millimetres, joints that are left out at 0.
    """
    poses = [
        tuple(target.get(joint.name, 0.0) * joint.scale for joint in ROBOT.joints)
        for target in targets
    ]
    steps = [MoveStep(k, pose, speed_percent, True) for k, pose in enumerate(poses, start=1)]
    return program_of("MOVES", steps)


class EmulatedPair(Pair):
    """The core, an ideal twin and the stand-in.

    ``track`` is where the twin's joints of the stand-in really were, each 2 ms.
    """

    def __init__(self, program: Program, override: int = 100, setup: Setup = SETUP) -> None:
        """Let the stand-in stand at home with one program, at ``override`` percent."""
        super().__init__(setup=setup)
        self.robot = Controller(EMULATOR, ROBOT, {RSR: program}, boot_seconds=0.0)
        self.robot.write_override(override)
        self.shown = self.robot.step()
        self.track: list[tuple[Joints, Joints]] = []

    def start(self) -> None:
        """Start the program on the robot's own side."""
        self._pulse(f"rsr{RSR}")

    @property
    def standing(self) -> bool:
        """Whether no program runs and no axis moves."""
        return self.shown.program_state is not ProgramState.RUNNING and not any(
            self.shown.velocities
        )

    def move_real(self, now: float) -> None:
        """Let a millisecond pass; the stand-in steps every second one."""
        if round(now * 1000) % 2 == 0:
            self.shown = self.robot.step()
            self.real_q = _twin_joints(self.shown.positions)
            self.track.append((self.real_q, _twin_joints(self.shown.velocities)))

    def _report_real(self) -> None:
        shown, kind = self.shown, self.shown.control_type
        event = RealMeasured(
            now=self.now,
            sent=self.now - 0.0005,
            received=self.now,
            clock_ms=shown.clock_ms,
            motion=JointMotion.measured(
                _twin_joints(shown.measured_positions),
                _twin_joints(shown.measured_velocities),
                1e-3 * shown.clock_ms,
            ),
            own_program=kind is ControlType.PROGRAM,
            streaming=kind is ControlType.STREAM,
            paused=shown.outputs.paused or shown.outputs.held,
            drives_on=shown.outputs.sysrdy,
            fault=shown.outputs.fault,
            held=shown.outputs.held,
            held_there=shown.outputs.panel_held,
            estop_pressed=shown.outputs.panel_estop,
            speed_percent=shown.override * shown.program_speed * 1e-2,
            override_percent=float(shown.override),
        )
        self._report(event, lambda: self.real_up)

    def _obey(self, action: AnyAction) -> None:
        match action:
            case OverrideReal(speed_percent=percent):
                self._write(WRITE_S, lambda: self.robot.write_override(round(percent)))
            case StreamReal():
                self._write(
                    max(0.0, action.send_at - self.now) + WRITE_S, lambda: self._set_point(action)
                )
            case SendReal(command=do):
                self._write(WRITE_S, lambda: self._perform(do))
            case _:
                super()._obey(action)

    def _write(self, delay: float, call: Callable[[], object]) -> None:
        if self.real_up:
            self._later(delay, call)

    def _set_point(self, action: StreamReal) -> None:
        pose = list(self.shown.positions)
        for column, value in zip(COLUMNS, action.setpoint.q):
            pose[column] = value
        self.robot.write_setpoint(pose)
        self.robot.write_setpoint_valid(True)
        self.robot.source.speed_percent = min(100, math.ceil(action.speed_percent * 1.25))

    def _perform(self, command: Command) -> None:
        """Carry out one command by the product's own table, as RealLink does."""
        for step in steps(UI_SIGNALS, command, self.shown.outputs.paused):
            match step:
                case Signal():
                    self.robot.write_input(step.name, step.level)
                case Pulse():
                    self._pulse(step.name)
                case TakeBack():
                    self.robot.write_setpoint_valid(False)
                case Number():
                    getattr(self.robot, f"write_{step.name}")(step.value)

    def _pulse(self, name: str) -> None:
        self.robot.write_input(name, True)
        self._later(PULSE_S, lambda: self.robot.write_input(name, False))


def _twin_joints(full: Joints) -> Joints:
    return tuple(full[column] for column in COLUMNS)
