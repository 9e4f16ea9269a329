"""Where a person is who walks to and fro.

For trying the monitoring of speed and separation without a sensor.
"""

from __future__ import annotations

import math

Point = tuple[float, float, float]


def walked(begin: Point, end: Point, speed: float, elapsed: float) -> Point:
    """Return where somebody is who walks from ``begin`` to ``end`` and back for ever.

    Args:
        begin: Where the walk begins [m].
        end: Where it turns [m].
        speed: [m/s]; 0: stands at ``begin``.
        elapsed: Time since the start of the walk [s].
    """
    length = math.dist(begin, end)
    if length == 0.0 or speed == 0.0:
        return begin
    way = math.fmod(speed * elapsed, 2.0 * length)
    share = (way if way <= length else 2.0 * length - way) / length
    x, y, z = (a + share * (b - a) for a, b in zip(begin, end))
    return x, y, z
