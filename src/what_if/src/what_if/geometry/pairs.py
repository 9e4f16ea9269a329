"""Which two bodies are watched, and how near each may come."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import combinations

import numpy as np

from what_if.geometry.bodies import MOVED_BY_ARM, Body, FloatArray, Kind
from what_if.geometry.tree import Tree

NEIGHBOURS = 1
"""Links of the arm that so many moving joints lie between do not hit each other: they are built
around a common axis, and their shapes overlap there."""


class Touching(Enum):
    """What of a pair is allowed."""

    NEVER = "never"
    GRIP = "grip"
    """The nozzle may stand on a part, within its bellows and over its middle."""
    LAY = "lay"
    """A held part may stand on a rest."""


@dataclass(frozen=True)
class Pair:
    """Two bodies by their numbers, and what is allowed of them."""

    first: int
    second: int
    touching: Touching


def watched_pairs(tree: Tree, bodies: Sequence[Body]) -> list[Pair]:
    """Return all pairs of bodies that move against each other and must not meet.

    The arm and what it holds against everything else; what the table carries against people and
    obstacles. What lies about may touch what it likes.
    """
    found = []
    known: dict[object, Touching | None] = {}
    for (i, first), (j, second) in combinations(enumerate(bodies), 2):
        # What the same links carry has the same answer: parts on one stand are asked for once.
        key = first.link, first.kind, second.link, second.kind
        if key not in known:
            known[key] = _touching(tree, first, second)
        touching = known[key]
        if touching is not None:
            found.append(Pair(i, j, touching))
    return found


def _touching(tree: Tree, first: Body, second: Body) -> Touching | None:
    """Return what is allowed of two bodies; None if nobody watches them."""
    # What the same joints move keeps its distance, however they move.
    if tree.movers[first.link] == tree.movers[second.link]:
        return None
    kinds = {first.kind, second.kind}
    arm = [body for body in (first, second) if body.kind in MOVED_BY_ARM]
    if len(arm) == 2:
        # Neighbours hang on each other by one joint, and touch there.
        between = tree.movers[first.link] ^ tree.movers[second.link]
        return Touching.NEVER if len(between) > NEIGHBOURS else None
    if not arm:
        # The table moves too, but only what comes from outside can be in its way.
        outside = kinds & {Kind.PERSON, Kind.OBSTACLE}
        return Touching.NEVER if outside else None
    (moved,) = arm
    other = second if moved is first else first
    if other.kind is Kind.CELL and moved.kind is Kind.ARM:
        # The first link of the arm turns in what carries it: in that alone, not in all that stands.
        hangs_by = len(tree.movers[moved.link])
        carriers = {joint.parent for joint in tree.model.chain(moved.link)}
        if hangs_by <= NEIGHBOURS and other.link in carriers:
            return None
    if kinds == {Kind.NOZZLE, Kind.PART}:
        return Touching.GRIP
    return Touching.LAY if kinds == {Kind.HELD, Kind.REST} else Touching.NEVER


def pair_bounds(tree: Tree, bodies: Sequence[Body], pairs: Sequence[Pair]) -> FloatArray:
    """Bound how much the distance of each pair changes for each unit that a joint moves.

    A joint that moves both leaves their distance as it is.

    Returns:
        [m/rad], prismatic [1], shape (pairs, n).
    """
    reach = np.array([tree.reach(body) for body in bodies])
    found = np.empty((len(pairs), len(tree.joints)))
    for row, pair in zip(found, pairs):
        one, other = bodies[pair.first].link, bodies[pair.second].link
        both = tree.movers[one] & tree.movers[other]
        row[:] = reach[pair.first] + reach[pair.second]
        row[list(both)] = 0.0
    return found
