"""``move_to`` in virtual time: inverse kinematics and the joint move, as motion_server."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from scara_config import Robot
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.tool import tool_kinematics
from scara_control.kinematics.tool_path import MoveWay, check_way, wanted_elbow
from scara_control.motion.requests import Outcome

Ended = Callable[[bool, str], None]


class BeginMove(Protocol):
    """The service ``joint_pose_controller/move``."""

    def __call__(
        self,
        target: Sequence[float],
        speed_percent: float,
        ended: Callable[[Outcome], None],
        names: Sequence[str],
        trims: bool,
        way: MoveWay | None,
    ) -> None:
        """Begin a joint move."""


class MoveTo:
    """One request at a time: the joint move of a newer one replaces that of the older."""

    def __init__(self, robot: Robot, move: BeginMove) -> None:
        """Wire it to the pose controller (``move``)."""
        self._move = move
        self._tool = tool_kinematics(robot)
        self._names = [joint.name for joint in self._tool.joints]
        self._columns = [robot.twin_joints.index(joint) for joint in self._tool.joints]
        self.measured: JointMotion | None = None

    def begin(
        self,
        point: Sequence[float],
        speed_percent: float,
        elbow: str,
        ended: Ended,
        yaw: float | None = None,
        path: str = "",
        speed_mm_s: float = 0.0,
    ) -> None:
        """Drive the tool to ``point`` [m] and ``yaw`` [rad]; ``ended`` is told how it ended."""
        if self.measured is None:
            ended(False, "no joint states")
            return
        try:
            x, y, z = point
            seed = [self.measured.q[k] for k in self._columns]
            side = wanted_elbow(self._tool, elbow, path, seed)
            answer = self._tool.inverse(x, y, z, side, seed, yaw)
            way = check_way(self._tool.joints, path, (), speed_mm_s)
        except ScaraControlError as error:
            ended(False, str(error))
            return

        def driven(outcome: Outcome) -> None:
            ended(outcome.success, outcome.message)

        self._move(answer.chosen.q, speed_percent, driven, self._names, True, way)
