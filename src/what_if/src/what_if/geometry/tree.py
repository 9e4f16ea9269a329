"""The tree of joints: where all links are in many poses at once, and how far points can get."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from scara_description.urdf import JointFrame, Model, link_pose, origin_transform
from what_if.geometry.bodies import Body, FloatArray

# Least cosine of the angle between two axes that count as parallel.
PARALLEL = 1.0 - 1e-9


class Tree:
    """Forward kinematics of all links of a robot description.

    Args:
        model: The description.
        joints: Names of the moving joints in the order of every joint vector, (n,).
        strokes: Of each joint the larger amount of its two limits [rad] or [m].
    """

    def __init__(self, model: Model, joints: Sequence[str], strokes: Sequence[float]) -> None:
        self.model, self.joints = model, tuple(joints)
        self._strokes = dict(zip(joints, strokes))
        self._reaches: dict[object, FloatArray] = {}
        self.links = (model.root, *(joint.child for joint in model.joints))
        self.index = {link: k for k, link in enumerate(self.links)}
        self._steps = [
            (
                self.index[joint.parent],
                self.index[joint.child],
                origin_transform(joint.xyz, joint.rpy),
                self.joints.index(joint.name) if joint.moves else -1,
                joint,
            )
            for joint in model.joints
        ]

    def poses(self, q: FloatArray) -> FloatArray:
        """Return the poses of all links in the root.

        Args:
            q: Joint positions, shape (m, n): [rad], prismatic [m].

        Returns:
            Homogeneous transforms, shape (m, links, 4, 4), translation in [m].
        """
        found = np.empty((len(q), len(self.links), 4, 4))
        found[:, 0] = np.eye(4)
        for parent, child, origin, column, joint in self._steps:
            at = found[:, parent] @ origin
            found[:, child] = at if column < 0 else at @ _moved(joint, q[:, column])
        return found

    @cached_property
    def movers(self) -> dict[str, frozenset[int]]:
        """Of each link the columns of the joints that move it."""
        return {
            link: frozenset(
                self.joints.index(joint.name) for joint in self.model.chain(link) if joint.moves
            )
            for link in self.links
        }

    def reach(self, body: Body) -> FloatArray:
        r"""Bound how far a body's points move for each unit that a joint moves.

        A point at the distance :math:`r` from a joint's axis moves by at most :math:`r\,|\Delta q|`
        along an arc; with a prismatic joint by :math:`|\Delta q|`. The distance from the axis is at
        most the sum of the ways from joint to joint, whatever the joints between do: a turn keeps
        lengths, and a turn about a parallel axis also keeps what is perpendicular to the axis, so
        there only that part counts.

        Args:
            body: A body on a link of this tree.

        Returns:
            Bounds in [m/rad], prismatic 1, shape (n,); 0 where the joint does not move it.
        """
        key = body.link, body.shape, body.size, body.pose.tobytes()
        if key not in self._reaches:
            # The same bodies come again in each scene: parts are gripped and laid one by one.
            self._reaches[key] = self._reach(body)
        return self._reaches[key]

    def _reach(self, body: Body) -> FloatArray:
        chain = self.model.chain(body.link)
        bounds = np.zeros(len(self.joints))
        for k, joint in enumerate(chain):
            if joint.moves:
                column = self.joints.index(joint.name)
                slides = joint.kind == "prismatic"
                bounds[column] = 1.0 if slides else self._radius(joint, chain[k + 1 :], body)
        return bounds

    def _radius(self, joint: JointFrame, below: Sequence[JointFrame], body: Body) -> float:
        """Bound the distance of a body's points from the axis of a turning joint [m]."""
        axis = self._axis(joint)
        turning = [self._axis(other) for other in below if other.kind in ("revolute", "continuous")]
        flat = all(abs(float(axis @ other)) > PARALLEL for other in turning)

        def length(way: FloatArray) -> float:
            """Return what a way adds; ``way`` is taken at the zero pose, in the root's frame."""
            return float(np.linalg.norm(way - (axis @ way) * axis if flat else way))

        total, here = 0.0, self._origin(joint.child)
        for other in below:
            if other.kind == "prismatic":
                total += self._strokes[other.name] * length(self._axis(other))
            # Fixed joints and slides turn nothing: their ways add up as vectors up to the next
            # turning joint; adding lengths of each is never less.
            there = self._origin(other.child)
            total += length(there - here)
            here = there
        rotation = self._zero[body.link][:3, :3]
        corners = body.corners @ rotation.T
        return total + max(length(corner) for corner in corners)

    @cached_property
    def _zero(self) -> dict[str, FloatArray]:
        still: Mapping[str, float] = {}
        return {link: link_pose(self.model, link, still) for link in self.links}

    def _origin(self, link: str) -> FloatArray:
        return self._zero[link][:3, 3]

    def _axis(self, joint: JointFrame) -> FloatArray:
        turned: FloatArray = self._zero[joint.child][:3, :3] @ np.array(joint.axis)
        return turned


def _moved(joint: JointFrame, q: FloatArray) -> FloatArray:
    """Return what a joint adds to its origin at many positions, shape (m, 4, 4)."""
    x, y, z = joint.axis
    found = np.zeros((len(q), 4, 4))
    found[:, 3, 3] = 1.0
    if joint.kind == "prismatic":
        found[:, :3, :3] = np.eye(3)
        found[:, :3, 3] = q[:, None] * np.array(joint.axis)
        return found
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, versine = np.sin(q)[:, None, None], (1.0 - np.cos(q))[:, None, None]
    found[:, :3, :3] = np.eye(3) + sine * cross + versine * (cross @ cross)
    return found


def stroke(lower: float, upper: float) -> float:
    """Return the larger amount of two limits."""
    return max(math.fabs(lower), math.fabs(upper))
