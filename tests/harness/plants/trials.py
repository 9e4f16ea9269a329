"""One experiment on one robot at one speed: what it measured, or why it ended."""

from __future__ import annotations

from dataclasses import dataclass, replace

import msgspec
from fanuc_emulator.program import MoveStep, Program

from harness.plants.variants import Variant, cell_files
from harness.scenes.troubled import TroubledCell
from harness.virtual_cell.cell import CellError
from harness.virtual_cell.experiments import run_experiments
from harness.virtual_cell.files import CellFiles, load_files

PAUSES_S = 1.0
"""From one pause of the controller to the next."""
LEADERS = ("real_leads", "twin_leads")


@dataclass(frozen=True)
class Trial:
    """What an experiment measured.

    Attributes:
        robot: Its profile.
        variant: Its name.
        leader: ``real_leads`` or ``twin_leads``.
        speed_percent: Of the joints' largest speed.
        path_percent: Largest distance of both tools at the same instant [percent of reach], from
            the first move on.
        lag_ms: By how much the follower is behind.
        rest_percent: Largest distance at rest, against the set position too.
        ended: Why there are no figures; empty if there are.
    """

    robot: str
    variant: str
    leader: str
    speed_percent: float
    path_percent: float | None = None
    lag_ms: float | None = None
    rest_percent: float | None = None
    ended: str = ""


def run_trial(robot: str, variant: Variant, leader: str, speed_percent: float) -> Trial:
    """Run one experiment on a new cell."""
    trial = Trial(robot, variant.name, leader, speed_percent)
    files = _at_speed(cell_files(variant, load_files(robot)), speed_percent)
    with TroubledCell(files, clock_jitter=variant.clock_jitter, seed=1) as cell:
        try:
            cell.connect()
            # As somebody at the pendant leaves it for a run: a robot begins with 10 %.
            cell.real.robot.write_override(100)
            cell.schedule.run(0.5)
            if variant.pause:
                _pause_again_and_again(cell, variant.pause)
            result = run_experiments(cell, [leader])[leader]
        except CellError as error:
            return replace(trial, ended=_mode_of(cell, str(error)))
    found = result.comparison
    if found is None:
        return replace(trial, ended="; ".join(result.reasons))
    reach = files.robot.reach_mm
    return replace(
        trial,
        path_percent=round(100.0 * found.path.max_mm / reach, 3),
        lag_ms=round(1e3 * (found.lag_s or 0.0), 1),
        rest_percent=round(100.0 * (found.positioning_max_mm or 0.0) / reach, 4),
    )


def _at_speed(files: CellFiles, speed_percent: float) -> CellFiles:
    """Let the robot's program, whose moves have 50 %, and the twin's moves go at a speed."""
    programs = {
        number: Program(
            program.name,
            program.rsr,
            tuple(
                msgspec.structs.replace(step, speed_percent=speed_percent)
                if isinstance(step, MoveStep)
                else step
                for step in program.steps
            ),
        )
        for number, program in files.programs.items()
    }
    experiments = dict(files.experiments.experiments)
    experiments["twin_leads"] = msgspec.structs.replace(
        experiments["twin_leads"], speed_percent=speed_percent
    )
    return replace(
        files,
        programs=programs,
        experiments=msgspec.structs.replace(files.experiments, experiments=experiments),
    )


def _pause_again_and_again(cell: TroubledCell, pause: float) -> None:
    def stand() -> None:
        cell.stand_controller(pause)
        cell.schedule.after(PAUSES_S, stand)

    cell.schedule.after(PAUSES_S, stand)


def _mode_of(cell: TroubledCell, words: str) -> str:
    """Say in which mode it ended, and why the controller went there."""
    return f"{cell.mode}: {cell.why}" if cell.mode != "IDLE" else words
