"""The figures of a verdict, gathered leg by leg."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from what_if.geometry.sweep import Swept
from what_if.timing.use import Use
from what_if.verdict import Clearance, JointUse, Outcome, Reason, Verdict

MM = 1e-3


class Figures:
    """The largest and smallest of everything so far.

    Args:
        joints: Number of joints.
    """

    def __init__(self, joints: int) -> None:
        self._shares = np.zeros((3, joints))
        self._speed, self._point, self._work = 0.0, "", 0.0
        self._clearance: Clearance | None = None
        self._zones: list[str] = []
        self.placed: list[str] = []
        self.dropped: list[str] = []

    def add_use(self, use: Use) -> None:
        """Take in what a leg asks of the joints."""
        rows = np.array((use.speed, use.acceleration, use.effort))
        self._shares = np.maximum(self._shares, rows)
        self._work += use.work
        if use.point_speed > self._speed:
            self._speed, self._point = use.point_speed, use.point

    def add_clearance(self, swept: Swept, between: tuple[str, str], time: float) -> None:
        """Take in the smallest clearance of a leg."""
        assert swept.nearest is not None
        now = self._clearance
        # The bound of the whole is the weakest of all legs, whichever has the smallest clearance.
        sure = swept.at_least / MM if now is None else min(swept.at_least / MM, now.at_least_mm)
        distance = max(swept.nearest.distance, 0.0) / MM
        if now is None or distance < now.distance_mm:
            self._clearance = Clearance(distance, sure, between, time)
        else:
            self._clearance = Clearance(now.distance_mm, sure, now.between, now.time_s)

    def add_zone(self, name: str) -> None:
        """Take in a zone that is touched."""
        if name not in self._zones:
            self._zones.append(name)

    def verdict(
        self,
        joints: Sequence[str],
        outcome: Outcome,
        reasons: tuple[Reason, ...],
        duration: float,
        spread: float,
        target: tuple[float, ...],
    ) -> Verdict:
        """Return all of it as a verdict."""
        uses = tuple(
            JointUse(name, *(100.0 * self._shares[:, k]).tolist()) for k, name in enumerate(joints)
        )
        return Verdict(
            outcome,
            reasons,
            duration,
            spread,
            self._clearance,
            uses,
            self._speed / MM,
            self._point,
            tuple(self._zones),
            tuple(self.placed),
            tuple(self.dropped),
            self._work,
            target,
        )
