"""One experiment on one robot at one speed: what it measured, or why it ended."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache
from itertools import cycle
from pathlib import Path

import msgspec
import numpy as np
from scara_config.programs.steps import MoveStep, WaitStep
from scara_control.kinematics.screws import ScrewModel, tool_positions

from harness.plants.variants import Variant
from harness.programs import program_of
from harness.scenes.troubled import TroubledCell
from harness.virtual_cell.cell import CellError
from harness.virtual_cell.experiments import run_experiments
from harness.virtual_cell.files import CellFiles
from harness.workspace import ROOT

ARTICLE_PERCENT = 50.0
"""The speed of the article's moves; they are too short for much more."""
SWING = 0.7
"""Long moves go so far of joint_1's range to either side."""
BENT = 0.7
"""A SCARA's arm that is stretched at home is bent by this [rad]: nobody moves at the edge of reach.

An upper arm that leans forward at home is upright: clear of what stands around the robot.
"""
ABOVE_M = 0.1
"""So far above its home a joint that slides stays: clear of the table."""
WAIT_S = 0.7
LEADERS = ("real_leads", "twin_leads")


@dataclass(frozen=True)
class Trial:
    """What an experiment measured.

    Attributes:
        robot: Its profile.
        variant: Its name.
        leader: ``real_leads`` or ``twin_leads``.
        speed_percent: What the programs ask for, of the joints' largest speed: the article's moves
            for ``ARTICLE_PERCENT``, else long ones, which are long enough to reach it.
        fastest_percent: What the leader's fastest joint reached, of its largest speed.
        path_percent: Largest distance of both tools at the same instant [percent of reach], from
            the first move on.
        lag_ms: By how much the follower is behind; None: no lag fits.
        rest_percent: Largest distance at rest, against the set position too; None: both never stood
            still for long enough.
        path_deg: Largest angle between both tools at the same instant.
        rest_deg: The same at rest.
        seconds: The experiment took so long, waits included.
        ended: Why there are no figures, or only those of a part; empty if there are.
    """

    robot: str
    variant: str
    leader: str
    speed_percent: float
    fastest_percent: float | None = None
    path_percent: float | None = None
    lag_ms: float | None = None
    rest_percent: float | None = None
    path_deg: float | None = None
    rest_deg: float | None = None
    seconds: float | None = None
    ended: str = ""


@cache
def run_trial(
    robot: str,
    variant: Variant,
    leader: str,
    speed_percent: float,
    visits: int | None = None,
    folder: Path = ROOT / "config",
) -> Trial:
    """Run one experiment on a new cell; the same one is run once.

    Args:
        robot: Its profile.
        variant: How it was made.
        leader: ``real_leads`` or ``twin_leads``.
        speed_percent: What the programs ask for.
        visits: So many places a twin that leads goes to; None: all of the experiment's.
        folder: With all YAML files.
    """
    trial = Trial(robot, variant.name, leader, speed_percent)
    files = variant.files(robot, folder)
    if speed_percent != ARTICLE_PERCENT:
        files = long_moves(files, speed_percent)
    with TroubledCell(_visiting(files, visits), seed=1, clock_jitter=variant.clock_jitter) as cell:
        try:
            cell.connect()
            # As somebody at the pendant leaves it for a run: a robot begins with 10 %.
            cell.real.robot.write_override(100)
            cell.schedule.run(0.5)
            begun = cell.schedule.now
            if variant.pauses:
                _pause_again_and_again(cell, variant)
            result = run_experiments(cell, [leader])[leader]
        except CellError as error:
            return replace(trial, ended=_mode_of(cell, str(error)))
    found, turned = result.comparison, result.turned
    if found is None or turned is None:
        return replace(trial, ended="; ".join(result.reasons))
    reach = files.robot.reach_mm
    at_rest = found.positioning_max_mm
    # Figures beyond limits are figures; behind noisy encoders nobody is seen to stand at a visit.
    ended = "; ".join(reason for reason in result.reasons if "no samples" in reason)
    return replace(
        trial,
        fastest_percent=round(_fastest(cell, leader, begun), 1),
        path_percent=round(100.0 * found.path.max_mm / reach, 3),
        lag_ms=None if found.lag_s is None else round(1e3 * found.lag_s, 1),
        rest_percent=None if at_rest is None else round(100.0 * at_rest / reach, 4),
        path_deg=round(turned.path_max_deg, 3),
        rest_deg=None if turned.rest_max_deg is None else round(turned.rest_max_deg, 4),
        seconds=round(cell.schedule.now - begun, 1),
        ended=ended,
    )


def _visiting(files: CellFiles, visits: int | None) -> CellFiles:
    """Return a cell whose twin, where it leads, visits the first places only."""
    listed = files.experiments.experiments
    led = msgspec.structs.replace(listed["twin_leads"], visits=listed["twin_leads"].visits[:visits])
    experiments = msgspec.structs.replace(
        files.experiments, experiments={**listed, "twin_leads": led}
    )
    return replace(files, experiments=experiments)


def long_moves(files: CellFiles, speed_percent: float) -> CellFiles:
    """Return a cell whose experiments swing joint_1 to and fro over most of its range."""
    poses = [_swung(files, side) for side in (0.0, -1.0, 1.0)]
    arm = [k for k, joint in enumerate(files.robot.twin_joints) if joint.screw_axis is not None]
    tool = tool_positions(ScrewModel.from_robot(files.robot), np.array(poses)[:, arm])
    robot = msgspec.structs.replace(
        files.robot, positions_m={f"P{k}": tuple(map(float, at)) for k, at in enumerate(tool, 1)}
    )
    # First up, clear of what stands around the robot's home.
    visits = ["P1", "P2", "P3", "P2", "P3", "P2"]
    steps: list[MoveStep | WaitStep] = []
    for line, visit in enumerate(visits, 1):
        twin = iter(poses[int(visit[1]) - 1])
        full = tuple(next(twin) if joint.twin else 0.0 for joint in robot.joints)
        steps += [MoveStep(line, full, speed_percent, True), WaitStep(line, WAIT_S)]
    experiments = {
        "real_leads": msgspec.structs.replace(
            files.experiments.experiments["real_leads"], visits=visits
        ),
        "twin_leads": msgspec.structs.replace(
            files.experiments.experiments["twin_leads"],
            visits=visits,
            speed_percent=speed_percent,
        ),
    }
    number = files.program_number("ARTICLE")
    return replace(
        files,
        robot=robot,
        programs={**files.programs, number: program_of("ARTICLE", steps)},
        experiments=msgspec.structs.replace(files.experiments, experiments=experiments),
    )


def _swung(files: CellFiles, side: float) -> list[float]:
    """Return a pose of the twin's joints with joint_1 far to one side, or in the middle for 0.

    A sliding joint is as high above home as its stroke lets it, however it counts.
    """
    joints = files.robot.twin_joints
    pose = list(files.robot.home_positions)
    pose[0] = SWING * abs(side) * (joints[0].upper if side > 0.0 else joints[0].lower)
    pose[1] = BENT if pose[1] == 0.0 else 0.0
    for k, joint in enumerate(joints):
        if joint.unit == "mm" and joint.screw_axis is not None:
            above = pose[k] + math.copysign(ABOVE_M, joint.screw_axis[5])
            pose[k] = min(max(above, joint.lower), joint.upper)
    return pose


def _fastest(cell: TroubledCell, leader: str, begun: float) -> float:
    """Return the leader's largest joint speed, percent of that joint's largest."""
    side = cell.real if leader == "real_leads" else cell.twin
    largest = [joint.velocity for joint in cell.files.robot.twin_joints]
    return max(
        100.0 * abs(speed) / most
        for at, _, qdot in side.truth
        if at >= begun
        for speed, most in zip(qdot, largest)
    )


def _pause_again_and_again(cell: TroubledCell, variant: Variant) -> None:
    lengths = cycle(variant.pauses)

    def stand() -> None:
        cell.stand_controller(next(lengths))
        cell.schedule.after(variant.pause_every, stand)

    cell.schedule.after(variant.first_pause, stand)


def _mode_of(cell: TroubledCell, words: str) -> str:
    """Say in which mode it ended, and why the controller went there."""
    return f"{cell.mode}: {cell.why}" if cell.mode != "IDLE" else words
