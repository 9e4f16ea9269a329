"""By how much the follower is behind the leader, from the velocities of both tools."""

from __future__ import annotations

import numpy as np

from twin_experiments.metrics.series import Array


def estimate_lag(
    leader: Array,
    follower: Array,
    segments: tuple[tuple[int, int], ...],
    rate_hz: float,
    max_lag_s: float,
) -> float | None:
    r"""Estimate by how much the follower is behind, from the velocities of both tools.

    The cross-correlation is completed to the squared difference, summed over windows that do not
    change with the lag, so that the windows' edges pull nothing towards zero; both roles are taken
    in turn, so that swapping the sides changes the sign alone. A parabola through the smallest
    value and its neighbours gives the part of an instant:

    .. math:: D(\tau) = \sum_t |v_l(t) - v_f(t + \tau)|^2 + \sum_t |v_f(t) - v_l(t - \tau)|^2

    Args:
        leader: Tool velocities of the leader at equal steps, shape ``(m, 3)`` [m/s].
        follower: The same of the follower.
        segments: Runs of instants without a hole; those shorter than four times ``max_lag_s`` are
            not used.
        rate_hz: Steps per second.
        max_lag_s: Largest lag searched for [s].

    Returns:
        Lag [s], positive: the follower is behind. None if nothing moves or no lag up to
        ``max_lag_s`` fits best.
    """
    reach = round(max_lag_s * rate_hz)
    total = np.zeros(2 * reach + 1)
    for first, last in segments:
        # In a shorter one the window that is shifted would be smaller than its shift.
        if last - first >= 4 * reach:
            ahead, behind = leader[first:last], follower[first:last]
            total += (
                _squared_difference(ahead, behind, reach)
                + _squared_difference(behind, ahead, reach)[::-1]
            )
    best = int(np.argmin(total))
    # Smallest at an end of the search: a lag beyond it may fit better.
    if best in (0, 2 * reach) or not np.ptp(total) > 0.0:
        return None
    before, here, after = total[best - 1 : best + 2]
    part = 0.5 * (before - after) / (before - 2.0 * here + after)
    return float((best - reach + part) / rate_hz)


def _squared_difference(fixed: Array, moved: Array, reach: int) -> Array:
    """Return sum_t |fixed(t) - moved(t + tau)|^2 for |tau| <= reach, inside ``fixed``.

    Without the square of ``fixed``: no shift changes it.
    """
    inner = fixed[reach : len(fixed) - reach]
    # A power of two is quickest; it holds all shifts up to `reach`, so nothing wraps around.
    size = 1 << (len(moved) - 1).bit_length()
    spectrum = np.fft.rfft(moved, size, axis=0) * np.conj(np.fft.rfft(inner, size, axis=0))
    correlation = np.fft.irfft(spectrum, size, axis=0)[: 2 * reach + 1].sum(axis=1)
    running = np.concatenate(([0.0], np.cumsum((moved**2).sum(axis=1))))
    energy = running[len(inner) :] - running[: 2 * reach + 1]
    return np.asarray(energy - 2.0 * correlation, dtype=np.float64)


def tool_velocity(tool: Array, segments: tuple[tuple[int, int], ...], rate: float) -> Array:
    """Differentiate tool positions inside each segment [m/s]."""
    velocity = np.zeros_like(tool)
    for first, last in segments:
        if last - first > 1:
            velocity[first:last] = np.gradient(tool[first:last], axis=0) * rate
    return velocity
