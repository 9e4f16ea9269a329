"""How far a point of the arm can move at most, known without following its way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scara_config import KeepOut

from scara_control.kinematics.screws import Point, ScrewModel, tool_position

PARALLEL = 1e-9
ROUNDING = 1e-6
"""More than what is lost in the sums [m]."""


def largest_rates(model: ScrewModel) -> tuple[Point, ...] | None:
    """Return how far the tool moves at most along x, y and z for each unit of a joint, in any pose.

    About one axis a point moves on a circle, whose radius is at most the sum of the distances from
    axis to axis. Where all axes are parallel, as a SCARA's are, it also keeps its place along them.

    Args:
        model: The chain.

    Returns:
        For each joint, base to tool: [m/rad], prismatic [m/m]; None for chains with a slide across
        an axis, whose radii change.
    """
    turning = [turns for turns, _, _ in model.plain_screws]
    axes = np.array([omega if turns else v for turns, omega, v in model.plain_screws])
    parallel = bool(np.all(np.linalg.norm(np.cross(axes, axes[0]), axis=1) <= PARALLEL))
    if not parallel and not all(turning):
        return None
    across = np.sqrt(np.clip(1.0 - axes[0] ** 2, 0.0, 1.0)) if parallel else np.ones(3)
    place, radius = np.array(model.home_origin), 0.0
    rates = []
    for (turns, omega, v), axis in zip(reversed(model.plain_screws), axes[::-1]):
        if not turns:
            rates.append(np.abs(axis))
            continue
        on_axis = np.cross(omega, v)
        nearest = on_axis + np.array(omega) * (omega @ (place - on_axis))
        radius += float(np.linalg.norm(place - nearest))
        place = nearest
        rates.append(radius * across)
    found = np.array(rates[::-1]).tolist()
    return tuple((x, y, z) for x, y, z in found)


def may_reach(
    model: ScrewModel,
    rates: Sequence[Point],
    start: Sequence[float],
    turned: Sequence[float],
    zones: Sequence[KeepOut],
    half: Point,
) -> bool:
    """Return whether the tool may come into a zone; False is certain.

    Args:
        model: The chain.
        rates: See :func:`largest_rates`.
        start: Joint positions where the way begins, base to tool, SI.
        turned: How far each joint moves in all, to and fro, SI.
        zones: Boxes in the base frame.
        half: Half edges of the box around the tool [m].
    """
    reach = [ROUNDING + edge for edge in half]
    for way, rate in zip(turned, rates):
        for k in range(3):
            reach[k] += way * rate[k]
    place = tool_position(model, start)
    if not math.isfinite(sum((*place, *reach))):
        return True
    low = [(x - far) * 1e3 for x, far in zip(place, reach)]
    high = [(x + far) * 1e3 for x, far in zip(place, reach)]
    return any(
        all(map(float.__le__, low, zone.upper_mm)) and all(map(float.__ge__, high, zone.lower_mm))
        for zone in zones
    )
