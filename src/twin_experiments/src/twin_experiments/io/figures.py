"""The figures of a report.

The article's Figure 15 (paths) and 16 (joints over time), and the errors over time.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scara_config import Joint

from twin_experiments.analysis import Result
from twin_experiments.metrics.errors import Comparison
from twin_experiments.metrics.series import Array, Motion

BLUE, ORANGE, GREY, RED = "#1667c2", "#ff9a1f", "#6b7280", "#c81e3a"
PAUSE_GREY = "#9ca3af"
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
MOST_POINTS = 6000
MM = 1e3


def draw(
    result: Result,
    joints: list[Joint],
    positions: Mapping[str, Array],
    reach_mm: float,
    path_limit_percent: float,
    folder: Path,
) -> dict[str, Path]:
    """Draw all figures of one experiment that could be compared.

    Returns:
        Kind of figure (paths, joints, errors) to PNG file.
    """
    if result.comparison is None or result.motions is None:
        return {}
    name = result.span.label.replace(" #", "_")
    with mpl.rc_context(STYLE):
        figures = {
            "paths": _paths(result.comparison, positions),
            "joints": _joints(result.motions, joints, result.span.start),
            "errors": _errors(result, reach_mm, path_limit_percent),
        }
        written = {}
        for kind, figure in figures.items():
            written[kind] = folder / f"{name}_{kind}.png"
            figure.savefig(written[kind], dpi=130)
    return written


def thinning(length: int) -> slice:
    """Return a step that leaves at most ``MOST_POINTS`` points to draw."""
    return slice(None, None, max(1, length // MOST_POINTS))


def _paths(comparison: Comparison, positions: Mapping[str, Array]) -> Figure:
    """Figure 15: paths of both tools seen from above and from the side, with the set positions."""
    figure = Figure(figsize=(10.5, 5.2))
    axes = figure.subplots(1, 2)
    seen = comparison.trace
    middle = MM * float(np.mean([position[0] for position in positions.values()] or [0.0]))
    for axis, (across, up, title) in zip(axes, ((0, 1, "from above"), (0, 2, "from the side"))):
        for tool, line in ((seen.real_tool, REAL_LINE), (seen.twin_tool, TWIN_LINE)):
            thin = tool[thinning(len(tool))] * MM
            axis.plot(thin[:, across], thin[:, up], **line)
        for name, position in positions.items():
            place = (position[across] * MM, position[up] * MM)
            axis.plot(
                *place,
                "o",
                markersize=9,
                markerfacecolor="none",
                markeredgecolor="black",
                markeredgewidth=1.2,
            )
            outward = 1.0 if place[0] > middle else -1.0
            align: Any = "left" if outward > 0.0 else "right"
            axis.annotate(
                name,
                place,
                (9.0 * outward, 6),
                textcoords="offset points",
                fontweight="bold",
                ha=align,
            )
        axis.set(title=title, xlabel="x [mm]", ylabel="xyz"[up] + " [mm]")
        axis.set_aspect("equal", adjustable="datalim")
        axis.margins(0.14)
    if positions:
        axes[0].plot(
            [], [], "o", markerfacecolor="none", markeredgecolor="black", label="set position"
        )
    axes[0].legend(loc="best")
    return figure


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
        low, high = axis.get_ylim()
        least = 1.0  # a joint that stands still shall not show its noise as a mountain
        if high - low < least:
            axis.set_ylim(0.5 * (low + high - least), 0.5 * (low + high + least))
    axes[0].legend(**ABOVE)
    axes[-1].set_xlabel("time [s]")
    figure.align_ylabels(list(axes))
    return figure


def _errors(result: Result, reach_mm: float, path_limit_percent: float) -> Figure:
    """Distance of both tools over time with moves shaded, and the errors of the held positions."""
    assert result.comparison is not None
    comparison, start = result.comparison, result.span.start
    figure = Figure(figsize=(10.5, 5.6))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    for axis in (upper, lower):
        for move in comparison.moves:
            axis.axvspan(move.start - start, move.end - start, color="#eef2f7", linewidth=0)
        for gap in comparison.trace.aligned.gaps:
            axis.axvspan(
                gap.start - start, gap.start + gap.duration - start, color="#fde2e2", linewidth=0
            )
        for pause in result.pauses:
            left = max(pause.start, result.span.start)
            right = min(pause.end, result.span.end)
            axis.axvspan(left - start, right - start, color=PAUSE_GREY, linewidth=0)
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
    shades = "shaded: a side moves" + ("; grey: a pause" if result.pauses else "")
    upper.set(ylabel="|real - twin| [mm]", title=f"distance of the tools ({shades})")
    upper.legend(**ABOVE)
    upper.set_ylim(bottom=0.0)
    _percent_axis(upper, reach_mm)
    limit = path_limit_percent * reach_mm / 100.0
    if upper.get_ylim()[1] > limit:
        upper.axhline(limit, color=GREY, linestyle="--", linewidth=1.0)
    _positions(lower, comparison, start)
    _percent_axis(lower, reach_mm)
    lower.set_xlabel("time [s]")
    return figure


def largest_of_bins(values: Array, step: int) -> Array:
    """Thin a series to every ``step``-th place without losing its peaks."""
    padded = np.concatenate((values, np.full(-len(values) % step, values[-1])))
    return np.asarray(padded.reshape(-1, step).max(axis=1))


def _percent_axis(axis: Axes, reach_mm: float) -> None:
    """Show percent of reach on the right."""

    def to_percent(length_mm: Any) -> Any:
        return np.asarray(length_mm) * 100.0 / reach_mm

    def to_length(percent: Any) -> Any:
        return np.asarray(percent) * reach_mm / 100.0

    axis.secondary_yaxis("right", functions=(to_percent, to_length)).set_ylabel("% of reach")


def _positions(axis: Axes, comparison: Comparison, start: float) -> None:
    """Draw the three distances of each rest."""
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
    top = 1.35 * max((rest.worst_mm for rest in comparison.rests), default=1.0)
    axis.set_ylim(-0.06 * top, top)
    for middle, rest in zip(middles, comparison.rests):
        axis.text(
            middle, 0.97 * top, rest.set_position or "-", ha="center", va="top", fontweight="bold"
        )
    axis.set(ylabel="at rest [mm]", title="positioning error after 0.5 s at rest")
    axis.legend(**ABOVE)
