r"""Corners between moves: the next one begins before the one in front of it has ended.

Leg k leads from :math:`p_k` to :math:`p_{k+1}` and begins at the time :math:`t_k`. While two of
them overlap, what is left of the one and what is done of the other add up:

.. math:: q(t) = q_k(t - t_k) + q_{k-1}(t - t_{k-1}) - p_k

So the joints leave the first leg with its own acceleration and come into the next with that one's;
no curve is fitted between them. They overlap for as long as the tool stays near the corner and no
joint exceeds its limits, and for no more than half of either leg.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from scara_config import Joint

from scara_control.joint_motion import JointMotion, Vector
from scara_control.limits import LIMIT_TOLERANCE
from scara_control.motion.plan import Path

LOOKS = (12, 60)
"""Looks at an overlap, few and then many (our choice: few show most that do not fit)."""
_HALVINGS = 7
"""So often an overlap is halved in search of the longest (our choice: to a hundredth of it)."""
_SLACK = 1.001
"""Limits of speed and acceleration are exceeded by no more than rounding."""

Passes = Callable[[Sequence[Vector], float], bool]
"""Whether the tool passes a corner as it may, by joint positions and the time between two [s]."""
Bearable = Callable[[JointMotion], bool]
"""Whether the joints' efforts can make a motion."""


class Rounded:
    """Legs in a row as one segment of a path."""

    __slots__ = ("_begins", "_legs", "duration")

    def __init__(self, legs: Sequence[Path], overlaps: Sequence[float]) -> None:
        """Let each leg begin so long before the end of the one in front of it [s]."""
        self._legs, self._begins = tuple(legs), [0.0]
        for leg, overlap in zip(legs, overlaps):
            self._begins.append(self._begins[-1] + leg.duration - overlap)
        self.duration: float = self._begins[-1] + legs[-1].duration

    def at_time(self, time: float) -> tuple[Vector, Vector, Vector]:
        """Return positions, velocities and accelerations at a time of no less than 0 [s]."""
        k = bisect_right(self._begins, time) - 1
        now = self._legs[k].at(time - self._begins[k])
        if not k:
            return now.q, now.qdot, now.qddot
        before = self._legs[k - 1]
        left = before.at(time - self._begins[k - 1])
        return (
            tuple(q + r - end for q, r, end in zip(now.q, left.q, before.end)),
            tuple(v + r for v, r in zip(now.qdot, left.qdot)),
            tuple(a + r for a, r in zip(now.qddot, left.qddot)),
        )


def round_corners(
    joints: Sequence[Joint],
    legs: Sequence[Path],
    speed_percent: float,
    passes: Sequence[Passes],
    bearable: Bearable,
) -> Rounded:
    """Let each leg begin as early as its corner allows.

    Args:
        joints: Limits of position, velocity, acceleration and jerk.
        legs: Each from where the one in front of it ends, at rest.
        speed_percent: Share of the joints' velocities, (0, 100].
        passes: For each corner.
        bearable: See above; what a leg asks for by itself is never judged.
    """
    velocities = np.array([joint.velocity for joint in joints]) * speed_percent / 100.0
    accelerations = np.array([joint.acceleration for joint in joints])
    jerks = np.array([joint.jerk for joint in joints])
    lower = np.array([joint.lower for joint in joints]) - LIMIT_TOLERANCE
    upper = np.array([joint.upper for joint in joints]) + LIMIT_TOLERANCE

    def fits(before: Path, after: Path, passes: Passes, overlap: float) -> bool:
        pair = Rounded((before, after), (overlap,))
        begin = before.duration - overlap
        for looks in LOOKS:
            step = overlap / looks
            found = [JointMotion(*pair.at_time(begin + step * k)) for k in range(looks + 1)]
            q, qdot, qddot = (np.array([getattr(m, name) for m in found]) for name in _FIELDS)
            if not (
                passes([m.q for m in found], step)
                and ((q >= lower) & (q <= upper)).all()
                and (np.abs(qdot) <= _SLACK * velocities).all()
                and (np.abs(qddot) <= _SLACK * accelerations).all()
                and (np.abs(np.diff(qddot, axis=0)) <= _SLACK * jerks * step).all()
                # At both ends one leg moves alone.
                and all(map(bearable, found[1:-1]))
            ):
                return False
        return True

    overlaps = []
    for (before, after), corner in zip(pairwise(legs), passes):
        low, high = 0.0, 0.5 * min(before.duration, after.duration)
        if high and fits(before, after, corner, high):
            low = high
        for _ in range(_HALVINGS if low < high else 0):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if fits(before, after, corner, middle) else (low, middle)
        overlaps.append(low)
    return Rounded(legs, overlaps)


_FIELDS = ("q", "qdot", "qddot")
