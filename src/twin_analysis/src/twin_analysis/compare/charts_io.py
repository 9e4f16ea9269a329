"""The charts of a comparison as data, for its page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from twin_experiments.metrics.tracks import Mechanism
from twin_experiments.report.page.chart_data_io import (
    Chart,
    chart_line,
    joint_points,
    panel_of,
    rounded_up,
    thinned,
)
from twin_experiments.report.scales import LEAST_JOINT, least_distance

from twin_analysis.compare.document import ExperimentComparison


def compared_charts(
    experiment: ExperimentComparison, mechanism: Mechanism, colors: Sequence[str]
) -> dict[str, Chart]:
    """Return the charts of one experiment of a comparison: ``joints`` and ``distance``."""
    pairs = experiment.pairs
    if not pairs:
        return {}
    panels = []
    for column, (name, scale, unit) in enumerate(
        zip(mechanism.names, mechanism.scales, mechanism.units)
    ):
        lines = [
            {
                **chart_line(
                    f"{pair.track.label}, {side}",
                    joint_points(pair.track.side(side), column, float(scale), pair.begun),
                    colors[number % len(colors)],
                    1.6,
                ),
                "dash": "solid" if side == "real" else "dashed",
            }
            for number, pair in enumerate(pairs)
            for side in ("real", "twin")
        ]
        panels.append(panel_of(f"{name} [{unit}]", lines, LEAST_JOINT[unit]))
    unit = mechanism.place_unit
    lines = [
        chart_line(pair.track.label, thinned(*pair.over_time), colors[number % len(colors)], 1.3)
        for number, pair in enumerate(pairs)
    ]
    highest = max(float(np.max(pair.over_time[1], initial=0.0)) for pair in pairs)
    high = rounded_up(max(highest, least_distance(unit)))
    distance = {"y": f"apart [{unit}]", "low": 0.0, "high": high, "series": lines}
    x = "time after the leader's first motion [s]"
    return {
        "joints": {**_times(panels), "x": x, "panels": panels},
        "distance": {**_times([distance]), "x": x, "panels": [distance]},
    }


def _times(panels: Sequence[dict[str, Any]]) -> dict[str, float]:
    """Return the first and the last time of all lines."""
    times = [point[0] for panel in panels for line in panel["series"] for point in line["data"]]
    return {"from": min(times), "to": max(times)}
