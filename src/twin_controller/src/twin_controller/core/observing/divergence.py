"""The alarm when real robot and twin come apart, with the lag removed.

While moving, the distance of the real tool from the twin's recent path counts: a follower that is late but on the path
does not diverge. At rest, the plain distance counts.
"""

from __future__ import annotations

import msgspec
import numpy as np
import numpy.typing as npt

from twin_controller.config import Divergence

Points = npt.NDArray[np.float64]


class DivergenceState(msgspec.Struct, frozen=True):
    """Last checks and the alarm; distances in mm."""

    recent: tuple[bool, ...] = ()
    alarm: bool = False
    distance_mm: float = 0.0


def path_distance(point: Points, path: Points) -> float:
    """Return the distance [m] of ``point`` (3,) from the polyline ``path`` (k, 3), k >= 1."""
    if len(path) == 1:
        return float(np.linalg.norm(point - path[0]))
    start, step = path[:-1], np.diff(path, axis=0)
    length = np.einsum("ij,ij->i", step, step)
    share = np.einsum("ij,ij->i", point - start, step) / np.where(length > 0.0, length, 1.0)
    nearest = start + np.clip(share, 0.0, 1.0)[:, None] * step
    return float(np.sqrt(np.min(np.einsum("ij,ij->i", point - nearest, point - nearest))))


def judge(state: DivergenceState, distance: float, limit_mm: float, config: Divergence) -> DivergenceState:
    """Count one check, k of n with hysteresis.

    Args:
        state: The last checks.
        distance: Distance of the tools [m].
        limit_mm: The limit that holds now (path or rest).
        config: confirm, window, release_ratio.
    """
    distance_mm = distance * 1e3
    limit = limit_mm * (config.release_ratio if state.alarm else 1.0)
    recent = (*state.recent, distance_mm > limit)[-config.window :]
    count = sum(recent)
    alarm = count > 0 if state.alarm else count >= config.confirm
    return DivergenceState(recent, alarm, distance_mm)
