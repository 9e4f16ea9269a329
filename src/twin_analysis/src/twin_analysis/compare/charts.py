"""The charts of a comparison as data, for its page and its files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from twin_experiments.metrics.tracks import Mechanism
from twin_experiments.report.charts import (
    LEAST_JOINT,
    Chart,
    chart_line,
    joint_points,
    least_distance,
    panel_of,
    rounded_up,
    thinned,
)

from twin_analysis.compare.document import ExperimentComparison

COLORS = ("#1667c2", "#ff9a1f", "#15803d", "#c81e3a", "#7c3aed", "#0891b2", "#a16207", "#6b7280")
DASHES = {"real": "solid", "twin": "dashed"}


def color_of(number: int) -> str:
    """Return the colour of a recording, counted from 0."""
    return COLORS[number % len(COLORS)]


def compared_charts(experiment: ExperimentComparison, mechanism: Mechanism) -> dict[str, Chart]:
    """Return the charts of one experiment: ``joints``, ``distance`` and ``along_path``.

    The last one only where a place of a path is known of both sides.
    """
    pairs = experiment.pairs
    if not pairs:
        return {}
    joints = [
        panel_of(
            f"{name} [{unit}]",
            [
                chart_line(
                    f"{pair.track.label}, {side}",
                    joint_points(pair.track.side(side), column, float(scale), pair.begun),
                    color_of(number),
                    1.6,
                    dash,
                )
                for number, pair in enumerate(pairs)
                for side, dash in DASHES.items()
            ],
            LEAST_JOINT[unit],
        )
        for column, (name, scale, unit) in enumerate(
            zip(mechanism.names, mechanism.scales, mechanism.units)
        )
    ]
    unit, after = mechanism.place_unit, "time after the leader's first motion [s]"
    labels = [pair.track.label for pair in pairs]
    over_time = _apart(labels, [pair.over_time for pair in pairs], unit)
    charts = {"joints": _over(after, joints), "distance": _over(after, [over_time])}
    if any(len(pair.along_path[0]) for pair in pairs):
        along_path = _apart(labels, [pair.along_path for pair in pairs], unit)
        charts["along_path"] = _over(f"way of the leader [{unit}]", [along_path])
    return charts


def _apart(labels: Sequence[str], distances: Sequence[Any], unit: str) -> dict[str, Any]:
    """Return the distances of real and twin in one panel, a line for each recording."""
    lines = [
        chart_line(label, thinned(*distance), color_of(number))
        for number, (label, distance) in enumerate(zip(labels, distances))
    ]
    highest = max(float(np.max(values, initial=0.0)) for _, values in distances)
    high = rounded_up(max(highest, least_distance(unit)))
    return {"y": f"apart [{unit}]", "low": 0.0, "high": high, "series": lines}


def _over(x: str, panels: list[dict[str, Any]]) -> Chart:
    """Return a chart from the first to the last place of all lines."""
    places = [point[0] for panel in panels for line in panel["series"] for point in line["data"]]
    return {"x": x, "from": min(places), "to": max(places), "panels": panels}
