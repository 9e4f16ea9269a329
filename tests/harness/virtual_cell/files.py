"""What the YAML files say about one robot's cell; a variation replaces single pieces of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from fanuc_emulator.config import EmulatorConfig, load_emulator, load_programs
from fanuc_emulator.tp.executor import Program
from scara_config import Robot, load_robot
from scara_config.modbus_map import ModbusMap, load_modbus_map
from scara_config.profile import DEFAULT_PLANT
from scara_control.config import MotionConfig, load_motion
from scara_simulation.config import LoopGains, SimulationConfig, load_gains, load_simulation
from twin_controller.config import TwinControllerConfig, load_twin_controller
from twin_experiments.config import ExperimentsFile, load_experiments

from harness.starter import chosen
from harness.workspace import ROOT


@dataclass(frozen=True)
class CellFiles:
    """The files of one robot's cell; ``dataclasses.replace`` makes another plant of it."""

    robot: Robot
    layout: ModbusMap
    emulator: EmulatorConfig
    programs: Mapping[int, Program]
    simulation: SimulationConfig
    gains: list[LoopGains]
    motion: MotionConfig
    controller: TwinControllerConfig
    experiments: ExperimentsFile

    def program_number(self, name: str) -> int:
        """Return the RSR number of a program; an unknown one is a KeyError."""
        return {program.name: number for number, program in self.programs.items()}[name]


def load_files(
    robot: str,
    folder: Path = ROOT / "config",
    plant: str = DEFAULT_PLANT,
    settings: str | Mapping[str, object] = "",
) -> CellFiles:
    """Read all files of the cell of ``robot``, each cell's once: nothing changes what is read.

    Args:
        robot: Name of a profile.
        folder: With all YAML files.
        plant: How its stand-in moves.
        settings: How its stand-in was set up, where it differs from emulator.yaml.
    """
    told = settings if isinstance(settings, str) else tuple(settings.items())
    return _load(robot, folder, plant, told)


@lru_cache(maxsize=16)
def _load(
    robot: str, folder: Path, plant: str, settings: str | tuple[tuple[str, object], ...]
) -> CellFiles:
    with chosen(robot):
        profile = load_robot(folder)
        set_up = settings if isinstance(settings, str) else dict(settings)
        return CellFiles(
            profile,
            load_modbus_map(folder),
            load_emulator(profile, folder, plant, set_up),
            load_programs(profile, folder),
            load_simulation(profile, folder),
            load_gains(profile, folder),
            load_motion(folder),
            load_twin_controller(profile, folder),
            load_experiments(profile, folder),
        )
