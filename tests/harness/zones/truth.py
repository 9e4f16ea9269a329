"""Where a SCARA's body is, and how far from a box: closed forms of our own.

Nothing of the core is used: shapes and axes are those of the robot's URDF.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scara_config import Robot

from scara_description.urdf import Shape, link_pose, origin_transform, parse_urdf

CELL = 0.075
"""Longest piece of a beam, as in keep_out/body.py."""
Rows = npt.NDArray[np.float64]
Place = tuple[float, float, float]


@dataclass(frozen=True)
class Upright:
    """An upright axis of the arm.

    Attributes:
        column: Its joint among the twin's.
        at: Where it stands; None: it slides.
        sign: 1: counts upwards, or to the left.
    """

    column: int
    at: tuple[float, float] | None
    sign: float


@dataclass(frozen=True)
class Point:
    """A watched point: where it is with all joints at 0, half the box around it, what moves it."""

    middle: Place
    half: Place
    # Base to point.
    axes: tuple[Upright, ...]


@dataclass(frozen=True)
class Body:
    """The tool, the elbow, then the pieces of all links that move with the arm."""

    points: tuple[Point, ...]

    @classmethod
    def of(cls, robot: Robot) -> Body:
        """Read the URDF of a robot whose axes are all upright."""
        model = parse_urdf(robot.description.read_text(encoding="utf-8"), seen=False)
        columns = {joint.name: k for k, joint in enumerate(robot.twin_joints)}
        arm = [joint.name for joint in robot.arm_joints]
        axes, places = {}, {}
        for joint in model.joints:
            if joint.name in arm:
                pose = link_pose(model, joint.child, {})
                up = pose[:3, :3] @ joint.axis
                assert math.isclose(abs(up[2]), 1.0), f"{joint.name} is not upright"
                x, y, z = pose[:3, 3].tolist()
                slides = joint.kind == "prismatic"
                axis = Upright(columns[joint.name], None if slides else (x, y), float(up[2]))
                axes[joint.name], places[joint.name] = axis, (x, y, z)
        chain = tuple(axes[name] for name in arm)
        x, y, z = link_pose(model, robot.tool_frame, {})[:3, 3].tolist()
        nothing = (0.0, 0.0, 0.0)
        found = [Point((x, y, z), nothing, chain), Point(places[arm[1]], nothing, chain[:1])]
        for link, shapes in model.shapes.items():
            moved = tuple(axes[each.name] for each in model.chain(link) if each.name in axes)
            for shape in shapes if moved else ():
                pose = link_pose(model, link, {}) @ origin_transform(shape.xyz, shape.rpy)
                found += [Point(middle, half, moved) for middle, half in _pieces(shape, pose)]
        return cls(tuple(found))

    @cached_property
    def half(self) -> Rows:
        """Half edges of the boxes, shape (points, 3)."""
        return np.array([point.half for point in self.points])

    def watched(self, q: Rows) -> Rows:
        """Return where the points are, shape (points, m, 3), by joint positions, shape (m, n)."""
        return np.array([_moved(point, q) for point in self.points])

    def bend(self, q: Sequence[float]) -> float:
        """Return the sine of the elbow's turn to the left."""
        elbow = [axis for axis in self.points[0].axes if axis.at is not None][1]
        return math.sin(elbow.sign * q[elbow.column])

    def yaw(self, q: Sequence[float]) -> float:
        """Return how far the tool is turned from zero joints [rad]."""
        return sum(a.sign * q[a.column] for a in self.points[0].axes if a.at is not None)

    def clearance(self, points: Rows, lower: Sequence[float], upper: Sequence[float]) -> float:
        """Return by how much a box may grow on all sides until a part of the arm is in it [m].

        Less than 0 by how deep a part is inside. By faces, as the configured clearance counts:
        beside an edge a part is a little farther away than this.
        """
        low, high = np.array(lower) - self.half[:, None], np.array(upper) + self.half[:, None]
        outside = np.maximum(np.maximum(low - points, points - high), 0.0)
        distance = np.max(outside, axis=-1)
        depth = np.min(np.minimum(points - low, high - points), axis=-1)
        return float(np.min(np.where(depth > 0.0, -depth, distance)))


def _pieces(shape: Shape, pose: Rows) -> Iterator[tuple[Place, Place]]:
    """Yield middles and half edges of an upright cylinder, or of the pieces of a level beam."""
    x, y, z = pose[:3, 3].tolist()
    if shape.kind == "cylinder":
        radius, length = shape.size
        assert math.isclose(abs(pose[2, 2]), 1.0), "a cylinder is not upright"
        yield (x, y, z), (radius, radius, 0.5 * length)
        return
    assert shape.kind == "box"
    along, across, high = 0.5 * np.abs(pose[:3, :3]) @ np.array(shape.size)
    step = np.array([1.0, 0.0])
    if across > along:
        along, across, step = across, along, np.array([0.0, 1.0])
    count = math.ceil(2.0 * along / CELL - 1e-9)
    long = 2.0 * along / count
    wide = math.hypot(0.5 * long, across)
    for k in range(count):
        dx, dy = ((k + 0.5) * long - along) * step
        yield (x + float(dx), y + float(dy), z), (wide, wide, float(high))


def _moved(point: Point, q: Rows) -> Rows:
    """Return where a point is, shape (m, 3)."""
    place = np.tile(np.array(point.middle), (len(q), 1))
    for axis in reversed(point.axes):
        value = axis.sign * q[:, axis.column]
        if axis.at is None:
            place[:, 2] += value
            continue
        cos, sin = np.cos(value), np.sin(value)
        x, y = place[:, 0] - axis.at[0], place[:, 1] - axis.at[1]
        place[:, 0] = axis.at[0] + cos * x - sin * y
        place[:, 1] = axis.at[1] + sin * x + cos * y
    return place


def straight(start: Sequence[float], end: Sequence[float], rows: int = 1500) -> Rows:
    """Return the straight joint-space way, shape (rows, n)."""
    part = np.linspace(0.0, 1.0, rows)[:, None]
    return np.array(start) + part * (np.array(end) - np.array(start))
