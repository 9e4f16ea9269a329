"""The course of a whole motion at even times, without looking at bodies."""

from __future__ import annotations

import math

import numpy as np

from what_if.geometry.bodies import FloatArray
from what_if.learning.measures import longest_stand, moving_time, way_length
from what_if.learning.pairing import Prediction
from what_if.motions import Motion
from what_if.timing.planning import plan
from what_if.verdict import Verdict
from what_if.world import Cell, World

PERIOD_S = 0.01
"""As often as joint states come."""


def course_of(world: World, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Return when the joints are where if a motion begins in a world as it is.

    Args:
        world: The cell as it is.
        motion: What is asked for; one that can be planned.

    Returns:
        Times from its beginning [s], shape (m,), and joint positions, shape (m, n), SI.
    """
    legs = plan(world, motion).legs
    length = legs[-1].begin + legs[-1].duration if legs else 0.0
    times = np.linspace(0.0, length, math.ceil(length / PERIOD_S) + 1)
    q = np.tile(np.array(world.q), (len(times), 1))
    for leg in legs:
        if leg.course is None or len(leg.course.times) < 2:
            continue
        rows = times >= leg.begin
        at = times[rows] - leg.begin
        # What comes after a leg stays where it has led to, until the next one begins.
        for column, values in enumerate(leg.course.q.T):
            q[rows, column] = np.interp(at, leg.course.times, values)
    return times, q


def predict(world: World, motion: Motion, verdict: Verdict, what: str) -> Prediction | None:
    """Return what a verdict says of a motion, by the measures that are taken of it later.

    Args:
        world: The cell when it was judged.
        motion: What was asked for.
        verdict: What was said.
        what: The motion in words.

    Returns:
        None if the motion leads nowhere.
    """
    times, q = course_of(world, motion)
    time = moving_time(times, q, q[-1])
    if time <= 0.0:
        return None
    return Prediction(
        what,
        tuple(q[0].tolist()),
        tuple(q[-1].tolist()),
        float(np.abs(np.diff(q, axis=0)).max(axis=1).sum()),
        time,
        way_length(tool_points(world.cell, q)),
        tuple(1e-2 * use.effort_percent for use in verdict.joints),
        longest_stand(times, q),
    )


def tool_points(cell: Cell, q: FloatArray) -> FloatArray:
    """Return where the tool is at joint positions of shape (m, n), shape (m, 3) [m]."""
    found: FloatArray = cell.tree.poses(q)[:, cell.tree.index[cell.robot.tool_frame], :3, 3]
    return found
