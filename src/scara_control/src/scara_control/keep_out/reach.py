"""How far a point of the arm can move at most, known without following its way."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scara_config import KeepOut

from scara_control.kinematics.screws import Point, ScrewModel, nearest_on_axis, tool_position

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
        an axis, whose radii change; a slide that carries all that turns, as a rail, changes none.
    """
    turning = [turns for turns, _, _ in model.plain_screws]
    axes = np.array([omega if turns else v for turns, omega, v in model.plain_screws])
    parallel = bool(np.all(np.linalg.norm(np.cross(axes, axes[0]), axis=1) <= PARALLEL))
    rail = turning == sorted(turning)
    if not parallel and not rail:
        return None
    # A circle about an axis is as wide along x, y or z as the sine of the angle between both.
    across = np.sqrt(np.clip(1.0 - axes[0] ** 2, 0.0, 1.0)) if parallel else np.ones(3)
    place, radius = np.array(model.home_origin), 0.0
    rates = []
    for (turns, omega, v), axis in zip(reversed(model.plain_screws), axes[::-1]):
        if not turns:
            rates.append(np.abs(axis))
            continue
        nearest = nearest_on_axis(omega, v, place)
        # The point is farthest from an axis when all that is between them is stretched out.
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
    # In plain numbers: each point of the arm asks for it with each sample.
    far_x, far_y, far_z = half
    far_x, far_y, far_z = ROUNDING + far_x, ROUNDING + far_y, ROUNDING + far_z
    for way, (rate_x, rate_y, rate_z) in zip(turned, rates):
        far_x += way * rate_x
        far_y += way * rate_y
        far_z += way * rate_z
    x, y, z = tool_position(model, start)
    # NaN compares as false with everything below, and that would mean: certainly outside.
    if not math.isfinite(x + y + z + far_x + far_y + far_z):
        return True
    for zone in zones:
        (low_x, low_y, low_z), (high_x, high_y, high_z) = zone.lower_mm, zone.upper_mm
        if (
            (x - far_x) * 1e3 <= high_x
            and (y - far_y) * 1e3 <= high_y
            and (z - far_z) * 1e3 <= high_z
            and (x + far_x) * 1e3 >= low_x
            and (y + far_y) * 1e3 >= low_y
            and (z + far_z) * 1e3 >= low_z
        ):
            return True
    return False
