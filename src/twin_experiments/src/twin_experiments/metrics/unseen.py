"""The delay between both sides that a recording of a real robot cannot show.

Without ground truth the real side is what the robot's registers said, at the instant that the twin
controller gave it. A reading may have been true up to one period of the readings before the clock
that came with it, and the robot's clock is known within an interval only: its half width holds the
time of the answer. Whatever lies between these bounds moves both tracks against each other, and no
figure of the recording changes by it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin_experiments.metrics.errors import Trace
from twin_experiments.metrics.needles import tool_speeds
from twin_experiments.metrics.series import Array


@dataclass(frozen=True)
class UnseenDelay:
    """By how much older the real positions may be than their stamps say.

    Attributes:
        earliest: Lower bound [s], 0 or less: they are younger.
        latest: Upper bound [s].
        speed: Largest speed of the faster tool in the experiment [m/s].
    """

    earliest: float
    latest: float
    speed: float

    @property
    def bounds_ms(self) -> tuple[float, float]:
        """Both bounds [ms]."""
        return 1e3 * self.earliest, 1e3 * self.latest

    @property
    def bounds_mm(self) -> tuple[float, float]:
        """What they are at the tool's largest speed [mm]."""
        return 1e3 * self.earliest * self.speed, 1e3 * self.latest * self.speed


def unseen_delay(seen: Trace, stamps: Array, half_widths: Array) -> UnseenDelay | None:
    """Bound the delay that nobody can see in one experiment.

    Args:
        seen: Both tools of the experiment.
        stamps: Of the real side's readings [s], shape ``(n,)``.
        half_widths: Of the interval that holds the robot's clock [s], during the experiment.

    Returns:
        The bounds; None if the recording does not say how well the clocks agreed.
    """
    known = half_widths[np.isfinite(half_widths)]
    if len(known) == 0 or len(stamps) < 2:
        return None
    # The median: a hole in the recording is no period of the readings.
    width, period = float(known.max()), float(np.median(np.diff(stamps)))
    segments = seen.aligned.segments
    fastest = max(float(tool_speeds(seen, slice(*segment)).max()) for segment in segments)
    return UnseenDelay(-width, period + width, fastest)
