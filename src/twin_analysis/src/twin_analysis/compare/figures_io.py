"""The paths of a comparison."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from twin_experiments.metrics.tracks import Mechanism

from twin_analysis.compare.charts import DASHES, color_of
from twin_analysis.compare.differences import PairDeviation

WIDTHS = {"real": 1.8, "twin": 1.2}
MOST_POINTS = 6000


def draw_paths(pairs: Sequence[PairDeviation], mechanism: Mechanism) -> Figure:
    """Draw the paths of both sides of each recording, from above and from the side."""
    figure = Figure(figsize=(10.5, 5.2))
    axes = figure.subplots(1, 2)
    styles: dict[str, Any] = {
        side: {"linestyle": dash, "linewidth": WIDTHS[side]} for side, dash in DASHES.items()
    }
    for number, pair in enumerate(pairs):
        for side, style in styles.items():
            positions = pair.track.side(side).positions
            places = mechanism.places(positions[:: max(1, len(positions) // MOST_POINTS)])
            for axis, up in zip(axes, (1, 2)):
                axis.plot(places[:, 0], places[:, up], color=color_of(number), **style)
    for axis, up, title in zip(axes, (1, 2), ("from above", "from the side")):
        axis.set(title=title, xlabel="x [mm]", ylabel="xyz"[up] + " [mm]")
        axis.set_aspect("equal", adjustable="datalim")
    # A colour for each recording, a line style for each side.
    handles = [
        Line2D([], [], color=color_of(number), label=pair.track.label)
        for number, pair in enumerate(pairs)
    ]
    handles += [Line2D([], [], color="black", label=side, **styles[side]) for side in styles]
    figure.legend(handles=handles, ncols=min(len(handles), 6), loc="outside lower center")
    return figure
