"""The points of the arm that are watched: the tool, the elbow, and its body piece by piece."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np
import numpy.typing as npt
from scara_config import Robot

from scara_control.keep_out.body import Place, body_parts, read_body
from scara_control.keep_out.reach import largest_rates
from scara_control.kinematics.screws import (
    Point,
    ScrewModel,
    forward_kinematics_batch,
    tool_positions,
)
from scara_description.urdf import link_pose

FloatArray = npt.NDArray[np.float64]
Joints = tuple[float, ...]
"""Joint positions in the order of the twin's joints, SI."""


class WatchedPoint(msgspec.Struct, frozen=True):
    """A point that moves with the first joints of the arm.

    Attributes:
        name: ``tool``, ``elbow``, else that of its link or joint.
        model: The chain that carries it; the point is its tool.
        columns: The chain's joints among the twin's.
        rates: How far it moves at most by each of them; None: not known.
        half: Half edges of the box around it, along the base frame in every pose, that no zone may
            touch [m].
    """

    name: str
    model: ScrewModel
    columns: tuple[int, ...]
    rates: tuple[Point, ...] | None = None
    half: Place = (0.0, 0.0, 0.0)


def watched_points(robot: Robot) -> tuple[WatchedPoint, ...]:
    """Derive the points from the profile and the body of its URDF.

    First the tool, then a point on each axis about which it turns, then the body.

    Raises:
        ConfigError: The URDF cannot be read, is not of this profile, or leaves a link without body.
    """
    arm, model = robot.arm_joints, read_body(robot)
    parts = body_parts(robot, model)
    columns = {joint.name: k for k, joint in enumerate(robot.twin_joints)}

    def point(name: str, carriers: int, place: Sequence[float], half: Place) -> WatchedPoint:
        home = np.eye(4)
        home[:3, 3] = place
        chain = ScrewModel.from_joints(arm[:carriers], home)
        moved_by = tuple(columns[joint.name] for joint in arm[:carriers])
        return WatchedPoint(name, chain, moved_by, largest_rates(chain), half)

    nothing = (0.0, 0.0, 0.0)
    found = [point("tool", len(arm), [row[3] for row in robot.home_pose[:3]], nothing)]
    frames = {joint.name: joint.child for joint in model.joints}
    turning = [joint for joint in arm if joint.si_unit == "rad"]
    for k, joint in enumerate(arm):
        # No joint moves a point on the first axis.
        if k > 0 and joint.si_unit == "rad":
            name = "elbow" if robot.geometry and joint is turning[1] else joint.name
            place = link_pose(model, frames[joint.name], {})[:3, 3]
            # The joints before it carry it: its own does not move a point on its axis.
            found.append(point(name, k, place.tolist(), nothing))
    number = {joint.name: k + 1 for k, joint in enumerate(arm)}
    found += [point(p.link, number[p.carried_by], p.middle, p.half) for p in parts]
    return tuple(found)


def speed_points(points: Sequence[WatchedPoint]) -> tuple[WatchedPoint, ...]:
    """Return the points whose speed counts: the tool and the axes, not the body around them."""
    return tuple(point for point in points if not any(point.half))


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
    homes = np.array([point.model.home_origin for point in points]).reshape(-1, 3)
    # Points on one link have one rotation: it is computed once, and their offsets are turned by it.
    links: dict[tuple[int, ...], list[int]] = {}
    for k, point in enumerate(points):
        links.setdefault(point.columns, []).append(k)
    for columns, members in links.items():
        poses = forward_kinematics_batch(points[members[0]].model, q[:, columns])
        offsets = homes[members] - homes[members[0]]
        # One product of all rows: einsum takes twenty times as long for it.
        turned = (poses[:, :3, :3].reshape(-1, 3) @ offsets.T).reshape(len(q), 3, -1)
        found[members] = poses[:, :3, 3] + turned.transpose(2, 0, 1)
    return found
