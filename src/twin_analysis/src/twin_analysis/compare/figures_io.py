"""The figures of a comparison.

They show paths, joints from the first motion on, distances over time and along the path.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from twin_experiments.metrics.tracks import Mechanism
from twin_experiments.report.figures_io import STYLE, largest_of_bins, thinning
from twin_experiments.report.scales import LEAST_JOINT, least_distance, spread

from twin_analysis.compare.differences import PairErrors
from twin_analysis.compare.document import ExperimentComparison

COLORS = ("#1667c2", "#ff9a1f", "#15803d", "#c81e3a", "#7c3aed", "#0891b2", "#a16207", "#6b7280")
SIDES: dict[str, Any] = {
    "real": {"linestyle": "-", "linewidth": 1.8},
    "twin": {"linestyle": "--", "linewidth": 1.2},
}
BELOW: Any = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.02), "frameon": False}
CAPTIONS = {
    "paths": "Paths of the tool",
    "joints": "Joints from the leader's first motion on",
    "distance": "How far real and twin are apart, over time and along the leader's path",
}


def draw_comparison(
    experiment: ExperimentComparison, mechanism: Mechanism, folder: Path
) -> dict[str, Path]:
    """Draw all figures of one experiment.

    Returns:
        Kind of figure (keys of ``CAPTIONS``) to PNG file.
    """
    if not experiment.pairs:
        return {}
    written = {}
    with mpl.rc_context(STYLE):
        figures = {
            "joints": _joints(experiment.pairs, mechanism),
            "distance": _distance(experiment.pairs, mechanism),
        }
        if mechanism.tool is not None:
            figures = {"paths": _paths(experiment.pairs, mechanism), **figures}
        for kind, figure in figures.items():
            _legend(figure, experiment.pairs, sides=kind != "distance")
            written[kind] = folder / f"{experiment.name.replace(' #', '_')}_{kind}.png"
            figure.savefig(written[kind], dpi=130, bbox_inches="tight")
    return written


def _color(number: int) -> str:
    return COLORS[number % len(COLORS)]


def _legend(figure: Figure, pairs: Sequence[PairErrors], sides: bool) -> None:
    """Put one legend below: a colour for each recording, a line style for each side."""
    handles = [
        Line2D([], [], color=_color(k), label=pair.track.label) for k, pair in enumerate(pairs)
    ]
    if sides:
        handles += [
            Line2D([], [], color="black", label=side, **style) for side, style in SIDES.items()
        ]
    figure.legend(handles=handles, ncols=min(len(handles), 6), **BELOW)


def _paths(pairs: Sequence[PairErrors], mechanism: Mechanism) -> Figure:
    """Paths of both sides of each recording, from above and from the side."""
    figure = Figure(figsize=(10.5, 5.2))
    axes = figure.subplots(1, 2)
    for number, pair in enumerate(pairs):
        for side, style in SIDES.items():
            positions = pair.track.side(side).positions
            places = mechanism.places(positions[thinning(len(positions))])
            for axis, up in zip(axes, (1, 2)):
                axis.plot(places[:, 0], places[:, up], color=_color(number), **style)
    for axis, up, title in zip(axes, (1, 2), ("from above", "from the side")):
        axis.set(title=title, xlabel="x [mm]", ylabel="xyz"[up] + " [mm]")
        axis.set_aspect("equal", adjustable="datalim")
    return figure


def _joints(pairs: Sequence[PairErrors], mechanism: Mechanism) -> Figure:
    """Each joint over time, in its border unit."""
    count = len(mechanism.names)
    figure = Figure(figsize=(10.5, 1.9 * count + 0.4))
    axes = np.atleast_1d(figure.subplots(count, 1, sharex=True))
    for number, pair in enumerate(pairs):
        for side, style in SIDES.items():
            motion = pair.track.side(side)
            thin = thinning(len(motion.stamps))
            for column, axis in enumerate(axes):
                values = motion.positions[thin, column] / mechanism.scales[column]
                axis.plot(motion.stamps[thin] - pair.begun, values, color=_color(number), **style)
    for axis, name, unit in zip(axes, mechanism.names, mechanism.units):
        axis.set_ylabel(f"{name}\n[{unit}]")
        low, high = axis.dataLim.intervaly
        axis.set_ylim(*spread(float(low), float(high), LEAST_JOINT[unit]))
    axes[-1].set_xlabel("time after the leader's first motion [s]")
    figure.align_ylabels(list(axes))
    return figure


def _distance(pairs: Sequence[PairErrors], mechanism: Mechanism) -> Figure:
    """Distance of real and twin over time, and along the path of the leader."""
    figure = Figure(figsize=(10.5, 5.6))
    upper, lower = figure.subplots(2, 1)
    for number, pair in enumerate(pairs):
        for axis, (places, distance) in ((upper, pair.over_time), (lower, pair.along_path)):
            step = thinning(len(places)).step
            axis.plot(
                places[::step],
                largest_of_bins(distance, step),
                color=_color(number),
                linewidth=1.1,
            )
    unit = mechanism.place_unit
    upper.set(ylabel=f"apart [{unit}]", xlabel="time after the leader's first motion [s]")
    lower.set(ylabel=f"apart [{unit}]", xlabel=f"way of the leader [{unit}]")
    for axis in (upper, lower):
        axis.set_ylim(0.0, max(axis.get_ylim()[1], least_distance(unit)))
    return figure
