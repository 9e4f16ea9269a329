"""Paths that stay inside the joints' efforts with what hangs at the tool.

A path is planned with the accelerations of robot.yaml. If it asks a joint for more than its effort
anywhere, it is planned again with less. Looking along the path and not at the worst pose of the
workspace leaves an arm that is folded, or moves one joint alone, all of its acceleration: at the
worst pose of all at once velocity coupling alone takes most of joint 1's effort.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import msgspec
from scara_config import Joint

from scara_control.dynamics.effort import LEAST, Load
from scara_control.joint_motion import JointMotion, Vector
from scara_control.kinematics.scara import Triple
from scara_control.kinematics.tool import ToolKinematics
from scara_control.kinematics.tool_path import MoveWay, SolvedPath, solve_legs
from scara_control.limits import inside
from scara_control.motion.plan import Path, Segment, plan_move, plan_stop
from scara_control.motion.rounded import Passes, Rounded, round_corners
from scara_control.motion.tool_move import plan_tool_move

_TRIES = 8
"""So often a path is planned again (our choice: the three robots' moves need three or four)."""
_CLOSER = 0.995
"""The next try asks for so much of what the last one says is left (our choice): it ends soon."""
LOOKS = 40
"""Joint positions of a rounded way that are announced, for each leg (our choice: as many as a line
of 0.4 m has)."""
_SAME_SPEED = 1.001
"""The tool's speed in a corner exceeds the one asked for by no more than rounding."""
_HARD_STOP = 0.5
"""A stop gets at least this share of the accelerations: never more than twice as long, whatever it
asks for (our choice). Who stands at the robot comes first."""

Plan = Callable[[float], Path]
"""A path for a share of the accelerations, in (0, 1]."""


def _halved(joint: Joint) -> Joint:
    """Return a joint with half of its acceleration and jerk."""
    parts = [each for each in joint.__struct_fields__ if each.startswith(("acceleration", "jerk"))]
    return msgspec.structs.replace(joint, **{part: 0.5 * getattr(joint, part) for part in parts})


class Planner:
    """Plans moves and stops of all joints.

    Attributes:
        load: The arm with its payload; None: as light as robot.yaml's limits are made for.
    """

    def __init__(self, joints: Sequence[Joint], tool: ToolKinematics | None = None) -> None:
        """Begin without a load; without a ``tool`` there are joint moves alone."""
        self._joints, self._tool = tuple(joints), tool
        self._gentle = tuple(map(_halved, joints))
        self.load: Load | None = None

    def move(
        self,
        start: JointMotion,
        target: Sequence[float],
        speed_percent: float,
        way: MoveWay | None = None,
    ) -> Path:
        """Plan a move; see :func:`scara_control.motion.plan.plan_move`.

        If acceleration alone does not help enough, since velocity coupling asks for too much, the
        speed is lowered with it. On a line or an arc the tool goes from where the joints come to
        rest, within their limits; see :func:`scara_control.motion.tool_move.plan_tool_move`.
        Places that it passes are rounded; see :func:`scara_control.motion.rounded.round_corners`.

        Args:
            start: Any state.
            target: Joint positions, within the limits.
            speed_percent: Share of the joints' velocities, (0, 100].
            way: None: straight to the joints' targets.

        Raises:
            PlanError: There is no such path.
            ToolPathError: The tool cannot go along the line.
        """
        if way is None or self._tool is None:
            return self._leg(start, target, speed_percent)
        before: tuple[Segment, ...] = ()
        if way.path != "joint" and (any(start.qdot) or any(start.qddot)):
            stop = self.stop(start)
            start, before = JointMotion.at_rest(stop.end), stop.segments
        if way.path != "joint" and (begin := inside(self._joints, start.q)) != tuple(start.q):
            back = self._leg(start, begin, speed_percent)
            start, before = JointMotion.at_rest(begin), (*before, *back.segments)
        solved = solve_legs(self._tool, self._joints, start.q, target, way)
        if not way.passed:
            leg = self._leg(start, target, speed_percent, solved[0][1])
            return Path([*before, *leg.segments], target, leg.share, leg.corners)
        variants = []
        # With all of its acceleration a leg is quicker but overlaps less: the way decides.
        for gentle in (False, True) if way.corner_mm else (False,):
            begins = [start, *map(JointMotion.at_rest, way.passed)]
            legs = [
                self._leg(begin, end, speed_percent, along, gentle)
                for begin, (end, along) in zip(begins, solved)
            ]
            variants.append((self._rounded(legs, speed_percent, way), legs))
        rounded, legs = min(variants, key=lambda variant: variant[0].duration)
        count = LOOKS * len(legs)
        # The legs' own corners will not do: what is rounded passes beside them.
        seen = [tuple(rounded.at_time(rounded.duration * k / count)[0]) for k in range(count)]
        share = min(leg.share for leg in legs)
        return Path([*before, rounded], target, share, (*seen, tuple(target)))

    def _rounded(self, legs: Sequence[Path], speed_percent: float, way: MoveWay) -> Rounded:
        """Round the corners between legs."""
        tool, load = self._tool, self.load
        assert tool is not None
        columns = [self._joints.index(joint) for joint in tool.joints]

        def place(q: Sequence[float]) -> Triple:
            return tool.position([q[column] for column in columns])

        def passes(corner: Triple) -> Passes:
            def as_it_may(qs: Sequence[Vector], step: float) -> bool:
                places = [place(q) for q in qs]
                if any(math.dist(each, corner) > 1e-3 * way.corner_mm for each in places):
                    return False
                most = 1e-3 * way.speed_mm_s * step * _SAME_SPEED if way.speed_mm_s else math.inf
                return all(math.dist(*both) <= most for both in pairwise(places))

            return as_it_may

        def bearable(motion: JointMotion) -> bool:
            return load is None or max(load.shares(motion)) <= 1.0

        if not way.corner_mm:
            return Rounded(legs, [0.0] * (len(legs) - 1))
        corners = [passes(place(leg.end)) for leg in legs[:-1]]
        return round_corners(self._joints, legs, speed_percent, corners, bearable)

    def _leg(
        self,
        start: JointMotion,
        target: Sequence[float],
        speed_percent: float,
        along: SolvedPath | None = None,
        gentle: bool = False,
    ) -> Path:
        """Plan a move to one place, with as much acceleration and speed as the efforts allow.

        Two that are ``gentle`` may overlap anywhere: each takes half of a joint's acceleration and
        jerk. Others may only where their joints do not turn back.
        """
        joints = self._gentle if gentle else self._joints

        def plan(percent: float, share: float) -> Path:
            if along is None:
                return plan_move(joints, start, target, percent, share)
            move = plan_tool_move(joints, along, percent, share)
            return Path([move], target, share, along.corners)

        fits, path = self._lighter(lambda share: plan(speed_percent, share))
        if path.share == 1.0:
            return path
        # Velocity coupling goes by the square of the speed: so it falls as acceleration does.
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
