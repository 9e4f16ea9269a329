"""Keep-out zones and Cartesian speed, judged on the whole way and not only at its end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import msgspec
import numpy as np
from numpy.typing import NDArray
from scara_config import KeepOut

from scara_control.keep_out.body import Place
from scara_control.keep_out.points import FloatArray, Joints, WatchedPoint, all_positions
from scara_control.keep_out.reach import may_reach

IntArray = NDArray[np.int_]
BoolArray = NDArray[np.bool_]
COARSE_STEPS = 8
MOST_STEPS = 2000
SPACING = 0.01
"""Longest chord of a point's path [m]; at 0.2 m from an axis it is 0.06 mm off the arc."""
FINER = 1.2
COARSE_TURN = 1.5
"""Most that the joints turn in a coarse step [rad], all together."""
BULGE = 0.2
"""How far an arc may bulge beyond its chord, in parts of the chord: tan(turn / 4) / 2 at most."""
STILL = 1e-12
DEPTH_TOLERANCE = 1e-3
"""A point in a zone that goes deeper by less [m] stands there."""


class WatchedMove(msgspec.Struct, frozen=True):
    """A move as the watched points see it.

    Attributes:
        target: Where it ends, SI.
        between: Joint positions on its way, as they were told; none: straight in joint space.
        violation: The zone it would enter, in words; empty if none.
        peak_speed: Largest speed of a watched point at 100 % program speed [m/s].
    """

    target: Joints = ()
    violation: str = ""
    peak_speed: float = 0.0
    between: tuple[Joints, ...] = ()


def judge_way(
    points: Sequence[WatchedPoint],
    zones: Sequence[KeepOut],
    start: Joints,
    end: Joints,
    velocity: Joints,
    margin_mm: float = 0.0,
    between: tuple[Joints, ...] = (),
) -> WatchedMove:
    r"""Judge the joint-space way from ``start`` to ``end``, straight from place to place.

    All joints start and end together, so at full program speed the slowest one sets the pace and a
    point moves at most
    :math:`\max_s |\partial p / \partial s| \, / \, \max_i (|\Delta q_i| / \dot q_{i,max})`.
    Pieces between places take the same time each, as those of a line of the tool do: the slowest
    piece sets the pace.

    Args:
        points: What is watched.
        zones: Where it may not be.
        start: Joint positions, SI.
        end: Joint positions, SI.
        velocity: Largest joint speeds, SI.
        margin_mm: How far the way has to stay away from each zone.
        between: Joint positions on the way, in order.
    """
    rows = np.array((start, *between, end))
    duration = float(np.max(np.abs(np.diff(rows, axis=0)) / np.array(velocity)))
    paths, steps = _paths(points, rows)
    counted = [not any(point.half) for point in points]
    chords = np.linalg.norm(np.diff(paths[counted], axis=1), axis=2)
    # A step takes that part of the time of its piece, so a chord counts so many times.
    longest = float(np.max(chords * np.repeat(steps, steps), initial=0.0))
    peak = longest / duration if duration > 0.0 else 0.0
    violation = _first_entered(points, paths, zones)
    # The zone itself came first: who enters it is told so, and not that it is near.
    if not violation and margin_mm > 0.0:
        nearer = f"come nearer than {margin_mm:g} mm to"
        violation = _first_entered(points, paths, widened(tuple(zones), margin_mm), nearer)
    return WatchedMove(end, violation, peak, between)


def heads_into(points: Sequence[WatchedPoint], zones: Sequence[KeepOut], *corners: Joints) -> str:
    """Return in words the zone that the way leads into, straight from corner to corner.

    As :func:`judge_way`, but quick far from zones.
    """
    rows = np.array(corners)
    near = _points_near(points, zones, rows)
    return _first_entered(near, _paths(near, rows)[0], zones) if near else ""


def stands_in(points: Sequence[WatchedPoint], zones: Sequence[KeepOut], q: Joints) -> str:
    """Return in words which point stands how deep in a zone; empty if none does."""
    places, halves = all_positions(points, np.array((q,)))[:, 0], _halves(points)
    for zone in zones:
        lower, upper = _corners(zone, halves)
        depths = np.min(np.minimum(places - lower, upper - places), axis=1)
        deepest = int(np.argmax(depths))
        if depths[deepest] > DEPTH_TOLERANCE:
            depth = f"{1e3 * depths[deepest]:.0f} mm deep in keep-out zone {zone.name}"
            return f"the {points[deepest].name} stands {depth}"
    return ""


def free_part(
    points: Sequence[WatchedPoint], zones: Sequence[KeepOut], start: Joints, end: Joints
) -> float:
    """Return the part of the straight joint-space way before a zone; 1 if it enters none.

    A way that begins in a zone is free until it comes into one from outside.
    """
    rows = np.array((start, end))
    near = _points_near(points, zones, rows)
    part = 1.0
    if not near:
        return part
    paths, halves = _paths(near, rows)[0], _halves(near)
    chords = paths.shape[1] - 1
    for zone in zones:
        close = _near(paths, [zone], halves)
        lower, upper = _corners(zone, halves[close, None])
        # From the first point outside on, of each path that has one.
        outside = np.any((paths[close] < lower) | (paths[close] > upper), axis=2)
        begins = np.where(outside.any(axis=1), outside.argmax(axis=1), chords)
        enters, hits = _chord_hits(paths[close], lower, upper)
        hits &= np.arange(chords) >= begins[:, None]
        for path in np.flatnonzero(hits.any(axis=1)).tolist():
            begin, hit = int(begins[path]), int(hits[path].argmax())
            part = min(part, (begin + (hit - begin + float(enters[path, hit]))) / chords)
    return part


# Zones and margins are the same for each move.
@lru_cache(maxsize=8)
def widened(zones: tuple[KeepOut, ...], margin_mm: float) -> tuple[KeepOut, ...]:
    """Return the zones with all faces moved outwards by ``margin_mm``."""
    return tuple(
        KeepOut(
            zone.name,
            tuple(x - margin_mm for x in zone.lower_mm),  # type: ignore[arg-type]
            tuple(x + margin_mm for x in zone.upper_mm),  # type: ignore[arg-type]
        )
        for zone in zones
    )


def _points_near(
    points: Sequence[WatchedPoint], zones: Sequence[KeepOut], rows: FloatArray
) -> list[WatchedPoint]:
    """Return the points whose way may come into a zone, by two rough looks."""
    start, turned = rows[0].tolist(), np.abs(rows[1:] - rows[:-1]).sum(axis=0).tolist()
    points = [point for point in points if point_may_reach(point, start, turned, zones)]
    if not points:
        return []
    rough = _cut(points, rows, _fewest_steps(rows))
    chords = np.abs(rough[:, 1:] - rough[:, :-1])
    reach = chords.max(axis=1) + BULGE * chords.max(axis=(1, 2))[:, None]
    reach += _halves(points)
    return [point for point, close in zip(points, _near(rough, zones, reach)) if close]


def point_may_reach(
    point: WatchedPoint, start: Joints, turned: Joints, zones: Sequence[KeepOut]
) -> bool:
    """Return whether a point may come into a zone, by how far it can move at most.

    Args:
        point: What is watched; one of which nobody knows how far it moves may be anywhere.
        start: Where the joints are, SI.
        turned: How far each joint moves from there at most, to either side, SI.
        zones: Where it may not be.
    """
    if point.rates is None:
        return bool(zones)
    here = [start[column] for column in point.columns]
    ways = [turned[column] for column in point.columns]
    return may_reach(point.model, point.rates, here, ways, zones, point.half)


def _near(paths: FloatArray, zones: Sequence[KeepOut], reach: FloatArray) -> FloatArray:
    """Return which points come as near as ``reach`` [m] to a zone, by boxes around their paths."""
    low, high = (paths.min(axis=1) - reach) * 1e3, (paths.max(axis=1) + reach) * 1e3
    overlaps = [np.all((low <= zone.upper_mm) & (high >= zone.lower_mm), axis=1) for zone in zones]
    return np.any(overlaps, axis=0) if overlaps else np.zeros(len(paths))


def _first_entered(
    points: Sequence[WatchedPoint], paths: FloatArray, zones: Sequence[KeepOut], does: str = "enter"
) -> str:
    near = zip(points, paths, _near(paths, zones, _halves(points)))
    found = (entered(p.name, path, zones, does, p.half) for p, path, close in near if close)
    return next((violation for violation in found if violation), "")


def _fewest_steps(rows: FloatArray) -> IntArray:
    """Return into how many steps each piece of a way is cut at least, all into the same number."""
    pieces = len(rows) - 1
    turned = float(np.abs(rows[1:] - rows[:-1]).sum(axis=1).max())
    # What is no number cannot be cut finer, and a target of a million turns must not take for ever.
    fine = min(MOST_STEPS, math.ceil(turned / COARSE_TURN)) if math.isfinite(turned) else 1
    return np.full(pieces, max(math.ceil(COARSE_STEPS / pieces), fine))


def _cut(points: Sequence[WatchedPoint], rows: FloatArray, steps: IntArray) -> FloatArray:
    """Return where the points pass, shape (p, sum of steps + 1, 3) [m]; ``steps`` of each piece."""
    number = np.arange(steps.sum()) - np.repeat(np.cumsum(steps) - steps, steps)
    part = (number / np.repeat(steps, steps))[:, None]
    begin = np.repeat(rows[:-1], steps, axis=0)
    between = begin + part * np.repeat(rows[1:] - rows[:-1], steps, axis=0)
    return all_positions(points, np.vstack([between, rows[-1:]]))


def _paths(points: Sequence[WatchedPoint], rows: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return where the points pass, cut so finely that chords are the path, and into how many.

    Each piece as it needs it: a way that is watched has many short ones, and a long one at its end.
    """
    steps = _fewest_steps(rows)
    while True:
        paths = _cut(points, rows, steps)
        chords = np.linalg.norm(paths[:, 1:] - paths[:, :-1], axis=2).max(axis=0, initial=0.0)
        longest = np.maximum.reduceat(chords, np.cumsum(steps) - steps)
        too_long = (longest > SPACING) & (longest < math.inf)
        if not too_long.any() or steps.sum() >= MOST_STEPS:
            return paths, steps
        wanted = np.where(too_long, FINER * steps * longest / SPACING, steps)
        # All pieces share what there is, or a long one would leave nothing for those behind it.
        steps = np.ceil(wanted * min(1.0, MOST_STEPS / wanted.sum())).astype(int)


def entered(
    name: str,
    path: FloatArray,
    zones: Sequence[KeepOut],
    does: str = "enter",
    half: Place = (0.0, 0.0, 0.0),
) -> str:
    """Return in words where a path (m, 3) [m] enters a zone (what it ``does``); empty if nowhere.

    A point that is in a zone already may leave it, but go no deeper, not in again, into no other.
    ``half`` [m] is the box around the point, of which no part may enter.
    """
    for zone in zones:
        lower, upper = _corners(zone, half)
        depth = np.min(np.minimum(path - lower, upper - path), axis=1)
        outside = np.flatnonzero(~(depth >= 0.0))
        # From the first point outside on, the path may not come in again.
        left = int(outside[0]) if outside.size else len(path)
        deeper = np.flatnonzero(
            # Against the least depth so far: who has come nearly out may not go in again.
            depth[:left] > np.minimum.accumulate(depth)[:left] + DEPTH_TOLERANCE
        )
        if deeper.size:
            place = _words(path[deeper[0]])
            return f"the {name} would go deeper into keep-out zone {zone.name} at {place}"
        hit = first_hit(path[left:], lower, upper)
        if hit is not None:
            return f"the {name} would {does} keep-out zone {zone.name} at {_words(hit)}"
    return ""


def _corners(zone: KeepOut, half: Place | FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corners of a zone, wider by the half edges of what may not touch it."""
    return np.array(zone.lower_mm) * 1e-3 - half, np.array(zone.upper_mm) * 1e-3 + half


def _halves(points: Sequence[WatchedPoint]) -> FloatArray:
    """Return the half edges of the boxes around points, shape (p, 3) [m]."""
    return np.array([point.half for point in points]).reshape(-1, 3)


def _words(place: FloatArray) -> str:
    x, y, z = place * 1e3
    return f"({x:.0f}, {y:.0f}, {z:.0f}) mm"


def first_hit(path: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray | None:
    """Return where a polyline (m, 3) first meets a box, None if nowhere.

    It cuts the line with the slabs between opposite faces.

    Args:
        path: Corners of the polyline [m].
        lower: Smallest corner of the box [m].
        upper: Largest corner of the box [m].
    """
    enters, meets = _chord_hits(path, lower, upper)
    hits = np.flatnonzero(meets)
    if not hits.size:
        return None
    at = float(hits[0] + enters[hits[0]])
    k = min(int(at), len(path) - 2)
    return np.asarray(path[k] + (at - k) * (path[k + 1] - path[k]))


def _chord_hits(
    paths: FloatArray, lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the part of each chord before it meets the box, and whether it does.

    Args:
        paths: Corners of the polylines [m], shape (..., m, 3).
        lower: Smallest corners of the boxes [m], shape (..., 1, 3), or (3,) for one polyline.
        upper: Largest corners, likewise.
    """
    begin, way = paths[..., :-1, :], paths[..., 1:, :] - paths[..., :-1, :]
    # A chord along a face never crosses it: it lies between both faces all the time, or never.
    still = np.abs(way) < STILL
    between = (begin >= lower) & (begin <= upper)
    rate = np.where(still, 1.0, way)
    one, other = (lower - begin) / rate, (upper - begin) / rate
    enters = np.where(still, np.where(between, -np.inf, np.inf), np.minimum(one, other)).max(
        axis=-1, initial=0.0
    )
    leaves = np.where(still, np.where(between, np.inf, -np.inf), np.maximum(one, other)).min(
        axis=-1, initial=1.0
    )
    return enters, enters <= leaves
