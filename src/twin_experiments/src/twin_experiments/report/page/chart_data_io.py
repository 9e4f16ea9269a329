"""The figures over time of a report as data, for the charts in its page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scara_config import Joint

from twin_experiments.metrics.errors import Trace
from twin_experiments.metrics.series import Array, Motion
from twin_experiments.report.analysis import Result
from twin_experiments.report.figures_io import (
    BLUE,
    GAP_RED,
    GREY,
    MOVE_BLUE,
    NEEDLE_VIOLET,
    ORANGE,
    PAUSE_GREY,
    RED,
    bands,
    joint_deviation,
    largest_of_bins,
)
from twin_experiments.report.scales import LEAST_DEVIATION, LEAST_JOINT, least_distance, spread

MOST_POINTS = 1500  # our choice: a pixel each on a wide screen; the file stays small
Chart = dict[str, Any]
BAND_COLORS = {
    "move": MOVE_BLUE,
    "gap": GAP_RED,
    "pause": PAUSE_GREY,
    "needle": NEEDLE_VIOLET,
}


def errors_chart(result: Result, reach_mm: float, limit_mm: float) -> Chart | None:
    """Return the tools' distance over time with bands and limit; None without a comparison."""
    if result.comparison is None:
        return None
    comparison, start = result.comparison, result.span.start
    series = [chart_line("as it is", _distance(comparison.trace, start), RED, 1.5)]
    if comparison.trace_after_lag is not None:
        removed = _distance(comparison.trace_after_lag, start)
        series.append(chart_line("lag removed", removed, GREY, 1.0))
    high = max(float(comparison.trace.deviation_mm.max()), least_distance("mm", reach_mm))
    told = [[*place, BAND_COLORS[kind]] for kind, *place in bands(result)]
    high = rounded_up(high)
    panel = {"y": "apart [mm]", "low": 0.0, "high": high, "series": series, "bands": told}
    if limit_mm < high:
        panel["limit"] = _four(limit_mm)
    return {"x": "time [s]", "from": 0.0, "to": _end(comparison.trace, start), "panels": [panel]}


def deviations_chart(result: Result, joints: Sequence[Joint]) -> Chart | None:
    """Return each joint's real - twin over time, with moves; None without a comparison."""
    if result.comparison is None:
        return None
    seen, start = result.comparison.trace, result.span.start
    moves = [[*place, MOVE_BLUE] for kind, *place in bands(result) if kind == "move"]
    panels = []
    for column, joint in enumerate(joints):
        values = joint_deviation(result.comparison, column) / joint.scale
        line = chart_line("real - twin", thinned(seen.aligned.instants - start, values), RED, 1.3)
        panel = panel_of(f"{joint.name} [{joint.unit}]", [line], LEAST_DEVIATION[joint.unit])
        panels.append({**panel, "bands": moves})
    return {"x": "time [s]", "from": 0.0, "to": _end(seen, start), "panels": panels}


def joints_chart(result: Result, joints: Sequence[Joint]) -> Chart | None:
    """Return each joint of both sides over time; None without a comparison."""
    if result.motions is None or result.comparison is None:
        return None
    start = result.span.start
    panels = []
    for column, joint in enumerate(joints):
        lines = [
            chart_line(name, joint_points(motion, column, joint.scale, start), color, width)
            for motion, name, color, width in zip(
                result.motions, ("real", "twin"), (BLUE, ORANGE), (3.5, 1.8)
            )
        ]
        panels.append(panel_of(f"{joint.name} [{joint.unit}]", lines, LEAST_JOINT[joint.unit]))
    end = _end(result.comparison.trace, start)
    return {"x": "time [s]", "from": 0.0, "to": end, "panels": panels}


def panel_of(name: str, lines: list[dict[str, Any]], least: float) -> dict[str, Any]:
    """Return a panel that holds its lines, and at least ``least`` of their unit."""
    values = np.array([point[1] for line in lines for point in line["data"]])
    low, high = spread(float(values.min()), float(values.max()), least)
    return {"y": name, "low": _four(low), "high": _four(high), "series": lines}


def chart_line(name: str, data: list[list[float]], color: str, width: float) -> dict[str, Any]:
    """Return a line; ``data``: points (time [s], value)."""
    return {"name": name, "data": data, "color": color, "width": width}


def _distance(seen: Trace, start: float) -> list[list[float]]:
    return thinned(seen.aligned.instants - start, seen.deviation_mm)


def thinned(places: Array, values: Array) -> list[list[float]]:
    """Return points, few enough to send; no peak is lost."""
    step = max(1, -(-len(places) // MOST_POINTS))
    peaks = largest_of_bins(values, step) if len(values) else values
    return [[_four(x), _four(y)] for x, y in zip(places[::step], peaks)]


def joint_points(motion: Motion, column: int, scale: float, start: float) -> list[list[float]]:
    """Return a joint's position over the time after ``start`` [s], in the joint's unit."""
    step = max(1, -(-len(motion.stamps) // MOST_POINTS))
    part = slice(None, None, step)
    values = motion.positions[part, column] / scale
    return [[_four(x - start), _four(y)] for x, y in zip(motion.stamps[part], values)]


def _end(seen: Trace, start: float) -> float:
    return _four(float(seen.aligned.instants[-1]) - start)


def rounded_up(value: float) -> float:
    """Return a round value that leaves a little room above ``value``."""
    power = 10.0 ** np.floor(np.log10(value))
    return _four(float(np.ceil(10.5 * value / power) * power / 10.0))


def _four(value: float) -> float:
    return round(float(value), 4)
