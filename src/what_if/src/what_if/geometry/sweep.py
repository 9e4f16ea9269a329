r"""How near bodies come on a whole way, and where they first meet: nothing slips through.

**Proof.** Let :math:`d(u)` be the distance of two bodies on the way. While the joints go by
:math:`\Delta_j` each, to and fro counted, no point of either moves against the other by more than
:math:`L = \sum_j r_j \Delta_j`, where :math:`r_j` bounds the distance from the joint's axis
(:meth:`what_if.geometry.tree.Tree.reach`). A distance changes by no more than the bodies move
against each other. So between two places with the distances :math:`d_0` and :math:`d_1`, whose way
is :math:`L`, and a place in between after :math:`x`:

.. math:: d \ge \max(d_0 - x,\; d_1 - (L - x)) \ge \tfrac12 (d_0 + d_1 - L)

This holds for every place between the two, not for samples only. A piece is left alone when this
bound is above what is looked for; else it is halved, and both halves are looked at. A piece shorter
than :data:`SHORTEST` whose bound is still below what is allowed counts as a hit: a doubt is never
decided for the motion. So a hit is never missed, however thin the post, and a way is called free
only if the bound says so for each piece of it.

Upright boxes around the bodies give a first bound for :math:`d` from below, for all pairs at once;
the library is asked only where this one is not enough.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from what_if.geometry.bodies import FloatArray
from what_if.geometry.distances import ERROR
from what_if.geometry.scene import Scene
from what_if.geometry.way import Way

SPACING = 0.03
"""Longest piece of the first look [m]; our choice: most pairs are decided by it."""
SHORTEST = 1e-5
"""A piece in which nothing moves further [m] is not halved again; our choice."""
ABOUT, AT_LEAST = 0.05, 5e-4
"""The smallest clearance is found to this share of it, and to this length [m]; our choice."""
SEEDS = 24
"""So many of the smallest gaps are measured first, to know what is worth looking for."""


Piece = tuple[int, int, int, float, float]
"""Numbers of its two ends and of the pair, its length [m], the boxes' bound of the distance [m]."""


@dataclass(frozen=True)
class Nearest:
    """Where two bodies are on a way.

    Attributes:
        distance: [m].
        pair: Number of the pair in the scene.
        u: Place on the way.
    """

    distance: float
    pair: int
    u: float


@dataclass(frozen=True)
class Swept:
    """What came of looking at a way.

    Attributes:
        nearest: The smallest clearance that was found; None without a pair.
        at_least: No two bodies come nearer than this [m].
        hit: Where two bodies first meet; None if they do not.
    """

    nearest: Nearest | None
    at_least: float
    hit: Nearest | None


def sweep(scene: Scene, way: Way, nearer: float) -> Swept:
    """Look at a whole way.

    Args:
        scene: The bodies.
        way: The way of the joints.
        nearer: Bodies that come nearer to each other than this [m] hit each other.
    """
    if not scene.pairs:
        return Swept(None, math.inf, None)
    # The library may say too much by ERROR: a doubt counts as a hit (decision 0029).
    return _Search(scene, way, nearer + ERROR).run()


class _Search:
    """One look at one way; places are numbered in the order in which they were looked at."""

    def __init__(self, scene: Scene, way: Way, nearer: float) -> None:
        self._scene, self._way, self._nearer = scene, way, nearer
        # By place and pair: each place is the end of two pieces, and halving asks for it again.
        self._known: dict[tuple[int, int], float] = {}
        self._u: list[float] = []
        self._poses: list[FloatArray] = []
        scene.distances.forget()
        self._best = Nearest(math.inf, -1, 0.0)
        self._hit: Nearest | None = None
        # What the straight pieces are off the true way adds to each piece's length.
        self._slack = 2.0 * scene.bounds @ way.slack

    def run(self) -> Swept:
        """Halve pieces until each is decided."""
        u = self._way.grid(self._scene.reach, SPACING)
        gaps = self._look_at(u)
        # Measured where boxes are nearest to each other, so that the search knows its aim.
        count = min(SEEDS, gaps.size)
        for k in np.argpartition(gaps, count - 1, axis=None)[:count]:
            self._distance(*(int(i) for i in np.unravel_index(k, gaps.shape)))
        # A way of one place is one piece without length.
        begin = np.arange(max(len(u) - 1, 1))
        end = np.minimum(begin + 1, len(u) - 1)
        lengths = self._lengths(u[begin], u[end])
        bound = 0.5 * (gaps[begin] + gaps[end] - lengths)
        pieces, numbers = np.nonzero(bound < self._wanted())
        # The nearest first: after a hit nothing behind it on the way counts.
        order = np.argsort(bound[pieces, numbers])
        todo = [
            (int(begin[k]), int(end[k]), int(p), float(lengths[k, p]), float(bound[k, p]))
            for k, p in zip(pieces[order], numbers[order])
        ]
        while todo:
            todo = self._halved([piece for piece in todo if not self._is_decided(piece)])
        if self._hit is not None:
            return Swept(self._hit, 0.0, self._hit)
        if self._best.pair < 0:
            return Swept(None, self._nearer - ERROR, None)
        # Each piece was left alone at a bound that is no less than what is wanted at the end.
        sure = self._wanted() - ERROR - 0.5 * float(self._slack.max())
        return Swept(self._best, sure, None)

    def _look_at(self, u: FloatArray) -> FloatArray:
        """Find where all bodies are at some places; return the gaps of all pairs there."""
        poses = self._scene.body_poses(self._way.at(u))
        self._u += u.tolist()
        self._poses += list(poses)
        return self._scene.gaps(poses)

    def _lengths(self, begin: FloatArray, end: FloatArray) -> FloatArray:
        """Return how far the bodies of each pair move against each other, (pieces, pairs)."""
        travelled = self._way.travelled(end) - self._way.travelled(begin)
        found: FloatArray = travelled @ self._scene.bounds.T + self._slack
        return found

    def _distance(self, sample: int, pair: int) -> float:
        """Return the distance of a pair at a place; note it if it is the smallest."""
        found = self._known.get((sample, pair))
        if found is None:
            found = self._scene.distance(sample, self._poses[sample], pair)
            self._known[sample, pair] = found
            if found <= self._nearer:
                self._note(pair, self._u[sample], max(found, 0.0))
            elif self._scene.never[pair] and found < self._best.distance:
                self._best = Nearest(found, pair, self._u[sample])
        return found

    def _note(self, pair: int, u: float, distance: float) -> None:
        """Note a hit; the first on the way counts."""
        if self._hit is None or u < self._hit.u:
            self._hit = Nearest(distance, pair, u)

    def _wanted(self) -> float:
        """Return the bound from which on a piece of most pairs is decided."""
        if self._hit is not None:
            return self._nearer
        best = self._best.distance
        return max(self._nearer, best - max(ABOUT * best, AT_LEAST)) if best < math.inf else best

    def _is_decided(self, piece: Piece) -> bool:
        """Tell whether a piece needs no closer look."""
        begin, end, pair, length, rough = piece
        if self._hit is not None and self._u[begin] >= self._hit.u:
            return True
        # Of a pair that may touch nobody asks for its clearance.
        wanted = self._wanted() if self._scene.never[pair] else self._nearer
        if rough >= wanted:
            return True
        low = 0.5 * (self._distance(begin, pair) + self._distance(end, pair) - length)
        is_short = length - self._slack[pair] <= SHORTEST
        if is_short and low <= self._nearer:
            self._note(pair, self._u[begin], max(low, 0.0))
        return is_short or low >= wanted

    def _halved(self, pieces: list[Piece]) -> list[Piece]:
        """Return both halves of each piece, with the bounds of the boxes."""
        if not pieces:
            return []
        # Pieces of many pairs share their ends: each middle is looked at once for all of them.
        ends = sorted({(begin, end) for begin, end, *_ in pieces})
        middles = {pair: len(self._u) + k for k, pair in enumerate(ends)}
        u = np.array([0.5 * (self._u[begin] + self._u[end]) for begin, end in ends])
        first = len(self._u)
        gaps = self._look_at(u)
        one = self._lengths(np.array([self._u[begin] for begin, _ in ends]), u)
        other = self._lengths(u, np.array([self._u[end] for _, end in ends]))
        found = []
        for begin, end, pair, _, _ in pieces:
            middle = middles[begin, end]
            row = middle - first
            gap = float(gaps[row, pair])
            for a, b, known, length in (
                (begin, middle, begin, float(one[row, pair])),
                (middle, end, end, float(other[row, pair])),
            ):
                # Both ends were measured when the piece was not yet decided.
                rough = 0.5 * (self._known[known, pair] + gap - length)
                found.append((a, b, pair, length, rough))
        return found
