"""Programs of the robot from what they do, and what they do from programs."""

from __future__ import annotations

from collections.abc import Sequence

from fanuc_emulator.tp.rehearsal import rehearse
from scara_config import Robot, load_robot
from scara_config.programs.files import Taught
from scara_config.programs.steps import GripperStep, MoveStep, Step
from scara_config.programs.tp.execution import flow_of
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Program

from harness.workspace import ROOT


def program_of(name: str, steps: Sequence[Step]) -> Taught:
    """Return a program with a line for each step, two for the gripper."""
    texts: list[str] = []
    positions: dict[int, tuple[float, ...]] = {}
    for number, step in enumerate(steps, start=1):
        if isinstance(step, MoveStep):
            positions[number] = step.target
            termination = "FINE" if step.fine else "CNT0"
            texts.append(f"J P[{number}] {step.speed_percent:.9f}% {termination}")
        elif isinstance(step, GripperStep):
            level = "ON" if step.on else "OFF"
            texts += [f"RO[1]={level}", f"WAIT RI[1]={level}"]
        else:
            texts.append(f"WAIT {step.seconds:.9f}(sec)")
    return Taught(flow_of(Program(name, tuple(map(read_line, texts))), name), positions)


def steps_of(program: Taught, robot: Robot | None = None) -> list[Step]:
    """Return what a program does, one step after the other."""
    return list(rehearse(program, robot or load_robot(ROOT / "config"), {}))
