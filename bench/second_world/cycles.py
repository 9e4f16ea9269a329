"""Predicted against measured time of the robot's programs, both plants, in virtual time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
from harness.second_world.cycles import measured, run
from rich.console import Console
from scara_config.programs.files import ProgramSteps
from what_if.cell_files_io import find_program, resting_cell
from what_if.config import ProgramConfig
from what_if.judging import judge
from what_if.timing.learning import learned, rests_of
from what_if.world import World

from bench.second_world.figure import Figure

CONFIG = Path(__file__).resolve().parents[2] / "config"
OVERRIDES = (100, 50)


def measure(count: int, folder: Path, console: Console) -> list[Figure]:
    """Predict ARTICLE and PALLETISE; before, one run of TWO_POINT tells how the robot rests."""
    found = []
    with resting_cell(CONFIG) as (world, _):
        for plant in ("ideal", "field"):
            _, seen = run(world, "TWO_POINT", plant)
            rests = rests_of(world, _program(world, "TWO_POINT"), seen)
            law = learned(world.cell.config.program, rests)
            for name in ("ARTICLE", "PALLETISE"):
                for override in OVERRIDES:
                    found.append(_compared(_ruled(world, law, override), name, plant, override))
                    console.print(f"{found[-1].what}: {found[-1].note}")
    return found


def _ruled(world: World, law: ProgramConfig, override: int) -> World:
    """Return the world with what was learned of its robot."""
    config = msgspec.structs.replace(world.cell.config, program=law)
    cell = replace(world.cell, config=config)
    return replace(world, cell=cell, override_percent=float(override))


def _program(world: World, name: str) -> ProgramSteps:
    return find_program(world.cell, name, CONFIG)


def _compared(world: World, name: str, plant: str, override: int) -> Figure:
    told = judge(world, _program(world, name)).duration_s
    took = measured(world, name, plant, override)
    rest = world.cell.config.program.fine_ms
    note = f"predicted {told:.2f} s, took {took:.2f} s; {rest:.0f} ms at each FINE, of TWO_POINT"
    apart = 100.0 * abs(told - took) / took
    return Figure(f"time of {name}, {plant}, override {override} %", "%", 1.0, apart, note=note)
