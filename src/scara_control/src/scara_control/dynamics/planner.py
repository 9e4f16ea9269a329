"""Paths that stay inside the joints' efforts with what hangs at the tool.

A path is planned with the accelerations of robot.yaml. If it asks a joint for more than its effort
anywhere, it is planned again with less. Looking along the path and not at the worst pose of the
workspace leaves an arm that is folded, or moves one joint alone, all of its acceleration: at the
worst pose of all at once velocity coupling alone takes most of joint 1's effort.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from scara_config import Joint

from scara_control.dynamics.effort import LEAST, Load
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.tool import ToolKinematics
from scara_control.kinematics.tool_path import SolvedPath, ToolWay, solve_path
from scara_control.motion.plan import Path, Segment, plan_move, plan_stop
from scara_control.motion.tool_move import plan_tool_move

_TRIES = 8
"""So often a path is planned again (our choice: the three robots' moves need three or four)."""
_CLOSER = 0.995
"""The next try asks for so much of what the last one says is left (our choice): it ends soon."""
_HARD_STOP = 0.5
"""A stop gets at least this share of the accelerations: never more than twice as long, whatever it
asks for (our choice). Who stands at the robot comes first."""

Plan = Callable[[float], Path]
"""A path for a share of the accelerations, in (0, 1]."""


class Planner:
    """Plans moves and stops of all joints.

    Attributes:
        load: The arm with its payload; None: as light as robot.yaml's limits are made for.
    """

    def __init__(self, joints: Sequence[Joint], tool: ToolKinematics | None = None) -> None:
        """Begin without a load; without a ``tool`` there are joint moves alone."""
        self._joints, self._tool = tuple(joints), tool
        self.load: Load | None = None

    def move(
        self,
        start: JointMotion,
        target: Sequence[float],
        speed_percent: float,
        shape: ToolWay | None = None,
    ) -> Path:
        """Plan a move; see :func:`scara_control.motion.plan.plan_move`.

        If acceleration alone does not help enough, since velocity coupling asks for too much, the
        speed is lowered with it. With a ``shape`` the tool goes along a line or an arc, from where
        the joints come to rest; see :func:`scara_control.motion.tool_move.plan_tool_move`.

        Raises:
            PlanError: There is no such path.
            ToolPathError: The tool cannot go along the line.
        """
        joints = self._joints
        along: SolvedPath | None = None
        before: tuple[Segment, ...] = ()
        if shape is not None and self._tool is not None:
            if any(start.qdot) or any(start.qddot):
                stop = self.stop(start)
                start, before = JointMotion.at_rest(stop.end), stop.segments
            along = solve_path(self._tool, joints, start.q, target, shape)

        def plan(percent: float, share: float) -> Path:
            if along is None:
                path = plan_move(joints, start, target, percent, share)
                return Path([*before, *path.segments], target, share) if before else path
            move = plan_tool_move(joints, along, percent, share)
            return Path([*before, move], target, share, along.corners)

        fits, path = self._lighter(lambda share: plan(speed_percent, share))
        if path.share == 1.0:
            return path
        slower_fits, slower = self._lighter(lambda share: plan(speed_percent * share**0.5, share))
        if fits and (not slower_fits or path.duration <= slower.duration):
            return path
        return slower

    def stop(self, start: JointMotion, at_once: bool = False) -> Path:
        """Plan a stop; see :func:`scara_control.motion.plan.plan_stop`."""

        def plan(share: float) -> Path:
            return plan_stop(self._joints, start, share, at_once)

        return self._lighter(plan, _HARD_STOP)[1]

    def _lighter(self, plan: Plan, least: float = LEAST) -> tuple[bool, Path]:
        """Plan with as much acceleration as the efforts allow, and no less than ``least``.

        What a path asks for grows less than its acceleration, so each try comes nearer from above.

        Returns:
            Whether the path stays inside the efforts, and the path.
        """
        share, path = 1.0, plan(1.0)
        if self.load is None:
            return True, path
        for _ in range(_TRIES):
            demand = self.load.demand(path)
            if demand <= 1.0:
                return True, path
            if share == least:
                break
            share = max(least, share * _CLOSER / demand)
            path = plan(share)
        return self.load.demand(path) <= 1.0, path
