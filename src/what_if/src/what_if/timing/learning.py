"""Learn from what the robot's lines took how long it rests at each FINE."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import msgspec
import numpy as np
from scara_config.programs.files import ProgramSteps
from scara_config.programs.steps import MoveStep, PathStep

from what_if.config import ProgramConfig
from what_if.errors import WhatIfError
from what_if.timing.planning import plan
from what_if.world import World

LEAST = 3
"""So few rests say nothing; our choice."""


def rests_of(world: World, motion: ProgramSteps, seen: Sequence[tuple[int, float]]) -> list[float]:
    """Return how long the robot rested at the end of each move with FINE [s].

    The first line that was seen is left out: a start delay or a pause is in it. So is
    a line that was not seen from its beginning to that of the next one, and a move that the plan
    has not: it refuses it. The lines of a called program are not shown.

    Args:
        world: When the program began: joints and override count.
        motion: The program.
        seen: Numbers of the lines that the robot showed, and since when [s].
    """
    steps = motion.steps
    lines = [0 if step.program else step.line for step in steps]
    # Backwards: of a step with several legs the dictionary shall keep the first.
    legs = {leg.number: leg for leg in reversed(plan(world, motion).legs)}
    fine = world.cell.config.program.fine_ms * 1e-3
    found, at = [], 0
    for number, ((line, begin), (after, end)) in enumerate(pairwise(seen)):
        while at < len(steps) and lines[at] != line:
            at += 1
        if at + 1 >= len(steps):
            break
        step, leg = steps[at], legs.get(at)
        moves = isinstance(step, MoveStep | PathStep) and step.fine
        if number and moves and leg is not None and lines[at + 1] == after:
            # The leg's duration holds the assumed rest: without it the measured one is left.
            found.append(end - begin - (leg.duration - fine))
        at += 1
    return found


def learned(program: ProgramConfig, rests: Sequence[float]) -> ProgramConfig:
    """Return the law of programs with the rest that was seen, and how far single ones lie apart.

    Args:
        program: As it was assumed.
        rests: At the end of single moves [s].

    Raises:
        WhatIfError: They are too few, or negative: the robot was faster than its moves.

    Example:
        >>> law = ProgramConfig(80.0, 48.0, 0.0, 2.0, 10.0, False)
        >>> found = learned(law, [0.072, 0.070, 0.074])
        >>> round(found.fine_ms, 3), round(found.fine_spread_ms, 3), found.fitted
        (72.0, 2.0, True)
    """
    if len(rests) < LEAST:
        raise WhatIfError(f"{len(rests)} moves with FINE were seen whole: {LEAST} are needed")
    rest, spread = float(np.mean(rests)), float(np.std(rests, ddof=1))
    if rest < 0.0:
        text = f"a FINE would take {1e3 * rest:.0f} ms: the robot was faster than its moves"
        raise WhatIfError(f"{text}: check acceleration_percent in what_if.yaml")
    return msgspec.structs.replace(
        program, fine_ms=1e3 * rest, fine_spread_ms=1e3 * spread, fitted=True
    )
