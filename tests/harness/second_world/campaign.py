"""Judge random programs, half of them with a planted harm, and count what is judged wrongly."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from what_if.cell_files_io import resting_cell
from what_if.judging import judge
from what_if.verdict import Outcome

from harness.second_world.planting import HARMS, Bench, free_case, held_case
from harness.second_world.truth import Truth
from harness.starter import chosen

SCARA, BENT = "fanuc_sr6ia", "articulated_six"
HELD_EVERY, BENT_EVERY = 4, 8
"""Of the free programs so many have a part in hand, and so many are of the bent arm."""


@dataclass
class Counted:
    """What came of a campaign.

    Attributes:
        planted: So many programs of each harm.
        missed: So many of them that were not refused.
        free: So many free programs.
        refused: So many of them that were refused.
        wrong: Each program that was judged wrongly, in words.
        seconds: What each verdict took.
    """

    planted: dict[str, int] = field(default_factory=lambda: dict.fromkeys(HARMS, 0))
    missed: dict[str, int] = field(default_factory=lambda: dict.fromkeys(HARMS, 0))
    free: int = 0
    refused: int = 0
    wrong: list[str] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)


@contextmanager
def benches(config: Path, seed: int) -> Iterator[dict[str, Bench]]:
    """Yield the worlds of both robots, with the truth about each."""
    with ExitStack() as stack:
        found = {}
        for number, robot in enumerate((SCARA, BENT)):
            with chosen(robot):
                world = stack.enter_context(resting_cell(config))[0]
            rng = np.random.default_rng([seed, number])
            found[robot] = Bench(world, Truth(world), rng, config)
        yield found


def run(
    count: int,
    known: dict[str, Bench],
    told: Callable[[int, Counted], None] = lambda *_: None,
) -> Counted:
    """Judge ``count`` random programs: each second one has a harm, each harm in its turn.

    Args:
        count: How many.
        known: Both robots.
        told: Is called after each program with its number and what was counted.
    """
    counted = Counted()
    harms = list(HARMS)
    for k in range(count):
        harm = harms[k // 2 % len(harms)] if k % 2 else ""
        bent = harm == "self" or (not harm and k // 2 % BENT_EVERY == 1)
        bench = known[BENT if bent else SCARA]
        if harm:
            world, motion = HARMS[harm](bench)
        elif not bent and k // 2 % HELD_EVERY == 0:
            world, motion = held_case(bench)
        else:
            world, motion = free_case(bench)
        begin = time.perf_counter()
        verdict = judge(world, motion)
        counted.seconds.append(time.perf_counter() - begin)
        refused = verdict.outcome is Outcome.REFUSED
        if harm:
            counted.planted[harm] += 1
            counted.missed[harm] += not refused
        else:
            counted.free += 1
            counted.refused += refused
        if refused != bool(harm):
            text = f"{k}: {harm or 'free'}: {verdict.sentence}: {world.obstacles} {world.people} "
            counted.wrong.append(f"{text}{world.zones[1:]} {motion}")
        told(k + 1, counted)
    return counted
