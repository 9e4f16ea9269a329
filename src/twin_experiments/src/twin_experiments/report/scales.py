"""Least widths of a figure's axes: what stands still must not show its noise as a mountain."""

from __future__ import annotations

LEAST_JOINT = {"deg": 1.0, "mm": 1.0, "rad or m": 0.002}
"""Least height of a joint's axis in its border unit. Our choice: a hundred times what the robot's
display resolves; the axis of a joint that does not move then shows a straight line."""
LEAST_DEVIATION = {"deg": 0.1, "mm": 0.1}
"""Least height of an axis of a joint's real - twin. Our choice, as ``LEAST_DISTANCE``."""
LEAST_REACH_PERCENT = 0.02  # our choice: a tenth of what is allowed at rest
LEAST_DISTANCE = {"mm": 0.1, "rad or m": 0.001}
"""Least height of an axis of distances. Our choice: ten times what the robot's display resolves."""


def least_distance(unit: str, reach_mm: float = 0.0) -> float:
    """Return the least height of an axis of distances in ``unit``."""
    least = LEAST_DISTANCE[unit]
    return max(least, LEAST_REACH_PERCENT * reach_mm / 100.0) if unit == "mm" else least


def spread(low: float, high: float, least: float) -> tuple[float, float]:
    """Return limits that hold ``low`` and ``high``, with a margin, and are ``least`` apart."""
    margin = max(0.06 * (high - low), 0.5 * (least - (high - low)))
    return low - margin, high + margin
