"""The charts of a report as data: every quantity over time is chosen, thinned and scaled here once.

``web/report.js`` draws them in the page, ``figures_io.py`` as the files beside it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scara_config import Robot

from twin_experiments.metrics.errors import Comparison, Trace
from twin_experiments.metrics.series import Array, Motion
from twin_experiments.report.analysis import Result

BLUE, ORANGE, GREY, RED = "#1667c2", "#ff9a1f", "#6b7280", "#c81e3a"
BANDS = {
    "move": ("#dbe5f0", "blue: a side moves"),
    "gap": ("#fbcaca", "red: samples are missing"),
    "pause": ("#9ca3af", "grey: a pause"),
    "needle": ("#a78bfa", "violet: a needle"),
}
"""What is shaded: its colour, and what a title says of it."""
MOST_POINTS = 1500  # our choice: a pixel each on a wide screen; the file stays small
# Least heights of axes: what stands still must not show its noise as a mountain.
LEAST_JOINT = {"deg": 1.0, "mm": 1.0, "rad or m": 0.002}
"""Of a joint's axis in its border unit. Our choice: a hundred times what the robot's display
resolves; the axis of a joint that does not move then shows a straight line."""
LEAST_DEVIATION = {"deg": 0.1, "mm": 0.1}
"""Of an axis of a joint's real - twin. Our choice, as ``LEAST_DISTANCE``."""
LEAST_REACH_PERCENT = 0.02  # our choice: a tenth of what is allowed at rest
LEAST_DISTANCE = {"mm": 0.1, "rad or m": 0.001}
"""Of an axis of distances. Our choice: ten times what the robot's display resolves."""

Chart = dict[str, Any]
"""Panels, one above the other over one axis ``x`` from ``from`` to ``to``.

A panel has its axis (``y``, ``low``, ``high``), ``series`` (see :func:`chart_line`) and perhaps a
``title``, ``bands`` (from, to, colour), a ``limit``, and what is 100 % on its right
(``percent_of``).
"""


def report_charts(result: Result, robot: Robot, limit_percent: float) -> dict[str, Chart]:
    """Return an experiment's charts over time: its errors, each joint's difference, the joints.

    Empty if the experiment could not be compared.
    """
    comparison, motions = result.comparison, result.motions
    if comparison is None or motions is None:
        return {}
    aligned, start = comparison.trace.aligned, result.span.start
    since = aligned.instants - start
    apart = aligned.real.positions - aligned.twin.positions
    bands = bands_of(result, comparison)
    moves = [band for kind, band in bands if kind == "move"]
    deviations = [
        {
            **panel_of(
                f"{joint.name} [{joint.unit}]",
                [chart_line("real - twin", thinned(since, apart[:, column] / joint.scale), RED)],
                LEAST_DEVIATION[joint.unit],
            ),
            "bands": moves,
        }
        for column, joint in enumerate(robot.arm_joints)
    ]
    deviations[0]["title"] = f"real - twin at the same instant ({BANDS['move'][1]})"
    # The article's Figure 16, in the unit that the robot's display shows.
    joints = [
        panel_of(
            f"{joint.name} [{joint.unit}]",
            [
                chart_line(name, joint_points(motion, column, joint.scale, start), color, width)
                for motion, name, color, width in zip(
                    motions, ("real", "twin"), (BLUE, ORANGE), (3.5, 1.8)
                )
            ],
            LEAST_JOINT[joint.unit],
        )
        for column, joint in enumerate(robot.twin_joints)
    ]
    errors = [
        _distance(comparison, start, robot.reach_mm, limit_percent, bands),
        {
            **_rests(comparison, start, robot.reach_mm),
            # A needle is of the distance while something moves: it would hide the rests.
            "bands": [band for kind, band in bands if kind != "needle"],
        },
    ]
    # To the end of the experiment: a side that has fallen silent leaves a band there.
    times = {"x": "time [s]", "from": 0.0, "to": _four(result.span.end - start)}
    return {
        kind: {**times, "panels": panels}
        for kind, panels in (("errors", errors), ("deviations", deviations), ("joints", joints))
    }


def _distance(
    comparison: Comparison,
    start: float,
    reach_mm: float,
    limit_percent: float,
    bands: list[tuple[str, list[Any]]],
) -> dict[str, Any]:
    """Return how far the tools are apart, with all bands, and the limit where they come near it."""

    def line(name: str, seen: Trace, color: str, width: float) -> dict[str, Any]:
        points = thinned(seen.aligned.instants - start, seen.deviation_mm)
        return chart_line(name, points, color, width)

    series = [line("as it is", comparison.trace, RED, 1.5)]
    if comparison.trace_after_lag is not None:
        series.append(line("lag removed", comparison.trace_after_lag, GREY, 1.0))
    highest = float(comparison.trace.deviation_mm.max())
    high = rounded_up(max(highest, least_distance("mm", reach_mm)))
    limit = limit_percent * reach_mm / 100.0
    found = dict.fromkeys(BANDS[kind][1] for kind, _ in bands)
    return {
        "y": "apart [mm]",
        "low": 0.0,
        "high": high,
        "series": series,
        "bands": [band for _, band in bands],
        "percent_of": reach_mm,
        "title": f"distance of the tools; allowed: {limit:.1f} mm, {limit_percent:g} % of reach "
        f"({', '.join(found)})",
        # Above the axis nothing could be seen of it.
        **({"limit": _four(limit)} if limit < high else {}),
    }


def _rests(comparison: Comparison, start: float, reach_mm: float) -> dict[str, Any]:
    """Return the three distances of each rest, side by side, with the name of its set position."""
    # Beside each other, for three points at one instant would hide each other.
    rests, beside = comparison.rests, 0.008 * comparison.trace.aligned.span
    series = []
    for name, color, offset, values in (
        ("real - set", BLUE, -beside, [rest.real_error_mm for rest in rests]),
        ("real - twin", RED, 0.0, [rest.deviation_mm for rest in rests]),
        ("twin - set", ORANGE, beside, [rest.twin_error_mm for rest in rests]),
    ):
        points: list[list[Any]] = [
            [_four(0.5 * (rest.start + rest.end) - start + offset), _four(value)]
            + ([rest.set_position or "-"] if name == "real - twin" else [])
            for rest, value in zip(rests, values)
            if value is not None
        ]
        series.append({**chart_line(name, points, color), "points": True})
    top = max(
        1.35 * max((rest.worst_mm for rest in rests), default=1.0), least_distance("mm", reach_mm)
    )
    return {
        "y": "at rest [mm]",
        "low": _four(-0.06 * top),
        "high": _four(top),
        "series": series,
        "percent_of": reach_mm,
        "title": "positioning error at rest",
    }


def bands_of(result: Result, comparison: Comparison) -> list[tuple[str, list[Any]]]:
    """Return what is shaded: its kind, and from and to [s] since the start with a colour."""
    start, end = result.span.start, result.span.end
    found = [("move", move.start, move.end) for move in comparison.moves]
    found += [("gap", gap.start, gap.start + gap.duration) for gap in comparison.trace.aligned.gaps]
    found += [("pause", pause.start, pause.end) for pause in result.pauses]
    found += [("needle", needle.start, needle.end) for needle in result.needles]
    return [
        (kind, [_four(max(left, start) - start), _four(min(right, end) - start), BANDS[kind][0]])
        for kind, left, right in found
    ]


def panel_of(name: str, lines: list[dict[str, Any]], least: float) -> dict[str, Any]:
    """Return a panel that holds its lines with a margin, and at least ``least`` of their unit."""
    values = np.array([point[1] for line in lines for point in line["data"]])
    low, high = float(values.min()), float(values.max())
    margin = max(0.06 * (high - low), 0.5 * (least - (high - low)))
    return {"y": name, "low": _four(low - margin), "high": _four(high + margin), "series": lines}


def chart_line(
    name: str, data: list[list[Any]], color: str, width: float = 1.3, dash: str = "solid"
) -> dict[str, Any]:
    """Return a line of points (x, value), perhaps with a name; ``width`` [px]."""
    return {"name": name, "data": data, "color": color, "width": width, "dash": dash}


def thinned(places: Array, values: Array) -> list[list[float]]:
    """Return points, few enough to send; no peak is lost, up or down."""
    step = max(1, -(-len(places) // MOST_POINTS))
    # The last value fills the last bin up.
    padded = np.concatenate((values, np.repeat(values[-1:], -len(values) % step)))
    bins = padded.reshape(-1, step)
    peaks = bins[np.arange(len(bins)), np.abs(bins).argmax(axis=1)]
    return [[_four(x), _four(y)] for x, y in zip(places[::step], peaks)]


def joint_points(motion: Motion, column: int, scale: float, start: float) -> list[list[float]]:
    """Return a joint's position over the time after ``start`` [s], in the joint's unit."""
    step = max(1, -(-len(motion.stamps) // MOST_POINTS))
    part = slice(None, None, step)
    values = motion.positions[part, column] / scale
    return [[_four(x - start), _four(y)] for x, y in zip(motion.stamps[part], values)]


def least_distance(unit: str, reach_mm: float = 0.0) -> float:
    """Return the least height of an axis of distances in ``unit``."""
    least = LEAST_DISTANCE[unit]
    return max(least, LEAST_REACH_PERCENT * reach_mm / 100.0) if unit == "mm" else least


def rounded_up(value: float) -> float:
    """Return a round value that leaves a little room above ``value``."""
    power = 10.0 ** np.floor(np.log10(value))
    return _four(float(np.ceil(10.5 * value / power) * power / 10.0))


def _four(value: float) -> float:
    return round(float(value), 4)
