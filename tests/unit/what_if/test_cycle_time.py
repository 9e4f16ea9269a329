"""The predicted time of a program, against the stand-in that runs it step by step."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.program import ProgramState
from harness.yaml_files import CONFIG
from scara_config.programs.files import ProgramSteps
from scara_config.programs.lines import MoveStep
from what_if.io.cell_files import find_program
from what_if.judging import judge
from what_if.motions import ProgramRun
from what_if.nodes.live_world import commanded
from what_if.world import World

from scara_msgs.msg import TwinControllerState

LONGEST_S = 60.0


def measured(world: World, name: str, override: int = 100) -> float:
    """Return how long the stand-in, plant ideal, runs a program [s]."""
    robot = world.cell.robot
    config, programs = load_emulator(robot, CONFIG, "ideal"), load_programs(robot, CONFIG)
    controller = Controller(config, robot, programs, boot_seconds=1.7e9)
    controller.write_override(override)
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
    predicted = judge(world, motion).duration_s
    assert predicted == pytest.approx(measured(world, name), rel=0.01)


@pytest.mark.parametrize("override", [100, 40])
def test_a_running_program_takes_as_long_as_predicted(world: World, override: int) -> None:
    """While it runs the cell shows its speed, 50 % of the override; that counts only once."""
    shown = TwinControllerState(
        real_override_percent=override, speed_applied_percent=0.5 * override, follower_lag=0.02
    )
    motion = ProgramRun(find_program(world.cell, "ARTICLE", CONFIG))
    predicted = judge(commanded(world, shown), motion).duration_s
    assert predicted == pytest.approx(measured(world, "ARTICLE", override), rel=0.01)
    unknown = commanded(world, TwinControllerState())
    assert (unknown.override_percent, unknown.lag) == (100.0, world.lag)


def test_a_program_of_the_robot_is_not_held_at_a_followers_cap(world: World) -> None:
    """The cap of 80 % is for set points; the robot runs its own program as it is written."""
    found = find_program(world.cell, "ARTICLE", CONFIG)
    steps = tuple(
        MoveStep(step.line, step.target, 100.0, step.fine) if isinstance(step, MoveStep) else step
        for step in found.steps
    )
    fast = ProgramRun(ProgramSteps(found.name, found.rsr, steps))
    open_world = replace(world, cap_percent=100.0)
    assert judge(world, fast) == judge(open_world, fast)
