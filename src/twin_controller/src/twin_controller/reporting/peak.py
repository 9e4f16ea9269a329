"""When the tools get further apart than before: that is told at once, and not at the next turn.

A peak of the distance lasts some hundredths of a second, less than a period of the state, and often
no longer than from one sample of a robot to the next: so it is looked for between them too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from twin_controller.core.safety.divergence import tools
from twin_controller.core.setup import Setup
from twin_controller.core.sides.pairing import SidesAtOnce, interpolate, paired
from twin_controller.core.sides.side import Sides
from twin_controller.core.state import CoreState

STEP_MM = 0.1
"""So much more than the largest so far is worth a message of its own; our choice: what is not told
of a peak is less, and a slow rise is told at the usual rate."""
GRID_S = 2e-3
"""So far apart are the instants that are looked at [s]; our choice."""
LONGEST_S = 0.05
"""Across a longer hole between two samples nobody knows how a side moved [s]; our choice."""


class Peak:
    """The largest distance that was told while the leader of now leads. Not thread-safe."""

    def __init__(self, setup: Setup) -> None:
        """Know nothing yet."""
        self._setup = setup
        self._leader, self._told_mm, self._looked = "", 0.0, math.inf

    def rises(self, state: CoreState) -> SidesAtOnce | None:
        """Return both sides where the tools were furthest apart since the last call.

        None if that is not more than was told before by a step; else it counts as told.
        """
        if state.lead.leader != self._leader:
            self._leader, self._told_mm, self._looked = state.lead.leader, 0.0, math.inf
        newest = paired(state.sides) if self._leader else None
        if newest is None:
            self._looked = math.inf
            return None
        apart_mm, widest = max(
            (
                (1e3 * math.dist(*tools(self._setup, pair)), pair)
                for pair in self._since(state.sides, newest)
            ),
            key=lambda one: one[0],
        )
        self._looked = newest[0].time
        if apart_mm < self._told_mm + STEP_MM:
            return None
        self._told_mm = apart_mm
        return widest

    def _since(self, sides: Sides, newest: SidesAtOnce) -> Iterator[SidesAtOnce]:
        """Yield the newest pair, and those on the grid back to the last call's."""
        yield newest
        end = newest[0].time
        span = end - self._looked
        if not 0.0 < span <= LONGEST_S:
            return
        for number in range(1, int(span / GRID_S) + 1):
            instant = end - number * GRID_S
            real = interpolate(sides.real.history, instant)
            twin = interpolate(sides.twin.history, instant)
            if real is not None and twin is not None:
                yield real, twin
