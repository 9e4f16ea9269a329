"""How noisy the readings of a robot at rest are, and whether it is at rest at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

DRIFTS = 4.0
"""Halves of a stretch whose means differ by so many standard deviations are no rest."""
SPREADS = 1.5
"""Nor is a stretch that strays so much more than its readings differ from one to the next."""


def noise_at_rest(rows: Sequence[Sequence[float]]) -> float | None:
    """Return the noise of the noisiest joint.

    White noise makes readings differ as much from one to the next as over a whole stretch; motion
    does not.

    Args:
        rows: Positions of one stretch, in the unit of the answer, shape ``(n, joints)``.

    Returns:
        Its standard deviation; None if a joint moves.
    """
    q = np.array(rows)
    half = len(q) // 2
    step = np.sqrt(np.mean(np.diff(q, axis=0) ** 2, axis=0) / 2.0)
    drift = np.abs(q[:half].mean(axis=0) - q[half:].mean(axis=0))
    spread = q.std(axis=0)
    moves = (drift > DRIFTS * step * (2.0 / half) ** 0.5) | (spread > SPREADS * step)
    # A joint that repeats its reading stands, whatever rounding does to the means.
    if np.any(moves & (spread > 1e-9)):
        return None
    return float(spread.max())
