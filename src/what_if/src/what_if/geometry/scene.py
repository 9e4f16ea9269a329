"""All bodies, the pairs that are watched, and their distances at chosen places of a way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from what_if.geometry.bodies import Body, FloatArray, Kind, half_extents
from what_if.geometry.distances import Distances
from what_if.geometry.pairs import Pair, Touching, pair_bounds, watched_pairs
from what_if.geometry.tree import Tree


@dataclass(frozen=True)
class Press:
    """How far what may touch may be pressed.

    Attributes:
        offset: The nozzle's middle may be so far from the part's [m].
        give: The bellows give way so far [m].
        lay: A held part may be so far below the top of a rest [m].
    """

    offset: float = 0.0
    give: float = 0.0
    lay: float = 0.0


class Scene:
    """Bodies on links of a tree.

    Args:
        tree: The links.
        bodies: What hangs on them.
        press: What of a touch is allowed.
    """

    def __init__(self, tree: Tree, bodies: Sequence[Body], press: Press) -> None:
        self.tree, self.bodies, self.press = tree, tuple(bodies), press
        self.pairs = watched_pairs(tree, bodies)
        self.distances = Distances(bodies)
        self._links = np.array([tree.index[body.link] for body in bodies])
        self._local = np.array([body.pose for body in bodies])
        self.first = np.array([pair.first for pair in self.pairs], dtype=int)
        self.second = np.array([pair.second for pair in self.pairs], dtype=int)
        self.never = np.array([pair.touching is Touching.NEVER for pair in self.pairs], dtype=bool)

    @cached_property
    def bounds(self) -> FloatArray:
        """Largest change of each pair's distance by each joint, shape (pairs, n)."""
        return pair_bounds(self.tree, self.bodies, self.pairs)

    @cached_property
    def reach(self) -> FloatArray:
        """The largest of these for each joint, shape (n,)."""
        none = np.zeros(len(self.tree.joints))
        return np.asarray(self.bounds.max(axis=0) if self.pairs else none)

    def body_poses(self, q: FloatArray) -> FloatArray:
        """Return the poses of all bodies in the root, shape (m, bodies, 4, 4)."""
        found: FloatArray = self.tree.poses(q)[:, self._links] @ self._local
        return found

    def gaps(self, poses: FloatArray) -> FloatArray:
        """Return distances between the upright boxes around the bodies of each pair.

        The bodies themselves are never nearer to each other.

        Args:
            poses: Of all bodies, shape (m, bodies, 4, 4).

        Returns:
            [m], 0 where boxes overlap, shape (m, pairs).
        """
        half = np.stack(
            [half_extents(body, poses[:, k, :3, :3]) for k, body in enumerate(self.bodies)], axis=1
        )
        middle = poses[:, :, :3, 3]
        apart = np.abs(middle[:, self.first] - middle[:, self.second])
        apart -= half[:, self.first] + half[:, self.second]
        found: FloatArray = np.sqrt(np.sum(np.maximum(apart, 0.0) ** 2, axis=2))
        return found

    def distance(self, sample: int, poses: FloatArray, number: int) -> float:
        r"""Return how far a pair is from what is not allowed [m].

        For most pairs this is their distance :math:`d`. For two that may touch it is
        :math:`\max(d, a)`, where :math:`a` is how far they are from where the touch would no
        longer be allowed: less aside than ``offset`` and less deep than ``give``. Both change by
        no more than the bodies move against each other, so the larger of them does too.

        Args:
            sample: Number of the instant.
            poses: Of all bodies then, shape (bodies, 4, 4).
            number: Of the pair.
        """
        pair = self.pairs[number]
        apart = self.distances.between(sample, poses, pair.first, pair.second)
        if pair.touching is Touching.NEVER:
            return apart
        return max(apart, self._allowance(poses, pair))

    def _allowance(self, poses: FloatArray, pair: Pair) -> float:
        upper, lower = pair.first, pair.second
        # Pairs come in the order of the bodies; nozzle or held part press from above.
        if self.bodies[lower].kind in (Kind.NOZZLE, Kind.HELD):
            upper, lower = lower, upper
        bottom, top = self._end(poses, upper, -1.0), self._end(poses, lower, 1.0)
        if pair.touching is Touching.LAY:
            return self.press.lay - (top - bottom)
        aside = float(np.hypot(*(poses[upper, :2, 3] - poses[lower, :2, 3])))
        return min(self.press.offset - aside, self.press.give - (top - bottom))

    def _end(self, poses: FloatArray, number: int, sign: float) -> float:
        """Return the height of a body's top (sign 1) or underside (-1) [m]."""
        pose = poses[number]
        half = half_extents(self.bodies[number], pose[None, :3, :3])[0, 2]
        return float(pose[2, 3] + sign * half)
