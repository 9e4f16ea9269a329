"""A target in a user frame and for a tool frame, brought into the base."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scara_config import Robot
from scara_config.frames import FrameTable, TaughtFrame
from scara_description.taught_frames import flange_in_tool, pose_of

from scara_control.errors import ScaraControlError
from scara_control.kinematics.scara import Triple
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_control.kinematics.tool import ToolKinematics
from scara_control.kinematics.twists import FloatArray, exp6

_SAME_DEG = 1e-6
_PARALLEL = 1e-6
"""A flange leans that turns about an axis with a larger sine to its own."""


class BaseTargetError(ScaraControlError):
    """A target in a frame has no meaning for this arm; the text says why."""


class BaseTargets:
    """Brings targets in taught frames into the base."""

    def __init__(self, robot: Robot, tool: ToolKinematics) -> None:
        """Look at how the flange is turned where the tool's yaw is 0."""
        self._tool = tool
        # A SCARA counts its yaw from zero joints, another arm from home.
        straight = [robot.home[joint.name] * joint.scale for joint in tool.joints]
        if robot.geometry is not None:
            straight = [0.0] * len(straight)
        turn = forward_kinematics(ScrewModel.from_robot(robot), straight)[:3, :3]
        self._flange = turn @ flange_in_tool(robot)
        axes = [np.array(joint.screw_axis[:3]) for joint in tool.joints if joint.screw_axis]
        across = [np.linalg.norm(np.cross(axis, self._flange[:, 2])) for axis in axes]
        self._leans = robot.geometry is None and max(across, default=0.0) > _PARALLEL

    def in_base(
        self,
        table: FrameTable,
        point: Triple,
        yaw: float | None,
        frames: tuple[int, int],
        seed: Sequence[float],
    ) -> tuple[Triple, float | None]:
        """Return a target in the base and of the tool's own origin.

        Args:
            table: The frames.
            point: Of the tip, in the user frame [m].
            yaw: Of the flange, about the user frame's z [rad]; None: it stays as it is turned.
            frames: Numbers of the user frame and the tool; 0: the base, tool0.
            seed: The tool's joints where the motion begins.

        Returns:
            Where the tool's origin shall be in the base [m], and its yaw [rad]; None: it is kept.

        Raises:
            ConfigError: A frame was never taught.
            BaseTargetError: A yaw in a frame that is tilted; a tip beside the flange, or before one
                that leans, of an arm that cannot turn it.
        """
        number, tip_number = frames
        place = np.array(point)
        if number:
            frame = table.find("user", number)
            pose = pose_of(frame)
            place = pose[:3, :3] @ place + pose[:3, 3]
            if yaw is not None:
                if max(abs(frame.wpr_deg[0]), abs(frame.wpr_deg[1])) > _SAME_DEG:
                    raise BaseTargetError(
                        f"user frame {number} is tilted: a yaw is about the vertical"
                    )
                yaw += math.radians(frame.wpr_deg[2])
        if tip_number:
            place = place - self._offset(table.find("tool", tip_number), tip_number, yaw, seed)
        x, y, z = place.tolist()
        return (x, y, z), yaw

    def _offset(
        self, frame: TaughtFrame, number: int, yaw: float | None, seed: Sequence[float]
    ) -> FloatArray:
        """Return the way from the tool's own origin to the tip, in the base [m]."""
        tip = 1e-3 * np.array(frame.xyz_mm)
        where = "beside" if tip[0] or tip[1] else "before" if tip[2] and self._leans else ""
        if not self._tool.turns and where:
            raise BaseTargetError(
                f"tool frame {number} is {where} the flange, and this arm cannot turn its tool: "
                "use tool 0"
            )
        turned = yaw
        if turned is None:
            # As inverse() without a yaw: a SCARA keeps the seed's, another arm that of home.
            turned = self._tool.yaw(seed) if self._tool.elbow(seed) is not None else 0.0
        turn = exp6(np.array([0.0, 0.0, turned, 0.0, 0.0, 0.0]))[:3, :3]
        return np.asarray(turn @ self._flange @ tip)
