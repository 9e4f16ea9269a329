"""The way that the joints take, whatever the time on it: a polyline in joint space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from what_if.geometry.bodies import FloatArray


class Way:
    """Joint positions along a parameter u: straight from each knot to the next.

    Args:
        knots: Joint positions, shape (k, n), k at least 1: [rad], prismatic [m].
        slack: What the true way may be off a straight piece in each joint, shape (n,); 0 where the
            way is straight.
    """

    def __init__(self, knots: FloatArray, slack: Sequence[float] | None = None) -> None:
        self.knots = np.asarray(knots, dtype=np.float64)
        self.slack = np.zeros(self.knots.shape[1]) if slack is None else np.array(slack)
        self._travelled = np.vstack(
            [np.zeros(self.knots.shape[1]), np.cumsum(np.abs(np.diff(self.knots, axis=0)), axis=0)]
        )

    @property
    def length(self) -> float:
        """The largest u: the number of pieces."""
        return float(len(self.knots) - 1)

    def at(self, u: FloatArray) -> FloatArray:
        """Return joint positions at many u, shape (m, n)."""
        return self._between(self.knots, u)

    def travelled(self, u: FloatArray) -> FloatArray:
        """Return how far each joint has gone up to u, to and fro both counted, shape (m, n)."""
        return self._between(self._travelled, u)

    def grid(self, reach: FloatArray, spacing: float) -> FloatArray:
        """Return u from 0 to the end, between two of which no point goes further than ``spacing``.

        Args:
            reach: How far points move for each unit of each joint, shape (n,).
            spacing: [m].
        """
        along = self._travelled @ reach
        if along[-1] <= 0.0:
            return np.array([0.0, self.length]) if self.length else np.array([0.0])
        count = int(np.ceil(along[-1] / spacing)) + 1
        # Where several knots share one place along the way, any u of them will do.
        found = np.interp(np.linspace(0.0, along[-1], count), along, np.arange(len(along)))
        found[0], found[-1] = 0.0, self.length
        return np.unique(found)

    def _between(self, rows: FloatArray, u: FloatArray) -> FloatArray:
        low = np.floor(u).astype(int)
        # Behind the end there is no knot.
        high = np.minimum(low + 1, len(rows) - 1)
        part = (np.asarray(u) - low)[:, None]
        found: FloatArray = rows[low] + part * (rows[high] - rows[low])
        return found


def straight(start: Sequence[float], end: Sequence[float]) -> Way:
    """Return the straight way between two joint positions."""
    return Way(np.array([start, end]))
