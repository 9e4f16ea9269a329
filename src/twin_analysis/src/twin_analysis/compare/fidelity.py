r"""Fidelity by trace alignment.

It finds which snapshots of two traces match, in order, and how far apart those are.

Two snapshots may match if every attribute differs by no more than what is accepted for it. Of all
alignments that keep the order, the one with the largest score is taken (dynamic programming as by
Needleman and Wunsch):

.. math:: H_{ij} = \max(H_{i-1,j-1} + s_{ij},\; H_{i-1,j} - g,\; H_{i,j-1} - g), \quad
          s_{ij} = 1 - \tfrac{1}{n} \sum_k |a_{ik} - b_{jk}| / d_k

A constant lag shifts the alignment and costs no match, a wrong path does. The matrix is filled by
anti-diagonals within a band, each in one step.

Source:
    Munoz, Wimmer, Troya, Vallecillo, Measuring the Fidelity of a Physical and a Digital Twin Using
    Trace Alignments, IEEE Transactions on Software Engineering 50(12), 2024. The idea of accepted
    distances, order-keeping alignment, percentage of matched snapshots and distance of the matched
    ones is theirs; the score, the linear gap penalty and the code are ours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from twin_experiments.metrics.series import Array, Mask

Pairs = NDArray[np.int_]
"""Matched snapshots.

Indices into the first and the second trace, shape ``(k, 2)``, both columns rising.
"""

_MATCH, _SKIP_ONE, _SKIP_OTHER = 0, 1, 2


class FidelityError(ValueError):
    """Two traces cannot be aligned; the text says why."""


@dataclass(frozen=True)
class Fidelity:
    """How faithful one trace is to another.

    Args:
        snapshots: How many the first and the second trace have.
        pairs: The matched ones.
        matched_percent: Share of the snapshots of both traces that are matched.
        moving_percent: The same of those in which something moves; None if nothing does.
        mean_distance: Of the matched, in parts of what is accepted, mean over the attributes; None
            without a match.
        gaps: Runs of snapshots without a match.
        longest_gap: Length of the longest one, in snapshots.
        mean_shift: By how many snapshots the second trace is behind, mean over matched moving ones;
            None without any.
    """

    snapshots: tuple[int, int]
    pairs: Pairs
    matched_percent: float
    moving_percent: float | None
    mean_distance: float | None
    gaps: int
    longest_gap: int
    mean_shift: float | None


def measure_fidelity(
    one: Array, other: Array, accepted: Array, moving: tuple[Mask, Mask], gap: float, band: int
) -> Fidelity:
    """Align two traces and measure how faithful they are.

    Args:
        one: First trace, shape ``(n, a)``: attributes of each snapshot, at equal steps of time.
        other: Second trace, shape ``(m, a)``.
        accepted: Largest accepted difference of each attribute, shape ``(a,)``, positive.
        moving: For each snapshot of both traces whether something moves; rests match easily and say
            little.
        gap: What a snapshot without a match costs, in parts of the best match.
        band: Snapshots further apart than this in their traces cannot match; at least the
            difference of the lengths.

    Raises:
        FidelityError: A trace is empty, not finite, or shapes do not fit.
    """
    # Refuse what cannot be aligned
    for name, trace in (("first", one), ("second", other)):
        if trace.ndim != 2 or not len(trace) or trace.shape[1] != len(accepted):
            raise FidelityError(
                f"the {name} trace has shape {trace.shape}, expected snapshots of "
                f"{len(accepted)} attributes"
            )
        if not np.isfinite(trace).all():
            raise FidelityError(f"the {name} trace is not finite")
    if not (np.isfinite(accepted).all() and (accepted > 0.0).all()):
        raise FidelityError(f"accepted differences {accepted.tolist()} are not all positive")
    pairs = _align(one / accepted, other / accepted, gap, max(band, abs(len(one) - len(other))))
    snapshots = len(one) + len(other)
    # How many snapshots of both traces lie between neighbouring matches, where any do.
    # As if there were a match before the first and behind the last snapshot: gaps there count too.
    edges = np.vstack(([-1, -1], pairs, [len(one), len(other)]))
    between = (np.diff(edges, axis=0) - 1).sum(axis=1)
    lengths = [int(length) for length in between[between > 0]]
    distances = np.abs(one[pairs[:, 0]] - other[pairs[:, 1]]) / accepted
    in_motion = int(moving[0].sum() + moving[1].sum())
    matched_in_motion = moving[0][pairs[:, 0]], moving[1][pairs[:, 1]]
    both = matched_in_motion[0] & matched_in_motion[1]
    shifts = (pairs[:, 1] - pairs[:, 0])[both]
    return Fidelity(
        snapshots=(len(one), len(other)),
        pairs=pairs,
        matched_percent=200.0 * len(pairs) / snapshots,
        moving_percent=100.0 * float(sum(part.sum() for part in matched_in_motion)) / in_motion
        if in_motion
        else None,
        mean_distance=float(distances.mean()) if len(pairs) else None,
        gaps=len(lengths),
        longest_gap=max(lengths, default=0),
        mean_shift=float(shifts.mean()) if len(shifts) else None,
    )


def _align(one: Array, other: Array, gap: float, band: int) -> Pairs:
    """Return the matched pairs of the best alignment of traces in parts of what is accepted."""
    n, m = len(one), len(other)
    # Attributes first: a diagonal is then a few long rows, which numpy runs through at once.
    forward, backward = np.ascontiguousarray(one.T), np.ascontiguousarray(other[::-1].T)
    before_last, last = np.full(n + 2, -np.inf), np.full(n + 2, -np.inf)
    steps: list[tuple[int, NDArray[np.int8]]] = []
    for diagonal in range(n + m + 1):
        low = max(0, diagonal - m, -((band - diagonal) // 2))
        high = min(n, diagonal, (diagonal + band) // 2)
        best = before_last[low : high + 1] + _scores(forward, backward, diagonal, low, high)
        # A byte each: all of them are kept until the way back is found.
        step = np.zeros(high - low + 1, dtype=np.int8)
        # Of equal candidates the first one stays: a match, then a skip in the first trace.
        for kind, reached in (
            (_SKIP_ONE, last[low : high + 1] - gap),
            (_SKIP_OTHER, last[low + 1 : high + 2] - gap),
        ):
            better = reached > best
            step[better] = kind
            np.maximum(best, reached, out=best)
        here = np.full(n + 2, -np.inf)
        # Row i stands at i + 1, so that the row before the first is there, and out of reach.
        here[low + 1 : high + 2] = best
        if diagonal == 0:
            here[1] = 0.0
        steps.append((low, step))
        before_last, last = last, here
    return _trace_back(steps, n, m)


def _scores(forward: Array, backward: Array, diagonal: int, low: int, high: int) -> Array:
    """Return the scores along a diagonal.

    Row i is matched with column ``diagonal - i`` (counted from 1) for i = low..high.
    """
    score = np.full(high - low + 1, -np.inf)
    first, last = max(low, 1), min(high, diagonal - 1)
    if first > last:
        return score
    attributes, m = backward.shape
    distance = np.abs(
        forward[:, first - 1 : last] - backward[:, m - diagonal + first : m - diagonal + last + 1]
    )
    mean = distance.sum(axis=0) / attributes
    # One attribute that is too far off is enough.
    mean[distance.max(axis=0) > 1.0] = np.inf
    score[first - low : last - low + 1] = 1.0 - mean
    return score


def _trace_back(steps: list[tuple[int, NDArray[np.int8]]], n: int, m: int) -> Pairs:
    """Follow the best steps from the end to the beginning."""
    pairs: list[tuple[int, int]] = []
    i, j = n, m
    while i or j:
        low, best = steps[i + j]
        step = best[i - low]
        if step == _MATCH:
            pairs.append((i - 1, j - 1))
            i, j = i - 1, j - 1
        elif step == _SKIP_ONE:
            i -= 1
        else:
            j -= 1
    return np.array(pairs[::-1], dtype=np.int_).reshape(-1, 2)
