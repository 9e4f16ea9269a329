"""The predicted time of a program, against the stand-in that runs it step by step."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.program import ProgramState
from harness.yaml_files import CONFIG
from what_if.io.cell_files import find_program
from what_if.judging import judge
from what_if.motions import ProgramRun
from what_if.world import World

LONGEST_S = 60.0


def measured(world: World, name: str) -> float:
    """Return how long the stand-in, plant ideal, runs a program at 100 % override [s]."""
    robot = world.cell.robot
    config, programs = load_emulator(robot, CONFIG, "ideal"), load_programs(robot, CONFIG)
    controller = Controller(config, robot, programs, boot_seconds=1.7e9)
    controller.write_override(100)
    number = next(rsr for rsr, program in programs.items() if program.name == name)
    running = 0
    for step in range(int(LONGEST_S / config.dt)):
        if step in (5, 10):
            controller.write_input(f"rsr{number}", step == 5)
        state = controller.step().program_state
        running += state is ProgramState.RUNNING
        if running and state is ProgramState.ABORTED:
            return running * config.dt
    raise AssertionError(f"{name} does not end")


@pytest.mark.parametrize("name", ["ARTICLE", "TWO_POINT"])
def test_a_program_takes_as_long_as_predicted(world: World, name: str) -> None:
    """Within 1 %: the issue's goal, here for the ideal plant."""
    motion = ProgramRun(find_program(world.cell, name, CONFIG))
    predicted = judge(replace(world, cap_percent=100.0), motion).duration_s
    assert predicted == pytest.approx(measured(world, name), rel=0.01)
