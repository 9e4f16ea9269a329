"""The demo's experiments on a virtual cell, and their figures by the project's own metrics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import msgspec
import numpy as np
from scara_control.kinematics.screws import ScrewModel, tool_positions
from twin_experiments.config import RealLeads, metrics_settings
from twin_experiments.metrics.errors import Comparison
from twin_experiments.metrics.series import Motion
from twin_experiments.report.analysis import Result, analyse
from twin_experiments.report.record import Run, Span

from harness.virtual_cell.cell import VirtualCell

Truth = Sequence[tuple[float, tuple[float, ...], tuple[float, ...]]]


class Figures(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Error figures of one experiment; more is worse for each of them.

    Attributes:
        path_max_mm: Largest distance of both tools at the same instant, while a side moves.
        path_rms_mm: The same, root mean square.
        lag_ms: By how much the follower is behind; its sign is left out.
        path_after_lag_mm: Largest distance with the lag removed.
        travelled_percent: Largest distance in a move, in percent of that move's length.
        positioning_mm: Largest distance at rest, between the sides and from the set position.
        path_angle_deg: Largest angle between both tools, while a side moves.
        rest_angle_deg: The same at rest.
    """

    path_max_mm: float
    path_rms_mm: float
    lag_ms: float
    path_after_lag_mm: float
    travelled_percent: float
    positioning_mm: float
    path_angle_deg: float
    rest_angle_deg: float


def run_experiments(cell: VirtualCell, names: Sequence[str] = ()) -> dict[str, Result]:
    """Run experiments of experiments.yaml on a connected cell and analyse them.

    Args:
        cell: Connected and standing.
        names: Which ones; empty: all that need no parts.

    Raises:
        CellError: One of them could not be made.
    """
    spans = [_run(cell, name) for name in names or cell.files.experiments.experiments]
    cell.schedule.run(0.3)
    files = cell.files
    run = Run(
        path="virtual",
        origin=0.0,
        duration=cell.schedule.now,
        repaired=False,
        joint_names=tuple(joint.name for joint in files.robot.twin_joints),
        spans=tuple(spans),
        real=_motion("real", cell.real.truth),
        twin=_motion("twin", cell.twin.truth),
    )
    settings = metrics_settings(files.experiments.metrics, files.robot)
    tool = partial(tool_positions, ScrewModel.from_robot(files.robot))
    results = analyse(run, files.experiments, files.robot, settings, tool)
    return {result.span.name: result for result in results}


def figures(result: Result) -> Figures:
    """Return the figures of an experiment.

    Raises:
        ValueError: It could not be compared; the text says why.
    """
    found, turned = result.comparison, result.turned
    if found is None or turned is None:
        raise ValueError(f"{result.span.name}: {', '.join(result.reasons)}")
    return Figures(
        path_max_mm=found.path.max_mm,
        path_rms_mm=found.path.rms_mm,
        lag_ms=abs(found.lag_s or 0.0) * 1e3,
        path_after_lag_mm=_after_lag(found),
        travelled_percent=found.travelled_percent or 0.0,
        positioning_mm=found.positioning_max_mm or 0.0,
        path_angle_deg=turned.path_max_deg,
        rest_angle_deg=turned.rest_max_deg or 0.0,
    )


def measure(
    robot: str,
    names: Sequence[str] = (),
    make: Callable[[str], VirtualCell] = VirtualCell,
) -> dict[str, Figures]:
    """Run experiments on a new cell of ``robot`` and return their figures.

    Raises:
        CellError: One could not be made.
        ValueError: One could not be compared, or its verdict is that it failed.
    """
    with make(robot) as cell:
        cell.connect()
        results = run_experiments(cell, names)
    for name, result in results.items():
        if result.reasons:
            raise ValueError(f"{robot} {name}: {'; '.join(result.reasons)}")
    return {name: figures(result) for name, result in results.items()}


def _run(cell: VirtualCell, name: str) -> Span:
    """Run one experiment as run_experiment does, beginning with both sides at rest."""
    experiment = cell.files.experiments.experiments[name]
    metrics = cell.files.experiments.metrics
    rest, positions = metrics.rest_s + 2.0 * metrics.rest_margin_s, cell.files.robot.positions_m
    if isinstance(experiment, RealLeads):
        start = cell.schedule.now
        cell.run_program(experiment.program, experiment.override_percent)
        cell.wait_still(rest)
    else:
        cell.move_to(positions[experiment.visits[0]], experiment.speed_percent)
        cell.wait_still(rest)
        start = cell.schedule.now
        for visit in experiment.visits:
            cell.move_to(positions[visit], experiment.speed_percent)
            cell.wait_still(max(experiment.dwell_s, rest))
    return Span(name, start, cell.schedule.now, True)


def _after_lag(found: Comparison) -> float:
    return found.path_after_lag.max_mm if found.path_after_lag else found.path.max_mm


def _motion(side: str, truth: Truth) -> Motion:
    """Return what was noted as arrays."""
    stamps, q, qdot = zip(*truth)
    return Motion(side, np.array(stamps), np.array(q), np.array(qdot))
