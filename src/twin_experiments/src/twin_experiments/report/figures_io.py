"""The figures of a report as files: the charts of its page, and the paths."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from twin_experiments.report.charts import BANDS, GREY, Chart

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
FAINT = {BANDS["move"][0]: 0.6, BANDS["needle"][0]: 0.35}
"""How strong the bands are that lie behind a line; the others mark what is not to be trusted."""
HEIGHTS = {"only": 3.4, "first": 2.6, "other": 1.8}
"""Of panels [in], about as in the page."""
POINTS = 0.75  # of a CSS pixel


def write_figures(
    figures: Mapping[str, Callable[[], Figure]], folder: Path, name: str
) -> dict[str, Path]:
    """Draw the figures of one experiment into ``folder``; return their kinds and PNG files."""
    written = {}
    # Ticks are made when a figure is written: the style must hold until then.
    with mpl.rc_context(STYLE):
        for kind, draw in figures.items():
            written[kind] = folder / f"{name.replace(' #', '_')}_{kind}.png"
            draw().savefig(written[kind], dpi=130)
    return written


def draw_chart(chart: Chart) -> Figure:
    """Draw the panels of a chart one above the other."""
    panels = chart["panels"]
    heights = [HEIGHTS["first"], *[HEIGHTS["other"]] * (len(panels) - 1)]
    if len(panels) == 1:
        heights = [HEIGHTS["only"]]
    figure = Figure(figsize=(10.5, sum(heights) + 0.9))
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for axis, panel in zip(axes, panels):
        for left, right, color in panel.get("bands", ()):
            axis.axvspan(left, right, color=color, linewidth=0, alpha=FAINT.get(color))
        for line in panel["series"]:
            _draw_line(axis, line)
        axis.set(ylim=(panel["low"], panel["high"]), ylabel=panel["y"])
        axis.set_title(panel.get("title", ""))
        if "limit" in panel:
            axis.axhline(panel["limit"], color=GREY, linestyle="--", linewidth=1.0)
        if "percent_of" in panel:
            whole = panel["percent_of"] / 100.0
            # As defaults: a lambda would find the last panel's value when it is called.
            functions = (lambda y, whole=whole: y / whole, lambda y, whole=whole: y * whole)
            axis.secondary_yaxis("right", functions=functions).set_ylabel("% of reach")
    axes[-1].set(xlim=(chart["from"], chart["to"]), xlabel=chart["x"])
    figure.align_ylabels(list(axes))
    # Each name once: the panels of a chart show the same lines of several joints.
    named = {line.get_label(): line for axis in axes for line in axis.get_lines()}
    # To matplotlib a line without a label is called _child and a number.
    shown = {name: line for name, line in named.items() if not str(name).startswith("_")}
    figure.legend(shown.values(), shown.keys(), loc="outside upper right", ncols=min(len(shown), 6))
    return figure


def _draw_line(axis: Axes, line: Mapping[str, Any]) -> None:
    """Draw a line, or the points that stand for themselves, with the names of points."""
    style: dict[str, Any] = {"linewidth": POINTS * line["width"], "linestyle": line["dash"]}
    if line.get("points"):
        style = {"linestyle": "none", "marker": "o"}
    points = [point[:2] for point in line["data"]]
    axis.plot(
        *zip(*points) if points else ([], []), color=line["color"], label=line["name"], **style
    )
    for x, y, *name in line["data"]:
        if name:
            axis.annotate(
                name[0], (x, y), (0, 7), textcoords="offset points", ha="center", fontweight="bold"
            )
