"""How far the tools of both sides are turned against each other, beside how far they are apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scara_control.kinematics.screws import ScrewModel, forward_kinematics_batch

from twin_experiments.metrics.errors import Comparison
from twin_experiments.metrics.series import Array


@dataclass(frozen=True)
class AngleErrors:
    """Largest angle between both tools at the same instant of one clock [deg].

    Args:
        path_max_deg: While either side moves.
        rest_max_deg: While both stand still; None: they never did long enough.
    """

    path_max_deg: float
    rest_max_deg: float | None


def angles_between(arm: ScrewModel, q: Array, other: Array) -> Array:
    r"""Return the angle of the rotation from one tool's orientation to the other's.

    .. math:: |R - R'|_F = 2 \sqrt{2} \sin(\theta / 2)

    Args:
        arm: Screw axes and home pose.
        q: Joint positions of one side, shape ``(m, n)``: [rad], prismatic [m].
        other: Of the other side, likewise.

    Returns:
        Angles in [0, pi], shape ``(m,)`` [rad].
    """
    one, two = (forward_kinematics_batch(arm, each)[:, :3, :3] for each in (q, other))
    chord = np.linalg.norm((one - two).reshape(-1, 9), axis=1) / np.sqrt(8.0)
    # At half a turn rounding may leave arcsin's domain.
    return np.asarray(2.0 * np.arcsin(np.minimum(chord, 1.0)))


def angle_errors(comparison: Comparison, arm: ScrewModel) -> AngleErrors:
    """Measure how far the tools were turned against each other, over the moves and the rests.

    Args:
        comparison: Both sides, in which at least one moved.
        arm: The joints that move the tool.
    """
    seen = comparison.trace
    aligned = seen.aligned
    degrees = np.degrees(angles_between(arm, aligned.real.positions, aligned.twin.positions))
    rests = [
        degrees[(rest.start <= aligned.instants) & (aligned.instants <= rest.end)].max()
        for rest in comparison.rests
    ]
    return AngleErrors(float(degrees[seen.moving].max()), float(max(rests)) if rests else None)
