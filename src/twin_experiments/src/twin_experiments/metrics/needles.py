"""Needles: short peaks of the tools' distance, and what each of them is made of.

At speed v one millisecond between both sides is v mm. A needle is most often such a moment: one
side was late, or early, for a few hundredths of a second. Its height over the speed is that time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scara_config.text_enum import StrEnum

from twin_experiments.metrics.errors import Move, Trace
from twin_experiments.metrics.pauses import AFTERMATH_S, Pause
from twin_experiments.metrics.series import Array

WIDEST_S = 0.06  # our choice: wider peaks are seen as what they are, a distance that comes and goes
LOWEST_MM = 0.3  # our choice: what a figure of a whole experiment still shows
LEAST_SHARE = 0.15  # our choice: of the highest distance; less is the unrest of the others
LATE_S = 0.005  # our choice: half a period of 100 Hz later than usual
USUAL_PERCENT = 95.0  # our choice: ages up to this percentile are usual
LATE_BEFORE_S = 0.1  # our choice: so long after a late sample it still shows
BEGINNING_S = 0.1  # our choice: the follower joins a move within it


class NeedleCause(StrEnum):
    """What was going on at a needle."""

    PAUSE = "the machine or the recorder had paused"
    LATE = "a sample came later than usual"
    BEGINNING = "the move had just begun, and the follower was joining it"
    NONE = "nothing recorded explains it"


@dataclass(frozen=True)
class Needle:
    """One needle.

    Args:
        start: Where the distance begins to rise [s].
        at: When it is largest [s].
        end: Where it is down again [s].
        height_mm: The distance of the tools then.
        speed: Of the faster tool then [m/s].
        cause: What was going on.
    """

    start: float
    at: float
    end: float
    height_mm: float
    speed: float
    cause: NeedleCause

    @property
    def timing_ms(self) -> float | None:
        """Time between both sides that makes this distance; None if the tools hardly move."""
        return self.height_mm / self.speed if self.speed > 0.01 else None


def find_needles(
    seen: Trace,
    moves: Sequence[Move],
    pauses: Sequence[Pause],
    ages: Mapping[str, tuple[Array, Array]],
) -> tuple[Needle, ...]:
    """Return the needles of one experiment, in order.

    Args:
        seen: Trace of both sides.
        moves: Its moves.
        pauses: Of the machine.
        ages: Topic to times of receipt [s] and ages then [s].
    """
    from scipy.signal import find_peaks  # a second to load: a run begins without it

    # When something was received later than usual [s].
    receipts = [
        received[age > np.percentile(age, USUAL_PERCENT) + LATE_S]
        for received, age in ages.values()
        # Of nothing there is no percentile.
        if len(age)
    ]
    late = np.sort(np.concatenate(receipts)) if receipts else np.zeros(0)
    rate = seen.aligned.rate
    found: list[Needle] = []
    floor = max(LOWEST_MM, LEAST_SHARE * float(seen.deviation_mm.max()))
    for first, last in seen.aligned.segments:
        part = slice(first, last)
        # By prominence: a peak on a broad hill is high without standing out.
        peaks, shape = find_peaks(
            seen.deviation_mm[part], prominence=floor, width=(None, WIDEST_S * rate), rel_height=0.5
        )
        speeds = tool_speeds(seen, part)
        instants = seen.aligned.instants[part]
        for number, peak in enumerate(peaks):
            at, half = float(instants[peak]), float(shape["widths"][number]) / rate
            cause = _cause(at, moves, pauses, late)
            height = float(seen.deviation_mm[first + peak])
            found.append(Needle(at - half, at, at + half, height, float(speeds[peak]), cause))
    return tuple(found)


def tool_speeds(seen: Trace, part: slice) -> Array:
    """Return the speed of the faster tool [m/s]."""
    if part.stop - part.start < 2:
        return np.zeros(part.stop - part.start)
    speeds = [
        np.linalg.norm(np.gradient(tool[part], 1.0 / seen.aligned.rate, axis=0), axis=1)
        for tool in (seen.real_tool, seen.twin_tool)
    ]
    return np.asarray(np.maximum(*speeds), dtype=np.float64)


def _cause(at: float, moves: Sequence[Move], pauses: Sequence[Pause], late: Array) -> NeedleCause:
    """Return the first cause that fits, the surest one first."""
    if any(pause.start <= at <= pause.end + AFTERMATH_S for pause in pauses):
        return NeedleCause.PAUSE
    if ((late >= at - LATE_BEFORE_S) & (late <= at + LATE_S)).any():
        return NeedleCause.LATE
    if any(move.start <= at <= move.start + BEGINNING_S for move in moves):
        return NeedleCause.BEGINNING
    return NeedleCause.NONE
