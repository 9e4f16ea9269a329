"""A motion at evenly spaced times: where the joints are, how near bodies come, how fast it is.

For people who look at a motion before it is made; what a verdict rests on is in
:mod:`what_if.geometry.sweep`, which looks at the whole way and not at samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scara_control.joint_motion import JointMotion, Setpoints

from what_if.errors import WhatIfError
from what_if.geometry.bodies import FloatArray
from what_if.geometry.furnishing import furnished
from what_if.geometry.scene import Scene
from what_if.handling import switch
from what_if.motions import Motion
from what_if.timing.leg import Leg
from what_if.timing.planning import plan
from what_if.world import World

MOST = 1000
"""So many samples are answered at most; our choice: 32 kB of a message."""
STEP = 1e-4
"""Time of the finite difference that gives the tool's speed [s]; our choice."""


@dataclass(frozen=True)
class Samples:
    """A motion at m times.

    Attributes:
        way: Where the joints are and how fast, at times from its beginning.
        clearance: Smallest distance of two bodies that may not touch [m], shape (m,); infinite
            where nothing moves against anything.
        speed: Of the tool [m/s], shape (m,).
    """

    way: Setpoints
    clearance: FloatArray
    speed: FloatArray


def samples_of(world: World, motion: Motion, count: int) -> Samples | None:
    """Look at a motion that begins in a world as it is, also at one that is refused.

    Args:
        world: The cell now.
        motion: What is asked for.
        count: Number of samples, 2 to :data:`MOST`.

    Returns:
        None if the motion cannot be planned at all.

    Raises:
        WhatIfError: The count is out of range, or the question itself is wrong.
    """
    if not 2 <= count <= MOST:
        raise WhatIfError(f"samples = {count}: allowed are 0 (none) and 2 to {MOST}")
    legs = plan(world, motion).legs
    if not legs:
        return None
    times = np.linspace(0.0, legs[-1].begin + legs[-1].duration, count)
    rows = [*np.searchsorted(times, [leg.begin for leg in legs[1:]]).tolist(), count]
    q, qdot, clearance = np.empty((count, len(world.q))), np.zeros((count, len(world.q))), []
    here, parts, scene, begin = world.q, world.parts, furnished(world, world.parts), 0
    for leg, end in zip(legs, rows):
        q[begin:end], qdot[begin:end] = _along(leg, here, times[begin:end])
        clearance.append(_clearance(scene, q[begin:end]))
        if leg.way is not None:
            here = tuple(leg.way.knots[-1].tolist())
        if leg.grip is not None:
            parts = switch(world.cell, parts, here, leg.grip).parts
            scene = furnished(world, parts)
        begin = end
    names = tuple(joint.name for joint in world.cell.robot.twin_joints)
    points = tuple(
        JointMotion(tuple(a), tuple(b), (), at)
        for a, b, at in zip(q.tolist(), qdot.tolist(), times.tolist())
    )
    way = Setpoints(names, points)
    # The tool's speed: a central difference along the joints' velocities.
    tree, tool = world.cell.tree, world.cell.tree.index[world.cell.robot.tool_frame]
    ahead, behind = (tree.poses(q + step * qdot)[:, tool, :3, 3] for step in (STEP, -STEP))
    speed: FloatArray = np.linalg.norm(ahead - behind, axis=1) / (2.0 * STEP)
    return Samples(way, np.concatenate(clearance), speed)


def _along(leg: Leg, here: tuple[float, ...], times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return joint positions and velocities during a leg, shape (m, n) each."""
    course = leg.course
    if course is None:
        return np.tile(np.array(here), (len(times), 1)), np.zeros((len(times), len(here)))
    at = times - leg.begin

    def of(values: FloatArray) -> FloatArray:
        return np.stack([np.interp(at, course.times, column) for column in values.T], axis=1)

    return of(course.q), of(course.qdot)


def _clearance(scene: Scene, q: FloatArray) -> FloatArray:
    """Return the smallest distance at each position.

    The boxes around two bodies are never further apart than the bodies, so only pairs whose boxes
    are nearer than the best distance so far are measured.
    """
    poses = scene.body_poses(q)
    gaps = np.where(scene.never, scene.gaps(poses), math.inf)
    scene.distances.forget()
    found = np.full(len(q), math.inf)
    for row, order in enumerate(np.argsort(gaps, axis=1)):
        for pair in order.tolist():
            if gaps[row, pair] >= found[row]:
                break
            found[row] = min(found[row], max(scene.distance(row, poses[row], pair), 0.0))
    return found
