"""Motions that end near something, and how often bodies hit each other in worlds that differ."""

from __future__ import annotations

import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from harness.second_world.planting import Bench, moves, program
from harness.second_world.truth import Truth, Vector
from scara_config.programs.files import ProgramSteps
from what_if.uncertainty.spreads import Spread, drawn, spreads_of
from what_if.uncertainty.varied import varied
from what_if.world import World

FREE = 0.005
"""A way keeps off everything by so much [m] until it comes near its end."""


PROBE, LEAST, MOST = 40, 0.1, 0.6
"""In so many worlds a motion is tried first; it hits something in a share of them between these."""


@dataclass(frozen=True)
class Near:
    """A motion that ends near something.

    Attributes:
        world: In which it begins.
        motion: Of two moves.
        ways: Where the joints are at the beginning, between the moves, and at the end.
    """

    world: World
    motion: ProgramSteps
    ways: tuple[Vector, ...]


def near(bench: Bench, links: Sequence[str], clearance: float, person: bool = False) -> Near:
    """Return a motion that ends ``clearance`` [m] off these links, or off a person."""
    truth, world = bench.truth, bench.world
    while True:
        end = bench.random()
        if person:
            bench.truth.pose(end)
            x, y, _ = bench.truth.inside(("link_3", "tool0"), bench.rng)
            world = replace(world, people=((x, y, 0.0),))
            truth = Truth(world)
        solid = [*truth.bodies, *truth.own, *truth.table]
        wanted = [pair for pair in solid if truth.names[pair[1]] in ("person_0", *links)]
        if truth.at(end, wanted) > 0.0:
            continue
        (before,) = bench.free(count=1)
        if truth.at(before, solid) < FREE:
            continue
        end = _backed(truth, before, end, wanted, clearance)
        others = [pair for pair in solid if pair not in wanted] + truth.zones
        start = world.q
        if (
            truth.keeps_off(start, before, [*solid, *truth.zones], FREE)
            and truth.keeps_off(before, end, others, FREE)
            and truth.keeps_off(before, end, wanted, 0.9 * clearance)
        ):
            steps = moves([before, end], world)
            found = Near(world, program(*steps), (start, before, end))
            # Room above something is as sure as the room itself: nothing is drawn upwards.
            if LEAST * PROBE <= hits(found, PROBE, 0) <= MOST * PROBE:
                return found


def _backed(
    truth: Truth, before: Vector, end: Vector, pairs: Sequence[tuple[int, int]], clearance: float
) -> Vector:
    """Return the place on the way to a hit at which so much is left."""
    a, b = np.array(before), np.array(end)
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        if truth.at(a + middle * (b - a), pairs) > clearance:
            low = middle
        else:
            high = middle
    return tuple((a + low * (b - a)).tolist())


def hits(case: Near, worlds: int, seed: int, workers: int = 1) -> int:
    """Count in how many worlds bodies touch on the last move, by MuJoCo; before, all is far.

    Args:
        case: The motion.
        worlds: So many.
        seed: Of their drawing.
        workers: Processes; they are forked, so no thread may run here.
    """
    spreads = spreads_of(case.world)
    rows = drawn(spreads, worlds, np.random.default_rng(seed)).tolist()
    if workers == 1:
        return _hits(case, spreads, rows)
    context = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(workers, context, _keep, (case, spreads)) as pool:
        return sum(pool.map(_kept_hits, (rows[k::workers] for k in range(workers))))


def _hits(case: Near, spreads: Sequence[Spread], rows: Sequence[Sequence[float]]) -> int:
    count = 0
    for row in rows:
        truth = Truth(varied(case.world, spreads, row))
        solid = [*truth.bodies, *truth.own, *truth.table]
        count += not truth.keeps_off(*case.ways[-2:], solid, 0.0)
    return count


_kept: list[tuple[Near, Sequence[Spread]]] = []


def _keep(case: Near, spreads: Sequence[Spread]) -> None:
    _kept[:] = [(case, spreads)]


def _kept_hits(rows: Sequence[Sequence[float]]) -> int:
    return _hits(*_kept[0], rows)
