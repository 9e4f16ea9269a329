"""Where an arm comes into no zone, and hits neither itself nor what stands around.

Zones by the twin controller's rule, bodies by the second world's: what these refuse a new robot
shall not be made to do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scara_config import Robot
from scara_control.keep_out.points import WatchedPoint, watched_points
from scara_control.keep_out.zones import judge_way
from scara_control.kinematics.twists import FloatArray
from what_if.geometry.bodies import bodies_of
from what_if.geometry.scene import Press, Scene
from what_if.geometry.tree import Tree, stroke

from scara_description.urdf import Model

CLEAR_MM = 20.0
"""How far the ways stay away from the zone; the twin controller refuses those nearer than 5 mm."""
APART_M = 0.005
"""How far bodies stay apart."""
STEPS = 24
"""Poses of a way at which bodies are looked at: our choice, the second world judges all of it."""


class FreeSpace:
    """An arm among its zones and bodies.

    Args:
        robot: The profile.
        model: Its URDF with the shapes that collide.
    """

    def __init__(self, robot: Robot, model: Model) -> None:
        joints = robot.twin_joints
        tree = Tree(
            model,
            [joint.name for joint in joints],
            [stroke(joint.lower, joint.upper) for joint in joints],
        )
        self._scene = Scene(tree, bodies_of(model, robot.tool_frame, ()), Press())
        self.points, self._robot = watched_points(robot), robot

    def touches_nothing(self, rows: FloatArray) -> bool:
        """Return whether bodies are apart in all poses, shape (m, n)."""
        # Poses are numbered anew with each call, and the numbers tell what stands there already.
        self._scene.distances.forget()
        poses = self._scene.body_poses(rows)
        # Boxes around the bodies first: what they keep apart needs no exact distance.
        near = np.argwhere(self._scene.gaps(poses) < APART_M)
        return all(self._scene.distance(k, poses[k], n) >= APART_M for k, n in near.tolist())

    def has_way(self, one: Sequence[float], other: Sequence[float]) -> bool:
        """Return whether the straight way between two poses is free, and both of them."""
        velocity = tuple(joint.velocity for joint in self._robot.twin_joints)
        zones = self._robot.keep_out
        judged = judge_way(self.points, zones, tuple(one), tuple(other), velocity, CLEAR_MM)
        rows = np.linspace(np.array(one), np.array(other), STEPS)
        return not judged.violation and self.touches_nothing(rows)


def moved(q: tuple[float, ...], index: int, way: float) -> tuple[float, ...]:
    """Return positions in which one joint stands ``way`` farther [rad or m]."""
    return (*q[:index], q[index] + way, *q[index + 1 :])


def free_way(
    robot: Robot,
    points: Sequence[WatchedPoint],
    start: tuple[float, ...],
    index: int,
    sizes: Mapping[str, float],
) -> tuple[float, str]:
    """Return a joint's way from its nearer limit, or else the other one [rad or m].

    Neither enters a keep-out zone or comes near one; else 0, and why the first would.

    Args:
        robot: The profile.
        points: Its watched points; not needed where it has no zone.
        start: Positions of the twin's joints [rad or m].
        index: Of the joint among them.
        sizes: How long the way is, by the joint's unit [deg or mm].
    """
    joint, velocity = robot.twin_joints[index], tuple(each.velocity for each in robot.twin_joints)
    way, reasons = sizes[joint.unit] * joint.scale, []
    if start[index] >= 0.5 * (joint.lower + joint.upper):
        way = -way
    for each in (way, -way):
        away, why = moved(start, index, each), ""
        if not joint.lower <= away[index] <= joint.upper:
            why = "it would leave its range"
        elif robot.keep_out:
            why = judge_way(points, robot.keep_out, start, away, velocity, CLEAR_MM).violation
        if not why:
            return each, ""
        reasons.append(why)
    return 0.0, reasons[0]
