"""The cell as its files describe it, and the world at rest in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fanuc_emulator.tp.rehearsal import read_program
from scara_config import Robot, config_directory, load_robot
from scara_config.frames import find_frames
from scara_config.palletise import Palletise, find_palletise
from scara_config.payload import Payload, Payloads, load_payloads
from scara_config.programs.files import ProgramSteps, program_path
from scara_control.config import load_motion
from scara_control.dynamics.arm_model_io import ArmModel
from scara_description.vehicle import with_vehicle

from scara_description.urdf import Model, parse_urdf
from what_if.config import load_limits, load_what_if
from what_if.handling import parts_at_start
from what_if.world import Cell, Lag, World

GRAVITY = 9.81
"""[m/s^2], standard gravity, rounded."""


def read_cell(directory: Path | str | None = None) -> Cell:
    """Read a cell's files.

    Raises:
        ConfigError: One is missing or wrong.
    """
    folder = Path(directory or config_directory())
    robot, work = load_robot(folder), find_palletise(folder)
    return Cell(
        robot,
        description_of(robot, work, folder),
        load_what_if(folder),
        load_motion(folder),
        *load_limits(folder),
        work,
        load_payloads(folder).rated_kg,
    )


def description_of(robot: Robot, work: Palletise | None, folder: Path) -> Model:
    """Return the robot's URDF, with the vehicle where frames.yaml has it.

    Raises:
        ConfigError: frames.yaml is wrong.
    """
    text = robot.description.read_text(encoding="utf-8")
    if work is not None:
        text = with_vehicle(text, work, find_frames(folder))
    return parse_urdf(text, seen=False)


class Models:
    """The dynamics of the arm without and with a part in hand; close it after use."""

    def __init__(self, cell: Cell, payloads: Payloads) -> None:
        robot = cell.robot
        self._names = [joint.name for joint in robot.twin_joints]
        self._part = _part_payload(cell)
        self._told: Payload | None = None
        told = payloads.find(payloads.set_number)
        self._empty = ArmModel(
            robot.description, self._names, robot.tool_frame, gravity=GRAVITY, payloads=[told]
        )
        self._full = ArmModel(
            robot.description,
            self._names,
            robot.tool_frame,
            gravity=GRAVITY,
            payloads=self._with_part(told),
            beside=self._empty,
        )
        self._told = told

    def told(self, payload: Payload) -> dict[bool, ArmModel]:
        """Return both models with this payload at the tool."""
        if payload != self._told:
            # The empty one first: it clears the engine that both share, the other's body with it.
            self._empty.carry([payload])
            self._full.carry(self._with_part(payload))
            self._told = payload
        return {False: self._empty, True: self._full}

    def close(self) -> None:
        """Free the engine that both share."""
        # In this order: the second one ends the engine that the first still uses.
        self._full.close()
        self._empty.close()

    def _with_part(self, payload: Payload) -> Sequence[Payload]:
        return [payload, self._part] if self._part else [payload]


def _part_payload(cell: Cell) -> Payload | None:
    """Return a part in hand as a payload: a disc that hangs below the nozzle."""
    if cell.work is None:
        return None
    kind = cell.work.parts
    # Moments of a solid cylinder: m (3 r^2 + h^2) / 12 across its axis, m r^2 / 2 along it.
    aside = kind.mass_kg * (3.0 * kind.radius**2 + kind.height**2) / 12.0
    # In the tool's frame, whose z points down: what hangs below it has a positive z.
    middle = (0.0, 0.0, cell.work.task.gap_mm * 1e-3 + 0.5 * kind.height)
    return Payload(
        number=1,
        name="part in hand",
        mass_kg=kind.mass_kg,
        centre_m=middle,
        inertia_kg_m2=(aside, aside, 0.5 * kind.mass_kg * kind.radius**2),
    )


@contextmanager
def resting_cell(directory: Path | str | None = None) -> Iterator[tuple[World, Models]]:
    """Yield the world of a cell that was just started: the arm at home, parts on their stands.

    With it come the dynamics, for a world with another payload.

    Raises:
        ConfigError: A file is missing or wrong.
    """
    cell = read_cell(directory)
    payloads = load_payloads(directory)
    models = Models(cell, payloads)
    told = payloads.find(payloads.set_number)
    lag = cell.config.lag
    try:
        world = World(
            cell,
            tuple(cell.robot.home_positions),
            Lag(lag.mean_ms * 1e-3, lag.spread_ms * 1e-3),
            models.told(told),
            parts_at_start(cell),
            told,
            zones=tuple(cell.robot.keep_out),
            cap_percent=cell.cap_percent,
        )
        yield world, models
    finally:
        models.close()


def find_program(cell: Cell, name: str, directory: Path | str | None = None) -> ProgramSteps:
    """Return what a program of the robot does, by its name or from a file ``NAME.LS``.

    Raises:
        ConfigError: There is none, its file is wrong, or what it does depends on its inputs; the
            text lists those that exist.
    """
    return read_program(program_path(name, directory), cell.robot, directory)
