"""Bring the motions of two sides onto common instants of one clock.

Both sides are sampled at their own instants. Between two samples the motion is the cubic that has
their positions and velocities (Hermite), so comparing a 250 Hz with a 200 Hz series costs no
accuracy; across a hole it is not known and is left out.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]
FEWEST_SAMPLES = 2


class MetricsError(ValueError):
    """The data cannot be compared; the text names the side and what is wrong."""


@dataclass(frozen=True)
class Motion:
    """How the joints of one side moved.

    Args:
        side: ``real`` or ``twin``, named in errors.
        stamps: When each sample was true [s], shape ``(k,)``, strictly rising, in the clock common
            to both sides.
        positions: Joint positions, shape ``(k, n)``: [rad], prismatic [m].
        velocities: Joint velocities, shape ``(k, n)``: [rad/s], prismatic [m/s].

    Raises:
        MetricsError: Too few samples, shapes that do not fit, a value that is not finite, stamps
            that do not rise.
    """

    side: str
    stamps: Array
    positions: Array
    velocities: Array

    def __post_init__(self) -> None:
        count = len(self.stamps)
        if count < FEWEST_SAMPLES:
            raise MetricsError(
                f"{self.side}: {count} samples, at least {FEWEST_SAMPLES} are needed"
            )
        if (
            self.positions.ndim != 2
            or len(self.positions) != count
            or self.velocities.shape != self.positions.shape
        ):
            raise MetricsError(
                f"{self.side}: {count} stamps, positions {self.positions.shape} "
                f"and velocities {self.velocities.shape} do not fit"
            )
        for name, values in (
            ("stamp", self.stamps),
            ("position", self.positions),
            ("velocity", self.velocities),
        ):
            if not np.isfinite(values).all():
                raise MetricsError(f"{self.side}: a {name} is not finite")
        backward = np.flatnonzero(np.diff(self.stamps) <= 0.0)
        if len(backward):
            raise MetricsError(f"{self.side}: stamps do not rise at sample {backward[0] + 1}")

    def shifted(self, delay: float) -> Motion:
        """Return the same motion, ``delay`` [s] later."""
        return Motion(self.side, self.stamps + delay, self.positions, self.velocities)


@dataclass(frozen=True)
class SampleGap:
    """A hole in the samples of one side: where it starts [s] and how long it is [s]."""

    side: str
    start: float
    duration: float


@dataclass(frozen=True)
class Aligned:
    """Both motions at common instants; holes are left out.

    Args:
        rate: Instants per second inside a segment.
        segments: First and one-past-last index of each run of instants without a hole.
        real: The real side at these instants.
        twin: The twin at the same.
        gaps: The holes of both sides inside the common time span.
        span: Length of the common time span [s], holes included.
    """

    rate: float
    segments: tuple[tuple[int, int], ...]
    real: Motion
    twin: Motion
    gaps: tuple[SampleGap, ...]
    span: float

    @property
    def instants(self) -> Array:
        """The common instants [s], shape ``(m,)``."""
        return self.real.stamps

    @property
    def excluded_share(self) -> float:
        """Share of the common time span in which a side has a hole, 0..1."""
        return max(0.0, 1.0 - len(self.instants) / max(self.span * self.rate, 1.0))


def interpolate(motion: Motion, instants: Array) -> tuple[Array, Array]:
    """Evaluate the cubic Hermite interpolant of ``motion``.

    Args:
        motion: Samples with positions and velocities.
        instants: Where to evaluate [s], shape ``(m,)``, inside the samples' time span.

    Returns:
        Positions and velocities, each of shape ``(m, n)``.

    Source:
        Textbook cubic Hermite basis; our choice because the samples carry velocities.
    """
    # The pair of samples around each instant; the last instant belongs to the last pair.
    right = np.clip(
        np.searchsorted(motion.stamps, instants, side="right"), 1, len(motion.stamps) - 1
    )
    left = right - 1
    width = (motion.stamps[right] - motion.stamps[left])[:, None]
    u = (instants - motion.stamps[left])[:, None] / width
    p0, p1 = motion.positions[left], motion.positions[right]
    m0, m1 = motion.velocities[left] * width, motion.velocities[right] * width
    rise = p1 - p0
    square = 3.0 * rise - 2.0 * m0 - m1
    cube = m0 + m1 - 2.0 * rise
    positions = p0 + u * (m0 + u * (square + u * cube))
    velocities = (m0 + u * (2.0 * square + 3.0 * u * cube)) / width
    return positions, velocities


def find_gaps(motion: Motion, longest: float) -> tuple[SampleGap, ...]:
    """Return the holes between samples that are longer than ``longest`` [s]."""
    return gaps_between(motion.side, motion.stamps, longest)


def gaps_between(side: str, stamps: Array, longest: float) -> tuple[SampleGap, ...]:
    """Return the holes of a side between stamps [s] that are further apart than ``longest`` [s]."""
    widths = np.diff(stamps)
    return tuple(
        SampleGap(side, float(stamps[i]), float(widths[i]))
        for i in np.flatnonzero(widths > longest)
    )


def known_at(instants: Array, gaps: Iterable[SampleGap]) -> Mask:
    """Return which instants lie in no hole; the samples at both edges of a hole are known."""
    known = np.ones(len(instants), dtype=bool)
    for gap in gaps:
        known &= (instants <= gap.start) | (instants >= gap.start + gap.duration)
    return known


def known_steps(
    start: float, count: int, rate: float, gaps: Iterable[SampleGap]
) -> NDArray[np.int_]:
    """Return the numbers of the steps ``start + n / rate``, n below ``count``, that lie in no hole.

    They are those that :func:`known_at` knows. A hole costs nothing, however long it is: where a
    clock was set ahead by years, no memory holds all the steps.
    """
    found = [np.zeros(0, dtype=np.int_)]
    begin, last = start, start + (count - 1) / rate
    for gap in (*sorted(gaps, key=lambda gap: gap.start), SampleGap("", last, 0.0)):
        if begin <= gap.start:
            # One step more at both ends, for rounding; what is too much is taken off again.
            low = max(0, int((begin - start) * rate) - 1)
            high = min(count, int((gap.start - start) * rate) + 2)
            steps = np.arange(low, high)
            instants = start + steps / rate
            found.append(steps[(instants >= begin) & (instants <= gap.start)])
        begin = max(begin, gap.start + gap.duration)
    return np.concatenate(found)


def equal_steps(start: float, end: float, rate: float, gaps: Iterable[SampleGap] = ()) -> Array:
    """Return the instants from ``start`` to ``end`` [s] at equal steps, holes left out.

    Args:
        start: The first.
        end: None is behind it; the last may be before it by less than a step.
        rate: Instants per second.
        gaps: The holes.
    """
    count = max(1, int((end - start) * rate + 1e-9) + 1)
    # Rounding may put the last instant behind the end, where nothing is known.
    return np.minimum(start + known_steps(start, count, rate, gaps) / rate, end)


def align(real: Motion, twin: Motion, rate: float, longest_gap: float) -> Aligned:
    """Interpolate both motions to common instants inside their common time span, holes left out.

    Args:
        real: Motion of the real side.
        twin: Motion of the twin, same joints in the same order.
        rate: Instants per second.
        longest_gap: Samples further apart than this [s] leave a hole.

    Raises:
        MetricsError: The joints differ in number, the time spans do not overlap, or nothing is left
            without holes.
    """
    if real.positions.shape[1] != twin.positions.shape[1]:
        raise MetricsError(
            f"real has {real.positions.shape[1]} joints, twin {twin.positions.shape[1]}"
        )
    start = max(real.stamps[0], twin.stamps[0])
    end = min(real.stamps[-1], twin.stamps[-1])
    if end - start < 1.0 / rate:
        raise MetricsError(
            f"no common time span: real has {real.stamps[0]:.3f} to {real.stamps[-1]:.3f} s, "
            f"twin {twin.stamps[0]:.3f} to {twin.stamps[-1]:.3f} s"
        )
    gaps = tuple(
        gap
        for motion in (real, twin)
        for gap in find_gaps(motion, longest_gap)
        if gap.start < end and gap.start + gap.duration > start
    )
    # One side in a hole is enough: nothing can be compared there.
    steps = known_steps(start, int((end - start) * rate) + 1, rate, gaps)
    if not len(steps):
        raise MetricsError(
            f"nothing to compare: every instant lies in a hole longer than {longest_gap} s"
        )
    instants = start + steps / rate
    # Steps that follow each other belong together.
    edges = [0, *(np.flatnonzero(np.diff(steps) > 1) + 1).tolist(), len(steps)]
    return Aligned(
        rate=rate,
        segments=tuple(itertools.pairwise(edges)),
        real=Motion("real", instants, *interpolate(real, instants)),
        twin=Motion("twin", instants, *interpolate(twin, instants)),
        gaps=gaps,
        span=float(end - start),
    )


def count_ends(
    aligned: Aligned, motions: tuple[Motion, Motion], start: float, end: float, longest_gap: float
) -> Aligned:
    """Count what is missing at the ends of an experiment as holes too.

    A side that falls silent is not excused.

    Args:
        aligned: Both sides over their common time span.
        motions: The same sides as they were recorded.
        start: When the experiment began [s].
        end: When it ended [s].
        longest_gap: Samples further apart than this [s] leave a hole.
    """
    missing = [
        SampleGap(motion.side, begin, stop - begin)
        for motion in motions
        for begin, stop in ((start, float(motion.stamps[0])), (float(motion.stamps[-1]), end))
        if stop - begin > longest_gap
    ]
    if (end - start) - aligned.span <= longest_gap:
        return aligned
    return replace(aligned, gaps=(*aligned.gaps, *missing), span=end - start)


def true_runs(mask: Mask, segments: tuple[tuple[int, int], ...]) -> list[tuple[int, int]]:
    """Return first and one-past-last index of each run of True, cut where a segment ends."""
    runs: list[tuple[int, int]] = []
    for first, last in segments:
        edges = np.flatnonzero(
            np.diff(np.concatenate(([0], mask[first:last].astype(np.int8), [0])))
        )
        runs += [(first + int(a), first + int(b)) for a, b in zip(edges[::2], edges[1::2])]
    return runs
