"""The paths of a report (the article's Figure 15), coloured by error, and their worst place."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from twin_experiments.metrics.errors import MM, Comparison, Trace
from twin_experiments.metrics.series import Array
from twin_experiments.report.charts import BLUE, ORANGE, RED

COLORS = "plasma_r"
INK = "#374151"
MOST_POINTS = 2500
LEAST_COLOR_MM = 0.1  # our choice: where nothing is further apart, the whole path has one colour
NEAR_S = 0.12  # our choice: so long before and after the worst instant is magnified
LEAST_WINDOW_MM = 2.0  # our choice: half of the magnified square, at least
WINDOW = 1.6
"""Half of the magnified square, in parts of the largest error; our choice."""
VIEWS = ((0, 1, "from above"), (0, 2, "from the side"))


def draw_paths(comparison: Comparison, positions: Mapping[str, Array]) -> Figure:
    """Draw where the real tool went, coloured by how far the twin was off at that instant.

    Args:
        comparison: Errors and tool positions.
        positions: Name of a set position to its place [m], shape ``(3,)``.
    """
    seen = comparison.trace
    figure = Figure(figsize=(10.5, 5.2))
    axes = figure.subplots(1, 2)
    tool, error = seen.real_tool * MM, seen.deviation_mm
    step = max(1, len(error) // MOST_POINTS)
    # Through a hole there is none: nobody knows the way there.
    pieces = [
        (at, min(at + step, last - 1))
        for first, last in seen.aligned.segments
        for at in range(first, last - 1, step)
    ]
    # A piece has the colour of its largest error: the end of the scale is seen on the path.
    worst = np.array([error[at : to + 1].max() for at, to in pieces])
    norm = mpl.colors.Normalize(0.0, max(float(error.max()), LEAST_COLOR_MM))
    for axis, (across, up, title) in zip(axes, VIEWS):
        points = tool[:, [across, up]]
        ways = [points[[at, to]] for at, to in pieces]
        # Starts above white: the ends of the path, where all is well, must be seen too.
        lines = LineCollection(ways, norm=norm, linewidth=3.0, cmap=COLORS)
        lines.set_array(worst)
        lines.set_capstyle("round")
        axis.add_collection(lines)
        # Mark the set positions with their names outside the path
        # Without a set position there is no mean.
        middle = MM * float(np.mean([place[0] for place in positions.values()] or [0.0]))
        for name, position in positions.items():
            place = (float(position[across] * MM), float(position[up] * MM))
            ring: dict[str, Any] = {"markerfacecolor": "none", "markeredgecolor": "black"}
            axis.plot(*place, "o", markersize=9, markeredgewidth=1.2, **ring)
            outward = 1.0 if place[0] > middle else -1.0
            align: Any = "left" if outward > 0.0 else "right"
            offset = (9.0 * outward, 6)
            axis.annotate(
                name, place, offset, textcoords="offset points", fontweight="bold", ha=align
            )
        axis.set(title=title, xlabel="x [mm]", ylabel=f"{'xyz'[up]} [mm]")
        axis.set_aspect("equal", adjustable="datalim")
        axis.margins(0.2)
    scale = mpl.cm.ScalarMappable(norm, COLORS)
    figure.colorbar(scale, ax=axes, label="tools apart [mm]", shrink=0.9, pad=0.01)
    _mark_worst(axes, seen)
    return figure


def draw_worst(comparison: Comparison) -> Figure:
    """Draw both tools around the instant at which they were furthest apart."""
    seen = comparison.trace
    worst, number = _worst(seen)
    across, up, title = VIEWS[number]
    middle, half = _window(seen)
    instants = seen.aligned.instants
    near = np.abs(instants - instants[worst]) <= NEAR_S
    figure = Figure(figsize=(5.6, 5.4))
    axis = figure.subplots()
    for name, tool, color, width in (
        ("real", seen.real_tool, BLUE, 3.0),
        ("twin", seen.twin_tool, ORANGE, 2.2),
    ):
        path = tool[near][:, [across, up]] * MM
        axis.plot(path[:, 0], path[:, 1], color=color, linewidth=width, label=name)
        place = tool[worst][[across, up]] * MM
        axis.plot(*place, "o", color=color, markersize=8, markeredgecolor="white", zorder=4)
    ends = np.array([side[worst][[across, up]] for side in (seen.real_tool, seen.twin_tool)]) * MM
    axis.plot(ends[:, 0], ends[:, 1], color=RED, linewidth=1.4, label="at the same instant")
    axis.set_xlim(middle[0] - half, middle[0] + half)
    axis.set_ylim(middle[1] - half, middle[1] + half)
    axis.set_aspect("equal", adjustable="box")
    axis.set(
        title=f"{title}: {seen.deviation_mm[worst]:.2f} mm apart",
        xlabel="x [mm]",
        ylabel=f"{'xyz'[up]} [mm]",
    )
    axis.legend(loc="best", frameon=True, framealpha=0.85)
    return figure


def _worst(seen: Trace) -> tuple[int, int]:
    """Return the instant at which the tools were furthest apart, and the view that shows it."""
    # While something moves, as the path error has it: below all others where nothing does.
    worst = int(np.argmax(np.where(seen.moving, seen.deviation_mm, -1.0)))
    between = seen.real_tool[worst] - seen.twin_tool[worst]
    return worst, 0 if abs(between[1]) >= abs(between[2]) else 1


def _window(seen: Trace) -> tuple[Array, float]:
    """Return the middle of the magnified square in its view, and half of its width [mm]."""
    worst, number = _worst(seen)
    across, up, _ = VIEWS[number]
    middle = 0.5 * (seen.real_tool[worst] + seen.twin_tool[worst])[[across, up]] * MM
    return middle, max(WINDOW * float(seen.deviation_mm[worst]), LEAST_WINDOW_MM)


def _mark_worst(axes: Any, seen: Trace) -> None:
    """Mark the magnified place so that it can be found, however small it is."""
    _, number = _worst(seen)
    middle, half = _window(seen)
    low, high = axes[number].dataLim.intervalx
    mark = max(half, 0.03 * float(high - low))
    axes[number].add_patch(
        Rectangle(
            (middle[0] - mark, middle[1] - mark),
            2.0 * mark,
            2.0 * mark,
            fill=False,
            edgecolor=INK,
            linewidth=1.4,
            zorder=5,
        )
    )
