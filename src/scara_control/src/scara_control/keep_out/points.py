"""The points of the arm that are watched: the tool, the elbow, whatever the profile names."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np
import numpy.typing as npt
from scara_config import ConfigError, Robot

from scara_control.keep_out.reach import largest_rates
from scara_control.kinematics.screws import (
    Point,
    ScrewModel,
    forward_kinematics_batch,
    tool_positions,
)

FloatArray = npt.NDArray[np.float64]
Joints = tuple[float, ...]
"""Joint positions in the order of the twin's joints, SI."""


class WatchedPoint(msgspec.Struct, frozen=True):
    """A point that moves with the first joints of the arm.

    Attributes:
        name: As in robot.yaml.
        model: The chain that carries it; the point is its tool.
        columns: The chain's joints among the twin's.
        rates: How far it moves at most by each of them; None: not known.
    """

    name: str
    model: ScrewModel
    columns: tuple[int, ...]
    rates: tuple[Point, ...] | None = None


def watched_points(robot: Robot) -> tuple[WatchedPoint, ...]:
    """Build the points of the profile.

    Raises:
        ConfigError: A point is carried by a joint that does not move the tool.
    """
    arm = robot.arm_joints
    names = [joint.name for joint in arm]
    columns = {joint.name: k for k, joint in enumerate(robot.twin_joints)}
    found = []
    for point in robot.watched_points:
        if point.carried_by not in names:
            raise ConfigError(
                f"robot.yaml: watched_points.{point.name}.carried_by = {point.carried_by}: "
                f"Expected {', '.join(names)}"
            )
        carriers = arm[: names.index(point.carried_by) + 1]
        home = np.eye(4)
        home[:3, 3] = np.array(point.home_mm) * 1e-3
        model = ScrewModel.from_joints(carriers, home)
        moved_by = tuple(columns[j.name] for j in carriers)
        found.append(WatchedPoint(point.name, model, moved_by, largest_rates(model)))
    return tuple(found)


def positions(point: WatchedPoint, q: FloatArray) -> FloatArray:
    """Return where the point is.

    Args:
        point: The point.
        q: Joint positions in the order of the twin's joints, shape (m, n), SI.

    Returns:
        Positions in the base frame [m], shape (m, 3).
    """
    return tool_positions(point.model, q[:, point.columns])


def all_positions(points: Sequence[WatchedPoint], q: FloatArray) -> FloatArray:
    """Return where all points are; those on one link cost little more than one.

    Args:
        points: The points.
        q: Joint positions in the order of the twin's joints, shape (m, n), SI.

    Returns:
        Positions in the base frame [m], shape (p, m, 3).
    """
    found = np.empty((len(points), len(q), 3))
    homes = np.array([point.model.home_pose[:3, 3] for point in points]).reshape(-1, 3)
    # Points on one link have one rotation: it is computed once, and their offsets are turned by it.
    links: dict[tuple[int, ...], list[int]] = {}
    for k, point in enumerate(points):
        links.setdefault(point.columns, []).append(k)
    for columns, members in links.items():
        poses = forward_kinematics_batch(points[members[0]].model, q[:, columns])
        offsets = homes[members] - homes[members[0]]
        found[members] = poses[:, :3, 3] + np.einsum("mij,kj->kmi", poses[:, :3, :3], offsets)
    return found
