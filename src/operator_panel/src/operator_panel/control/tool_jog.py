r"""Jogging the tool along a line, or about one, while a button is held; pure.

The line begins where the tool is when the button is pressed. At each period the joints' velocities
are solved from the geometric Jacobian of the robot description:

.. math:: J \dot q = v_{line} + k \, e_\perp

with :math:`e_\perp` how far the tool has come off its line. They are scaled together, so that the
tool goes slower along its line rather than off it where a joint would be too fast or nears its
limit.

Source: Lynch & Park, Modern Robotics (2017), sec. 5.1; the correction and its gain are our choice.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scara_config import Joint, Robot
from scara_description.taught_frames import flange_in_tool

from operator_panel.config import ToolSpeeds
from operator_panel.control.jog import JogError, Where
from scara_description.urdf import Model, link_pose

LINES = ("x", "y", "z")
TURNS = ("rx", "ry", "rz")
FRAMES = ("world", "tool")
GAIN = 2.0  # our choice: [1/s] of what the tool is off its line; half of it is gone in 0.35 s
CORRECTION = 0.5  # our choice: the largest correction, as a share of the speed along the line
SLOWEST = 0.05  # our choice: a line that can only be followed slower than this share is refused
BRAKING_S = 0.3  # our choice: a joint nears its limit no faster than it would pass it in so long
SINGULAR = 1e-3  # our choice: m and rad alike; below it a direction of the tool is lost
STRETCHED = (
    "the arm is stretched out or folded here, the tool cannot go this way: jog a joint first"
)
ROUNDING = 0.99  # our choice: what is left of the limit for rounding


@dataclass(frozen=True)
class ToolArm:
    """The joints that move the tool, and where it is.

    Attributes:
        robot: Joints with their limits.
        model: Places of its links.
        speeds: How fast the tool goes.
        limit_percent: Largest share of a joint's speed.
        frames: Axes of user frames by their name, shape (3, 3).
    """

    robot: Robot
    model: Model
    speeds: ToolSpeeds
    limit_percent: float
    frames: dict[str, np.ndarray] = field(default_factory=dict, compare=False)

    def set_frames(self, frames: Mapping[str, np.ndarray]) -> None:
        """Take the user frames of now; a button that is held goes along those of its frame."""
        self.frames.update(frames)
        for gone in self.frames.keys() - frames.keys():
            del self.frames[gone]

    @property
    def joints(self) -> list[Joint]:
        """The joints between base and tool that the twin has."""
        return list(self.robot.arm_joints)

    @cached_property
    def axes(self) -> tuple[str, ...]:
        """What a button can move: a line for each axis, and turns if the arm can turn its tool.

        A SCARA of four joints turns it about z alone. An arm with too few joints for its turns
        lets its tool turn as it goes, as a move of it does; one of fewer than three has no line.
        """
        if len(self.joints) < len(LINES):
            return ()
        # Beside the middle: an arm whose range is even on both sides is straight there, so it would
        # look as if it could not turn or go.
        middle = {joint.name: 0.4 * joint.upper + 0.6 * joint.lower for joint in self.joints}
        jacobian = self._jacobian(middle)
        made = np.abs(jacobian[len(LINES) :]).max(axis=1) > SINGULAR
        axes = LINES + tuple(axis for axis, turns in zip(TURNS, made) if turns)
        can = len(self.joints) >= len(axes) and _least(jacobian[_rows(axes)]) > SINGULAR
        return axes if can else LINES

    def held(self, axis: str, frame: str, direction: int, fast: bool) -> ToolHeld:
        """Return what a button moves.

        Raises:
            JogError: There is no such axis, frame or direction.
        """
        if axis not in self.axes:
            raise JogError(f"axis = {axis!r}: the tool has {', '.join(self.axes)}")
        if frame not in (*FRAMES, *self.frames):
            known = ", ".join((*FRAMES, *self.frames))
            raise JogError(f"frame = {frame!r}: there are {known}")
        if direction not in (-1, 1):
            raise JogError(f"direction = {direction}: it is 1 or -1")
        if axis in LINES:
            speed = 1e-3 * (self.speeds.fast_mm_s if fast else self.speeds.slow_mm_s)
        else:
            speed = math.radians(self.speeds.fast_deg_s if fast else self.speeds.slow_deg_s)
        return ToolHeld(self, axis, frame, direction, speed)

    def axes_of(self, frame: str, tool: np.ndarray) -> np.ndarray:
        """Return the axes of a frame in the base, as columns, shape ``(3, 3)``.

        Args:
            frame: ``world``, ``tool``, or the name of a user frame.
            tool: Pose of the tool, shape ``(4, 4)``.

        Raises:
            JogError: The frame has been taken away meanwhile.
        """
        if frame in FRAMES:
            found: np.ndarray = tool[:3, :3] if frame == "tool" else np.eye(3)
            return found
        if frame not in self.frames:
            raise JogError(f"frame = {frame!r}: it is not there any longer")
        return self.frames[frame]

    def pose(self, positions: Mapping[str, float]) -> np.ndarray:
        """Return the tool's pose in the root, shape ``(4, 4)``."""
        return link_pose(self.model, self.robot.tool_frame, positions)

    def flange(self, positions: Mapping[str, float]) -> np.ndarray:
        """Return the flange in the root, by which tool frames are taught; shape ``(4, 4)``."""
        pose = self.pose(positions)
        pose[:3, :3] = pose[:3, :3] @ flange_in_tool(self.robot)
        return pose

    def solve(self, positions: Mapping[str, float], twist: np.ndarray) -> dict[str, float]:
        """Return joint velocities that move the tool by ``twist``, or a share of it.

        Args:
            positions: Of the joints [rad] or [m].
            twist: Velocity of the tool's origin [m/s] and angular velocity [rad/s] in the root,
                shape ``(6,)``.

        Raises:
            JogError: The tool cannot go this way from here, or hardly; the text says why.
        """
        qdot = self.joint_changes(positions, twist)
        share, slowest = 1.0, self.joints[0]
        for joint in self.joints:
            velocity, q = qdot[joint.name], positions[joint.name]
            # Below the joint's share of its speed, and slower before its limit.
            room = joint.upper - q if velocity > 0.0 else q - joint.lower
            most = ROUNDING * joint.velocity * self.limit_percent / 100.0
            allowed = min(most, max(room, 0.0) / BRAKING_S)
            if allowed < share * abs(velocity):
                share, slowest = allowed / abs(velocity), joint
        if share < SLOWEST:
            raise JogError(self._why_slow(slowest, positions[slowest.name]))
        return {name: share * velocity for name, velocity in qdot.items()}

    def joint_changes(self, positions: Mapping[str, float], twist: np.ndarray) -> dict[str, float]:
        """Return what the joints do for a twist of the tool, whatever their limits are.

        Args:
            positions: Of the joints [rad] or [m].
            twist: As for :meth:`solve`; or a small motion [m] and turn [rad] in place of both
                velocities, shape ``(6,)``.

        Raises:
            JogError: The arm is stretched out or folded: the tool cannot go every way.
        """
        rows = _rows(self.axes)
        jacobian = self._jacobian(positions)[rows]
        if _least(jacobian) < SINGULAR:
            raise JogError(STRETCHED)
        # Where there are more joints than the tool has ways to go, they move the least together.
        changes = np.linalg.lstsq(jacobian, twist[rows], rcond=None)[0]
        return {joint.name: float(change) for joint, change in zip(self.joints, changes)}

    def _why_slow(self, joint: Joint, q: float) -> str:
        near = min(joint.upper - q, q - joint.lower)
        if near < joint.velocity * self.limit_percent / 100.0 * BRAKING_S:
            low, high = joint.lower / joint.scale, joint.upper / joint.scale
            return (
                f"{joint.name} = {q / joint.scale:.2f} {joint.unit} is at the end of its range, "
                f"{low:g} to {high:g} {joint.unit}: go another way"
            )
        return STRETCHED

    def _jacobian(self, positions: Mapping[str, float]) -> np.ndarray:
        """Return the geometric Jacobian in the root: velocity, angular velocity; ``(6, n)``."""
        tool = self.pose(positions)[:3, 3]
        frames = {joint.name: joint for joint in self.model.joints}
        columns = []
        for joint in self.joints:
            frame = frames[joint.name]
            pose = link_pose(self.model, frame.child, positions)
            axis = pose[:3, :3] @ np.array(frame.axis)
            if frame.kind == "prismatic":
                columns.append(np.concatenate([axis, np.zeros(3)]))
            else:
                columns.append(np.concatenate([np.cross(axis, tool - pose[:3, 3]), axis]))
        return np.array(columns).T


@dataclass(frozen=True)
class ToolHeld:
    """The tool along a line, or about one.

    Attributes:
        arm: The joints.
        axis: x, y, z; rx, ry, rz: about it.
        frame: ``world``: axes of the base; ``tool``: those of the tool when the button was pressed;
            else those of a user frame.
        direction: 1 or -1.
        speed: [m/s] or [rad/s].
        start: Pose of the tool when the button was pressed; None before.
    """

    arm: ToolArm
    axis: str
    frame: str
    direction: int
    speed: float
    start: Any = None

    @property
    def what(self) -> str:
        """The tool's axis, its frame and the direction."""
        return f"{self.axis} {self.frame} {'+' if self.direction > 0 else '-'}"

    def begun(self, where: Where) -> ToolHeld:
        """Return the line that begins where the tool is."""
        return replace(self, start=self.arm.pose(where()))

    def as_fast_as(self, other: Any) -> ToolHeld:
        """Return the same line at another speed."""
        return replace(self, speed=other.speed)

    def velocities(self, where: Where) -> dict[str, float]:
        """Return the joints' velocities along the line, and back to it; see the module."""
        positions = where()
        now = self.arm.pose(positions)
        # The unit twist of the line.
        index = "xyz".index(self.axis[-1])
        axis = self.arm.axes_of(self.frame, self.start)[:, index]
        nothing = np.zeros(3)
        along = np.concatenate([axis, nothing] if self.axis in LINES else [nothing, axis])
        off = np.concatenate([self.start[:3, 3] - now[:3, 3], turn_between(self.start, now)])
        # What the tool is ahead or behind on its own line is the motion itself, and no error of it.
        off -= along * float(along @ off)
        back = GAIN * off
        for part in (slice(0, 3), slice(3, 6)):
            size = float(np.linalg.norm(back[part]))
            back[part] *= min(1.0, CORRECTION * self.speed / size) if size > 0.0 else 0.0
        return self.arm.solve(positions, self.direction * self.speed * along + back)


def turn_between(wanted: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Return the rotation from ``now`` to ``wanted`` as axis times angle, for small ones [rad]."""
    turned = wanted[:3, :3] @ now[:3, :3].T
    return 0.5 * np.array(
        [turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]
    )


def _rows(axes: tuple[str, ...]) -> list[int]:
    """Return where the axes stand in a twist."""
    return [(LINES + TURNS).index(axis) for axis in axes]


def _least(jacobian: np.ndarray) -> float:
    """Return the smallest singular value."""
    return float(np.linalg.svd(jacobian, compute_uv=False)[-1])
