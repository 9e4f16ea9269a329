"""The figures of a report over time: the article's Figure 16 (joints), and the errors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scara_config import Joint, Robot

from twin_experiments.metrics.errors import Comparison
from twin_experiments.metrics.series import Array, Motion
from twin_experiments.report.analysis import Result
from twin_experiments.report.paths_figure_io import draw_paths, draw_worst
from twin_experiments.report.scales import LEAST_DEVIATION, LEAST_JOINT, least_distance, spread

BLUE, ORANGE, GREY, RED = "#1667c2", "#ff9a1f", "#6b7280", "#c81e3a"
PAUSE_GREY, MOVE_BLUE, GAP_RED, NEEDLE_VIOLET = "#9ca3af", "#dbe5f0", "#fbcaca", "#a78bfa"
REAL_LINE: dict[str, Any] = {
    "color": BLUE,
    "linewidth": 3.0,
    "label": "real",
    "solid_capstyle": "round",
}
TWIN_LINE: dict[str, Any] = {"color": ORANGE, "linewidth": 1.3, "label": "twin"}
STYLE: Any = {
    "font.size": 10,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e5e7eb",
    "axes.edgecolor": "#9ca3af",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
}
ABOVE: Any = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.98), "ncols": 3, "borderaxespad": 0.1}
BANDS: dict[str, Any] = {
    "move": {"color": MOVE_BLUE, "linewidth": 0, "alpha": 0.6},
    "gap": {"color": GAP_RED, "linewidth": 0},
    "pause": {"color": PAUSE_GREY, "linewidth": 0},
    "needle": {"color": NEEDLE_VIOLET, "linewidth": 0, "alpha": 0.35},
}
MOST_POINTS = 6000


def draw(
    result: Result,
    robot: Robot,
    positions: Mapping[str, Array],
    path_limit_percent: float,
    folder: Path,
) -> dict[str, Path]:
    """Draw all figures of one experiment that could be compared.

    Returns:
        Kind of figure (errors, worst, paths, deviations, joints) to PNG file.
    """
    if result.comparison is None or result.motions is None:
        return {}
    name = result.span.label.replace(" #", "_")
    with mpl.rc_context(STYLE):
        figures = {
            "errors": _errors(result, robot.reach_mm, path_limit_percent),
            "worst": draw_worst(result.comparison),
            "paths": draw_paths(result.comparison, positions),
            "deviations": _deviations(result, robot.arm_joints),
            "joints": _joints(result.motions, robot.twin_joints, result.span.start),
        }
        written = {}
        for kind, figure in figures.items():
            written[kind] = folder / f"{name}_{kind}.png"
            figure.savefig(written[kind], dpi=130)
    return written


def thinning(length: int) -> slice:
    """Return a step that leaves at most ``MOST_POINTS`` points to draw."""
    return slice(None, None, max(1, length // MOST_POINTS))


def _joints(motions: tuple[Motion, Motion], joints: list[Joint], start: float) -> Figure:
    """Figure 16: each joint over time, in the unit that the robot's display shows."""
    figure = Figure(figsize=(10.5, 1.9 * len(joints) + 0.4))
    axes = np.atleast_1d(figure.subplots(len(joints), 1, sharex=True))
    for column, (axis, joint) in enumerate(zip(axes, joints)):
        for motion, line in zip(motions, (REAL_LINE, TWIN_LINE)):
            thin = thinning(len(motion.stamps))
            axis.plot(
                motion.stamps[thin] - start, motion.positions[thin, column] / joint.scale, **line
            )
        axis.set_ylabel(f"{joint.name}\n[{joint.unit}]")
        both = [motion.positions[:, column] / joint.scale for motion in motions]
        low, high = min(each.min() for each in both), max(each.max() for each in both)
        axis.set_ylim(*spread(float(low), float(high), LEAST_JOINT[joint.unit]))
    axes[0].legend(**ABOVE)
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(axes))
    return figure


def _deviations(result: Result, joints: list[Joint]) -> Figure:
    """Each joint's real - twin at the same instant, each on a scale of its own."""
    assert result.comparison is not None
    aligned, start = result.comparison.trace.aligned, result.span.start
    figure = Figure(figsize=(10.5, 1.6 * len(joints) + 0.4))
    axes = np.atleast_1d(figure.subplots(len(joints), 1, sharex=True))
    thin = thinning(len(aligned.instants))
    for column, (axis, joint) in enumerate(zip(axes, joints)):
        values = joint_deviation(result.comparison, column) / joint.scale
        shown = largest_of_bins(values, thin.step)
        axis.plot(aligned.instants[thin] - start, shown, color=RED, linewidth=1.1)
        axis.set_ylabel(f"{joint.name}\n[{joint.unit}]")
        low, high = float(values.min()), float(values.max())
        axis.set_ylim(*spread(low, high, LEAST_DEVIATION[joint.unit]))
        for kind, left, right in bands(result):
            if kind == "move":
                axis.axvspan(left, right, **BANDS[kind])
    axes[0].set_title("real - twin at the same instant (blue: a side moves)")
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(axes))
    return figure


def joint_deviation(comparison: Comparison, column: int) -> Array:
    """Return real - twin of one joint at the instants of the comparison, SI."""
    aligned = comparison.trace.aligned
    return aligned.real.positions[:, column] - aligned.twin.positions[:, column]


def _errors(result: Result, reach_mm: float, path_limit_percent: float) -> Figure:
    """Distance of both tools over time with moves shaded, and the errors of the held positions."""
    assert result.comparison is not None
    comparison, start = result.comparison, result.span.start
    figure = Figure(figsize=(10.5, 5.6))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for kind, left, right in bands(result):
        for axis in (upper, lower) if kind != "needle" else (upper,):
            axis.axvspan(left, right, **BANDS[kind])
    for seen, line in (
        (
            comparison.trace_after_lag,
            {"color": "#b9bfc9", "linewidth": 2.4, "label": "lag removed"},
        ),
        (comparison.trace, {"color": RED, "linewidth": 1.1, "label": "as it is"}),
    ):
        if seen is not None:
            thin = thinning(len(seen.deviation_mm))
            upper.plot(
                seen.aligned.instants[thin] - start,
                largest_of_bins(seen.deviation_mm, thin.step),
                **line,
            )
    named = {"move": "blue: a side moves", "gap": "red: samples are missing"}
    named |= {"pause": "grey: a pause", "needle": "violet: a needle"}
    found = {kind for kind, *_ in bands(result)}
    shades = ", ".join(text for kind, text in named.items() if kind in found)
    limit = path_limit_percent * reach_mm / 100.0
    allowed = f"allowed: {limit:.1f} mm, {path_limit_percent:g} % of reach"
    upper.set(ylabel="apart [mm]", title=f"distance of the tools; {allowed} ({shades})")
    upper.legend(**ABOVE)
    upper.set_ylim(0.0, max(upper.get_ylim()[1], least_distance("mm", reach_mm)))
    _percent_axis(upper, reach_mm)
    if upper.get_ylim()[1] > limit:
        upper.axhline(limit, color=GREY, linestyle="--", linewidth=1.0)
    _positions(lower, comparison, start, least_distance("mm", reach_mm))
    _percent_axis(lower, reach_mm)
    lower.set_xlabel("time [s]")
    return figure


def bands(result: Result) -> list[tuple[str, float, float]]:
    """Return what is shaded: move, gap, pause or needle, from and to [s] since the start."""
    assert result.comparison is not None
    start, end = result.span.start, result.span.end
    comparison = result.comparison
    found = [("move", move.start, move.end) for move in comparison.moves]
    found += [("gap", gap.start, gap.start + gap.duration) for gap in comparison.trace.aligned.gaps]
    found += [("pause", pause.start, pause.end) for pause in result.pauses]
    found += [("needle", needle.start, needle.end) for needle in result.needles]
    return [
        (kind, round(max(left, start) - start, 4), round(min(right, end) - start, 4))
        for kind, left, right in found
    ]


def largest_of_bins(values: Array, step: int) -> Array:
    """Thin a series to every ``step``-th place without losing its peaks, up or down."""
    padded = np.concatenate((values, np.full(-len(values) % step, values[-1])))
    bins = padded.reshape(-1, step)
    return np.asarray(bins[np.arange(len(bins)), np.abs(bins).argmax(axis=1)])


def _percent_axis(axis: Axes, reach_mm: float) -> None:
    """Show percent of reach on the right."""

    def to_percent(length_mm: Any) -> Any:
        return np.asarray(length_mm) * 100.0 / reach_mm

    def to_length(percent: Any) -> Any:
        return np.asarray(percent) * reach_mm / 100.0

    axis.secondary_yaxis("right", functions=(to_percent, to_length)).set_ylabel("% of reach")


def _positions(axis: Axes, comparison: Comparison, start: float, least: float) -> None:
    """Draw the three distances of each rest; the axis is ``least`` [mm] high."""
    series: tuple[tuple[str, str, str, list[float | None]], ...] = (
        ("real - twin", RED, "o", [rest.deviation_mm for rest in comparison.rests]),
        ("real - set", BLUE, "s", [rest.real_error_mm for rest in comparison.rests]),
        ("twin - set", ORANGE, "D", [rest.twin_error_mm for rest in comparison.rests]),
    )
    middles = [0.5 * (rest.start + rest.end) - start for rest in comparison.rests]
    beside = 0.008 * comparison.trace.aligned.span
    for offset, (label, color, marker, values) in zip((-beside, 0.0, beside), series):
        known = [
            (middle + offset, value) for middle, value in zip(middles, values) if value is not None
        ]
        axis.plot(
            *zip(*known) if known else ([], []), marker, color=color, label=label, markersize=6
        )
    top = max(1.35 * max((rest.worst_mm for rest in comparison.rests), default=1.0), least)
    axis.set_ylim(-0.06 * top, top)
    for middle, rest in zip(middles, comparison.rests):
        axis.text(
            middle, 0.97 * top, rest.set_position or "-", ha="center", va="top", fontweight="bold"
        )
    axis.set(ylabel="at rest [mm]", title="positioning error after 0.5 s at rest")
    axis.legend(**ABOVE)
