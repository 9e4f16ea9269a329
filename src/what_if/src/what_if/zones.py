"""Where on a way a watched point enters a keep-out zone, by the twin controller's own rule."""

from __future__ import annotations

from collections.abc import Sequence

from scara_config import KeepOut
from scara_control.keep_out.points import WatchedPoint
from scara_control.keep_out.zones import free_part, heads_into, widened

from what_if.geometry.way import Way


def first_zone(
    points: Sequence[WatchedPoint], zone: KeepOut, way: Way, margin_mm: float
) -> tuple[str, float] | None:
    """Return why a way is refused by a zone, in words, and the place on the way.

    Args:
        points: What may not enter it.
        zone: The zone.
        way: The way of the joints.
        margin_mm: How far the way has to stay away.

    Returns:
        None if the way keeps away.
    """
    rows = [tuple(row) for row in way.knots.tolist()]
    if len(rows) < 2:
        return None
    wide = widened((zone,), margin_mm)
    # The zone itself first: of a way that enters it nobody shall hear that it comes too near.
    for zones, does in (((zone,), "enter"), (wide, f"come nearer than {margin_mm:g} mm to")):
        text = heads_into(points, zones, *rows)
        if text:
            # The first straight piece whose end makes the way one that is refused
            piece, high = 0, len(rows) - 1
            while high - piece > 1:
                middle = (piece + high) // 2
                if heads_into(points, zones, *rows[: middle + 1]):
                    high = middle
                else:
                    piece = middle
            part = free_part(points, zones, rows[piece], rows[piece + 1])
            return text.replace("would enter", f"would {does}"), piece + part
    return None
