r"""User and tool frames, taught by points.

A frame's pose is :math:`T = (R_z(r) R_y(p) R_x(w), x)`, as a controller writes X Y Z W P R.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scara_config import Robot
from scara_config.frames import TaughtFrame

from scara_description.urdf import origin_transform

FloatArray = NDArray[np.float64]

LEAST_APART_MM = 10.0
"""Points of a frame are so far apart, and so far off one line (our choice): a pointer is set to
half a millimetre, which turns the frame by 3 deg at most."""
LEAST_TURN = math.radians(20.0)
"""A tool is turned by so much between its points, or its tip is lost in errors (our choice)."""
MOST_SPREAD_MM = 2.0
"""Further from each other the tips of a tool's points do not touch the same thing (our choice)."""
_TURNS_AT_LEAST = 0.02
"""Turns that move a tip less in a direction, by what they move it most, do not tell it there."""


class FrameError(ValueError):
    """A frame cannot be taught by these points; the text says which is wrong, and by how much."""


def pose_of(frame: TaughtFrame) -> FloatArray:
    """Return a frame's pose, shape (4, 4) [m]."""
    x, y, z = (1e-3 * value for value in frame.xyz_mm)
    w, p, r = map(math.radians, frame.wpr_deg)
    return origin_transform((x, y, z), (w, p, r))


def flange_in_tool(robot: Robot) -> FloatArray:
    r"""Return how the flange, by which tool frames are told, is turned in the frame ``tool_frame``.

    .. math:: R = R_{home}^T F

    The maker of a SCARA counts the turn of its flange by the base: with all joints at 0 it is F, x
    along that of the base, z down if the tool points down. ``home_pose`` says how ``tool_frame`` is
    turned there. The flange of another arm is its ``tool_frame``.

    Returns:
        Shape (3, 3).
    """
    if robot.geometry is None:
        return np.eye(3)
    home = np.array(robot.home_pose)[:3, :3]
    maker = np.diag((1.0, -1.0, -1.0)) if home[2, 2] < 0.0 else np.eye(3)
    return np.asarray(home.T @ maker)


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


def tool_tip(poses: Sequence[FloatArray]) -> tuple[FloatArray, float]:
    r"""Return the tip of a tool that touches one thing in several turns of the flange.

    .. math:: R_i t + p_i = R_j t + p_j

    by least squares. A direction in which no turn moves the tip is not known by it.

    Args:
        poses: At least three of the flange, see :func:`flange_in_tool`, shape (4, 4) [m].

    Returns:
        The tip by the flange, shape (3,) [m], and how far its points are apart [m].

    Raises:
        FrameError: Too few, hardly turned, all turned about one axis (as a SCARA's are: the tip
            along it cannot be found so), or the tips do not meet.
    """
    if len(poses) < 3:
        raise FrameError(f"{len(poses)} points: a tool is taught by three at least")
    turns = [pose[:3, :3] for pose in poses]
    for k, turn in enumerate(turns[1:], start=2):
        cosine = 0.5 * (float(np.trace(turns[0].T @ turn)) - 1.0)
        # Rounding may put a cosine beyond 1, where it has no angle.
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
    return tip, spread


def tool_frame(name: str, poses: Sequence[FloatArray]) -> TaughtFrame:
    """Return the frame of a tool by three points or by six.

    Three: its tip touches one thing, turned otherwise each time; the frame stays turned as the
    flange. Six: then the tip goes to a place, from there along the tool's x, and from there along
    its z, the flange turned as at that place.

    Args:
        name: Of the frame.
        poses: Of the flange, see :func:`flange_in_tool`, shape (4, 4) [m].

    Raises:
        FrameError: Another count, and as :func:`tool_tip` and :func:`user_frame`.
    """
    if len(poses) not in (3, 6):
        raise FrameError(f"{len(poses)} points: a tool frame is taught by three or six")
    pose = np.eye(4)
    pose[:3, 3], _ = tool_tip(poses[:3])
    if len(poses) == 6:
        begin, along, down = (each[:3, 3] for each in poses[3:])
        # The places are told in the base, the tool's axes by the flange.
        back = poses[3][:3, :3].T
        x, z = _axis("x", back @ (along - begin)), back @ (down - begin)
        z = _axis("z", z - x * float(x @ z))
        pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    return frame_of(name, pose)


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
