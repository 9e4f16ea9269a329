"""The points of the arm that are watched: the tool, the elbow, whatever the profile names."""

from __future__ import annotations

import msgspec
import numpy as np
import numpy.typing as npt
from scara_config import ConfigError, Robot
from scara_control.kinematics.screws import ScrewModel, tool_positions

FloatArray = npt.NDArray[np.float64]


class WatchedPoint(msgspec.Struct, frozen=True):
    """A point that moves with the first joints of the arm."""

    name: str
    model: ScrewModel
    columns: tuple[int, ...]


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
                f"robot.yaml: watched_points.{point.name}.carried_by = {point.carried_by}: Expected {', '.join(names)}"
            )
        carriers = arm[: names.index(point.carried_by) + 1]
        home = np.eye(4)
        home[:3, 3] = np.array(point.home_mm) * 1e-3
        found.append(WatchedPoint(point.name, ScrewModel.from_joints(carriers, home), tuple(columns[j.name] for j in carriers)))
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
