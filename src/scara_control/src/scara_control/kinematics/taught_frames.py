r"""User and tool frames: taught by points, and a target in them brought into the base.

A frame's pose is :math:`T = (R_z(r) R_y(p) R_x(w), x)`, as a controller writes X Y Z W P R.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scara_config import Robot
from scara_config.frames import FrameTable, TaughtFrame

from scara_control.errors import ScaraControlError
from scara_control.kinematics.scara import Triple
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_control.kinematics.tool import ToolKinematics
from scara_control.kinematics.twists import FloatArray

LEAST_APART_MM = 10.0
"""Points of a frame are so far apart, and so far off one line (our choice): a pointer is set to
half a millimetre, which turns the frame by 3 deg at most."""
LEAST_TURN = math.radians(20.0)
"""A tool is turned by so much between its points, or its tip is lost in errors (our choice)."""
MOST_SPREAD_MM = 2.0
"""Further from each other the tips of a tool's points do not touch the same thing (our choice)."""
_SAME_DEG = 1e-6
_TURNS_AT_LEAST = 0.02
"""Turns that move a tip less in a direction, by what they move it most, do not tell it there."""


class FrameError(ScaraControlError):
    """A frame cannot be taught by these points, or a target in it has no meaning for this arm."""


class InBase(NamedTuple):
    """Where the tool's origin shall be in the base [m], and its yaw [rad]; None: as it is kept."""

    point: Triple
    yaw: float | None


class TaughtTip(NamedTuple):
    """The tip of a tool by the flange, shape (3,) [mm], and how far its points are apart [mm]."""

    xyz_mm: tuple[float, float, float]
    spread_mm: float


def pose_of(frame: TaughtFrame) -> FloatArray:
    """Return a frame's pose, shape (4, 4) [m]."""
    w, p, r = (math.radians(angle) for angle in frame.wpr_deg)
    x_turn, y_turn, z_turn = _turn(0, w), _turn(1, p), _turn(2, r)
    pose = np.eye(4)
    pose[:3, :3] = z_turn @ y_turn @ x_turn
    pose[:3, 3] = 1e-3 * np.array(frame.xyz_mm)
    return pose


def frame_of(name: str, pose: FloatArray) -> TaughtFrame:
    """Return a pose, shape (4, 4) [m], as a frame."""
    turn = pose[:3, :3]
    p = math.atan2(-turn[2, 0], math.hypot(turn[0, 0], turn[1, 0]))
    if abs(math.cos(p)) > 1e-9:
        w = math.atan2(turn[2, 1], turn[2, 2])
        r = math.atan2(turn[1, 0], turn[0, 0])
    else:
        # Upright: only the sum or difference of W and R counts.
        w, r = math.atan2(turn[0, 1], turn[1, 1]) * math.copysign(1.0, p), 0.0
    x, y, z = (1e3 * pose[:3, 3]).tolist()
    return TaughtFrame(name, (x, y, z), (math.degrees(w), math.degrees(p), math.degrees(r)))


def user_frame(name: str, points: Sequence[Sequence[float]]) -> TaughtFrame:
    """Return the frame of three points: its origin, one along x, one in the xy plane towards y.

    A fourth moves the origin to it; the frame stays turned as the three say.

    Args:
        name: Of the frame.
        points: Three or four places of the tip in the base [m].

    Raises:
        FrameError: Another count, or they are too near to each other or to one line.
    """
    if len(points) not in (3, 4):
        raise FrameError(f"{len(points)} points: a user frame is taught by three or four")
    origin, along, plane = (np.array(point, dtype=float) for point in points[:3])
    x, y = _axis("x", along - origin), plane - origin
    y = _axis("y", y - x * float(x @ y))
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([x, y, np.cross(x, y)])
    pose[:3, 3] = points[3] if len(points) == 4 else origin
    return frame_of(name, pose)


def tool_tip(poses: Sequence[FloatArray]) -> TaughtTip:
    r"""Return the tip of a tool that touches one thing in several turns of the flange.

    .. math:: R_i t + p_i = R_j t + p_j

    by least squares. A direction in which no turn moves the tip is not known by it.

    Args:
        poses: At least three of the frame ``tool_frame``, shape (4, 4) [m].

    Raises:
        FrameError: Too few, hardly turned, all turned about one axis (as a SCARA's are: the tip
            along it cannot be found so), or the tips do not meet.
    """
    if len(poses) < 3:
        raise FrameError(f"{len(poses)} points: a tool is taught by three at least")
    turns = [pose[:3, :3] for pose in poses]
    for k, turn in enumerate(turns[1:], start=2):
        cosine = 0.5 * (float(np.trace(turns[0].T @ turn)) - 1.0)
        if math.acos(min(max(cosine, -1.0), 1.0)) < LEAST_TURN:
            raise FrameError(
                f"point {k} is turned by less than {math.degrees(LEAST_TURN):.0f} deg from point 1"
            )
    pairs = [(0, k) for k in range(1, len(poses))] + [(1, k) for k in range(2, len(poses))]
    rows = np.vstack([turns[i] - turns[j] for i, j in pairs])
    right = np.concatenate([poses[j][:3, 3] - poses[i][:3, 3] for i, j in pairs])
    values, ways = np.linalg.svd(rows)[1:]
    known = ways[values > _TURNS_AT_LEAST * values[0]]
    tip = known.T @ np.linalg.lstsq(rows @ known.T, right, rcond=None)[0]
    tips = np.array([turn @ tip + pose[:3, 3] for turn, pose in zip(turns, poses)])
    spread = float(np.linalg.norm(tips - tips.mean(axis=0), axis=1).max())
    if 1e3 * spread > MOST_SPREAD_MM:
        raise FrameError(
            f"the tips are {1e3 * spread:.1f} mm apart, allowed are {MOST_SPREAD_MM:g}: touch the "
            "same thing with the same tip"
        )
    x, y, z = (1e3 * tip).tolist()
    return TaughtTip((x, y, z), 1e3 * spread)


def tool_frame(name: str, poses: Sequence[FloatArray]) -> TaughtFrame:
    """Return the frame of a tool by three points or by six.

    Three: its tip touches one thing, turned otherwise each time; the frame stays turned as the
    flange. Six: then the tip goes to a place, from there along the tool's x, and from there along
    its z, the flange turned as at that place.

    Args:
        name: Of the frame.
        poses: Of the frame ``tool_frame``, shape (4, 4) [m].

    Raises:
        FrameError: Another count, and as :func:`tool_tip` and :func:`user_frame`.
    """
    if len(poses) not in (3, 6):
        raise FrameError(f"{len(poses)} points: a tool frame is taught by three or six")
    pose = np.eye(4)
    pose[:3, 3] = 1e-3 * np.array(tool_tip(poses[:3]).xyz_mm)
    if len(poses) == 6:
        begin, along, down = (each[:3, 3] for each in poses[3:])
        back = poses[3][:3, :3].T
        x, z = _axis("x", back @ (along - begin)), back @ (down - begin)
        z = _axis("z", z - x * float(x @ z))
        pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return frame_of(name, pose)


class BaseTargets:
    """Brings targets in taught frames into the base."""

    def __init__(self, robot: Robot, tool: ToolKinematics) -> None:
        """Look at how the flange is turned where the tool's yaw is 0."""
        self._tool = tool
        if robot.geometry is not None:
            # A SCARA's flange is turned by the sum of its turning joints, as its maker counts it.
            down = robot.home_pose[2][2] < 0.0
            self._flange = np.diag((1.0, -1.0, -1.0)) if down else np.eye(3)
        else:
            home = [robot.home[joint.name] * joint.scale for joint in tool.joints]
            self._flange = forward_kinematics(ScrewModel.from_robot(robot), home)[:3, :3]

    def in_base(
        self,
        table: FrameTable,
        point: Triple,
        yaw: float | None,
        frames: tuple[int, int],
        seed: Sequence[float],
    ) -> InBase:
        """Return a target in the base and of the tool's own origin.

        Args:
            table: The frames.
            point: Of the tip, in the user frame [m].
            yaw: Of the flange, about the user frame's z [rad]; None: it stays as it is turned.
            frames: Numbers of the user frame and the tool; 0: the base, tool0.
            seed: The tool's joints where the motion begins.

        Raises:
            ConfigError: A frame was never taught.
            FrameError: A yaw in a frame that is tilted, or a tip beside the flange of an arm that
                cannot turn it.
        """
        number, tip_number = frames
        place = np.array(point)
        if number:
            frame = table.find("user", number)
            pose = pose_of(frame)
            place = pose[:3, :3] @ place + pose[:3, 3]
            if yaw is not None:
                if max(abs(frame.wpr_deg[0]), abs(frame.wpr_deg[1])) > _SAME_DEG:
                    raise FrameError(f"user frame {number} is tilted: a yaw is about the vertical")
                yaw += math.radians(frame.wpr_deg[2])
        if tip_number:
            place = place - self._offset(table.find("tool", tip_number), tip_number, yaw, seed)
        x, y, z = place.tolist()
        return InBase((x, y, z), yaw)

    def _offset(
        self, frame: TaughtFrame, number: int, yaw: float | None, seed: Sequence[float]
    ) -> FloatArray:
        """Return the way from the tool's own origin to the tip, in the base [m]."""
        tip = 1e-3 * np.array(frame.xyz_mm)
        if not self._tool.turns and max(abs(tip[0]), abs(tip[1])) > 0.0:
            raise FrameError(
                f"tool frame {number} is beside the flange, and this arm cannot turn its tool: use "
                "tool 0"
            )
        turned = yaw
        if turned is None:
            turned = self._tool.yaw(seed) if self._tool.elbow(seed) is not None else 0.0
        return np.asarray(_turn(2, turned) @ self._flange @ tip)


def _turn(axis: int, angle: float) -> FloatArray:
    """Return the rotation about an axis of the base."""
    c, s = math.cos(angle), math.sin(angle)
    found = np.eye(3)
    one, other = (axis + 1) % 3, (axis + 2) % 3
    found[one, one] = found[other, other] = c
    found[one, other], found[other, one] = -s, s
    return found


def _axis(name: str, way: FloatArray) -> FloatArray:
    """Return a direction of length 1.

    Raises:
        FrameError: The way is too short to tell it.
    """
    length = float(np.linalg.norm(way))
    if 1e3 * length < LEAST_APART_MM:
        raise FrameError(
            f"the point for {name} is {1e3 * length:.1f} mm off: at least {LEAST_APART_MM:g} mm "
            "from the origin, and from the line of x, are needed"
        )
    return way / length
