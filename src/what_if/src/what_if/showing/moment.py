"""The worst moment of a motion: where everything is when the first thing goes wrong.

Of a motion that nothing stands against it is the moment at which two bodies come nearest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from what_if.geometry.bodies import Body, FloatArray, Kind
from what_if.geometry.furnishing import furnished
from what_if.geometry.scene import Scene
from what_if.handling import MM, switch
from what_if.motions import Motion
from what_if.timing.leg import Leg
from what_if.timing.planning import plan
from what_if.verdict import Cause, Outcome, Reason, Verdict
from what_if.world import Part, World

SWITCHING = (Cause.DROP, Cause.GRIP)
"""What goes wrong at a switch of the suction; the moment shows what was before it."""
AN_INSTANT = 1e-6
"""Shorter than anything that happens [s]; our choice."""
AT_THE_TOOL = (Kind.NOZZLE, Kind.HELD)


@dataclass(frozen=True)
class Moment:
    """All bodies at one instant of a motion.

    Attributes:
        time: From the beginning of the motion [s].
        bodies: Everything that the motion was judged against.
        poses: Of these bodies in the base frame, shape (bodies, 4, 4), translation in [m].
        marked: Numbers of the bodies that it is about; empty: none in particular.
        place: Where to look, in the base frame [m].
    """

    time: float
    bodies: tuple[Body, ...]
    poses: FloatArray
    marked: tuple[int, ...]
    place: tuple[float, float, float]


def worst_moment(world: World, motion: Motion, verdict: Verdict) -> Moment | None:
    """Return the worst moment of a motion that was judged.

    Args:
        world: In which it begins.
        motion: What was asked for.
        verdict: What was said of it.

    Returns:
        None if it cannot be planned at all: there is no moment to show.
    """
    legs = plan(world, motion).legs
    if not legs:
        return None
    reason = verdict.reasons[0] if verdict.outcome is Outcome.REFUSED else None
    near = verdict.clearance.time_s if verdict.clearance else 0.0
    time = reason.time_s if reason else near
    before = reason is not None and reason.cause in SWITCHING
    q, parts = _at(world, legs, time - AN_INSTANT if before else time + AN_INSTANT)
    scene = furnished(world, parts)
    poses = scene.body_poses(np.array([q]))[0]
    marked = _marked(scene, poses, reason)
    return Moment(time, scene.bodies, poses, marked, _place(world, scene, poses, marked, reason))


def _at(
    world: World, legs: Sequence[Leg], time: float
) -> tuple[tuple[float, ...], tuple[Part, ...]]:
    """Return where the joints and the parts are at a time."""
    q, parts = world.q, world.parts
    for leg in legs:
        if leg.begin > time:
            break
        if leg.course is not None:
            at = min(time - leg.begin, float(leg.course.times[-1]))
            q = tuple(float(np.interp(at, leg.course.times, each)) for each in leg.course.q.T)
        if leg.grip is not None and leg.begin + leg.duration < time:
            parts = switch(world.cell, parts, q, leg.grip).parts
    return q, parts


def _marked(scene: Scene, poses: FloatArray, reason: Reason | None) -> tuple[int, ...]:
    """Return the bodies that a moment is about, that of the arm first."""
    cause = reason.cause if reason else None
    if cause in SWITCHING:
        return tuple(k for k, body in enumerate(scene.bodies) if body.kind in AT_THE_TOOL)
    if reason is not None and cause not in (Cause.COLLISION, Cause.ZONE):
        return ()
    numbers = list(range(len(scene.pairs)))
    if reason is None:
        # As for the clearance: what may touch does not count.
        numbers = np.flatnonzero(scene.never).tolist()
    if cause is Cause.ZONE:
        zones = {k for k, body in enumerate(scene.bodies) if body.kind is Kind.ZONE}
        pairs = scene.pairs
        numbers = [k for k in numbers if pairs[k].first in zones or pairs[k].second in zones]
    # The pair of these that is nearest to what is not allowed; None: there is no pair
    gaps = scene.gaps(poses[None])[0]
    scene.distances.forget()
    best, found = math.inf, None
    for number in sorted(numbers, key=lambda number: float(gaps[number])):
        # A gap is never more than the distance: behind this one no pair can be nearer.
        if gaps[number] >= best:
            break
        distance = scene.distance(0, poses, number)
        if distance < best:
            best, found = distance, number
    if found is None:
        return ()
    pair = scene.pairs[found]
    moved = scene.bodies[pair.first].kind in (Kind.ARM, *AT_THE_TOOL)
    return (pair.first, pair.second) if moved else (pair.second, pair.first)


def _place(
    world: World,
    scene: Scene,
    poses: FloatArray,
    marked: tuple[int, ...],
    reason: Reason | None,
) -> tuple[float, float, float]:
    """Return where it happens; the tool where nothing has a place."""
    if reason is not None and reason.place_mm is not None:
        x, y, z = (value * MM for value in reason.place_mm)
        return x, y, z
    # What is about two bodies and has no place of its own is their clearance.
    if len(marked) == 2:
        one, other = scene.distances.points(poses, *marked)
        middle = 0.5 * (one + other)
    else:
        tool = world.cell.robot.tool_frame
        middle = poses[next(k for k, body in enumerate(scene.bodies) if body.link == tool), :3, 3]
    x, y, z = middle.tolist()
    return x, y, z
