r"""Guiding the twin by hand: its tool goes after the pointer while that drags it; pure.

A jog whose velocity is solved at each period from how far the pointer has come:

.. math:: J \dot q = k (x_{pointer} - x_{tool}), \quad |v| \le v_{most}

level, with the tool turned as it was. Whatever ends a jog ends it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from operator_panel.control.jog import JogError, Where
from operator_panel.control.tool_jog import GAIN, ToolArm, turn_between

GRASP_MM = 80.0  # our choice: a finger's width in the picture of a phone
STIFF = 4.0  # our choice: [1/s] of the way to the pointer; half of it is gone in 0.2 s


@dataclass(frozen=True)
class GuidedTool:
    """The tool after a pointer.

    Attributes:
        arm: The joints.
        pointer: Where it is on the level of the tool: x, y in the base [m].
        grasp: From the pointer to the tool when it was taken hold of [m]: nothing jumps.
        start: Pose of the tool then; None before.
    """

    arm: ToolArm
    pointer: tuple[float, float]
    grasp: Any = None
    start: Any = None

    @property
    def what(self) -> str:
        """The tool, wherever the pointer is."""
        return "tool by hand"

    def begun(self, where: Where) -> GuidedTool:
        """Return the motion that begins where the tool is.

        Raises:
            JogError: The pointer is not on the tool, or the arm has no lines to go along.
        """
        if not self.arm.axes:
            raise JogError("this arm has too few joints to be guided: jog a joint")
        start = self.arm.pose(where())
        grasp = start[:2, 3] - self.pointer
        apart = 1e3 * math.hypot(*grasp)
        # Asked this way round so that a distance that is no number is refused too.
        if not apart <= GRASP_MM:
            raise JogError(f"the pointer is {apart:.0f} mm off the tool: take hold of the tool")
        return replace(self, grasp=grasp, start=start)

    def as_fast_as(self, other: Any) -> GuidedTool:
        """Return the same motion, to where the pointer is by now."""
        return replace(self, pointer=other.pointer)

    def velocities(self, where: Where) -> dict[str, float]:
        """Return the joints' velocities towards the pointer, at most as fast as the fast jog."""
        positions = where()
        now = self.arm.pose(positions)
        wanted = np.array([*(self.pointer + self.grasp), self.start[2, 3]])
        way = wanted - now[:3, 3]
        velocity = np.array([STIFF, STIFF, GAIN]) * way
        speed = float(np.linalg.norm(velocity))
        most = 1e-3 * self.arm.speeds.fast_mm_s
        if speed > most:
            velocity *= most / speed
        turn = GAIN * turn_between(self.start, now)
        return self.arm.solve(positions, np.concatenate([velocity, turn]))
