"""Where the links of a robot are in their parents, as tf wants it: a position and a quaternion.

What the joint positions do not change is computed once. For each joint state the rest takes some
multiplications: :func:`~scara_description.urdf.joint_transform` is 30 times slower.

Source: unit quaternions and rotations by half angles, any text on rigid-body motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np
from scara_config.frames import FrameTable

from scara_description.taught_frames import FloatArray, pose_of
from scara_description.urdf import (
    WORLD,
    JointFrame,
    Model,
    Vector,
    origin_transform,
    parse_robot,
    rpy_of,
    tree_of,
    without_world,
)

Quaternion = tuple[float, float, float, float]


class JointStateError(ValueError):
    """A joint state does not fit the robot; the text says why."""


class FramePose(msgspec.Struct, frozen=True):
    """Pose of the frame ``child`` in the frame ``parent``.

    Attributes:
        xyz: Translation [m].
        rotation: Unit quaternion x, y, z, w.
    """

    parent: str
    child: str
    xyz: Vector
    rotation: Quaternion


@dataclass(frozen=True)
class MovingFrame:
    """A link that a joint moves.

    Attributes:
        home: Its pose in its parent at joint position 0.
        axis: Unit vector. A sliding link's lies in the parent's frame, a turning link's in its own.
        slides: Whether the joint is prismatic.
    """

    home: FramePose
    axis: Vector
    slides: bool

    def at(self, q: float) -> FramePose:
        """Return the pose at joint position ``q`` [rad] or [m]."""
        home, (x, y, z) = self.home, self.axis
        if self.slides:
            moved = home.xyz[0] + q * x, home.xyz[1] + q * y, home.xyz[2] + q * z
            return FramePose(home.parent, home.child, moved, home.rotation)
        turn = _turn_about(self.axis, q)
        return FramePose(home.parent, home.child, home.xyz, _product(home.rotation, turn))


@dataclass(frozen=True)
class Frames:
    """The frames of one robot.

    Attributes:
        fixed: Poses of the links that no joint moves in their parents.
        moving: The others, by the name of their joint.
    """

    fixed: tuple[FramePose, ...]
    moving: Mapping[str, MovingFrame]

    def renamed(self, rename: Callable[[str], str]) -> Frames:
        """Return the same frames under other names, for example with a cell's prefix."""

        def named(pose: FramePose) -> FramePose:
            return FramePose(rename(pose.parent), rename(pose.child), pose.xyz, pose.rotation)

        return Frames(
            fixed=tuple(named(pose) for pose in self.fixed),
            moving={
                joint: MovingFrame(named(frame.home), frame.axis, frame.slides)
                for joint, frame in self.moving.items()
            },
        )

    def moved(self, names: Sequence[str], positions: Sequence[float]) -> list[FramePose]:
        """Return the poses of the links that the named joints move, in this order.

        Args:
            names: Some or all of the moving joints.
            positions: Their positions [rad] or [m].

        Raises:
            JointStateError: The counts differ, a joint is unknown, a position is not finite.
        """
        if len(names) != len(positions):
            raise JointStateError(f"{len(names)} joint names have {len(positions)} positions")
        poses = []
        for name, q in zip(names, positions):
            if name not in self.moving:
                raise JointStateError(
                    f"the description has no moving joint {name!r}: "
                    f"there are {', '.join(self.moving)}"
                )
            if not math.isfinite(q):
                raise JointStateError(f"{name} = {q}: must be finite")
            poses.append(self.moving[name].at(q))
        return poses


def frames_of(description: str) -> Frames:
    """Return the frames of a robot from its URDF; of which shape the links are does not matter.

    Raises:
        UrdfError: It is no XML, the joints are no tree, or one is of another kind.
    """
    robot = parse_robot(description)
    model: Model = tree_of(robot, {link.get("name", ""): () for link in robot.findall("link")})
    fixed = [_home(joint) for joint in model.joints if not joint.moves]
    # It was taken away for reading, but users of tf may look from it.
    if without_world(description) != description:
        fixed.insert(0, FramePose(WORLD, model.root, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
    return Frames(
        fixed=tuple(fixed),
        moving={joint.name: _moving(joint) for joint in model.joints if joint.moves},
    )


def taught_poses(
    table: FrameTable, base: str, tool: str, flange: FloatArray
) -> tuple[FramePose, ...]:
    """Return the frames that were taught: ``uframe_<n>`` in the base, ``utool_<n>`` in the tool.

    Args:
        table: frames.yaml.
        base: Name of the base's frame.
        tool: Name of the tool's own frame.
        flange: How the flange, by which tool frames are told, is turned in ``tool``, shape (3, 3);
            see :func:`scara_description.taught_frames.flange_in_tool`.
    """
    found = []
    for parent, frames, turn in ((base, table.user, np.eye(3)), (tool, table.tool, flange)):
        for name, frame in sorted(frames.items()):
            pose = pose_of(frame)
            x, y, z = (turn @ pose[:3, 3]).tolist()
            rotation = _turned(rpy_of(turn @ pose[:3, :3]))
            found.append(FramePose(parent, name, (x, y, z), rotation))
    return tuple(found)


def _home(joint: JointFrame) -> FramePose:
    """Return the pose of the child in its parent at joint position 0."""
    return FramePose(joint.parent, joint.child, joint.xyz, _turned(joint.rpy))


def _turned(angles: Vector) -> Quaternion:
    """Return the turn about the fixed x, then y, then z, as URDF and W P R mean it [rad]."""
    about_x, about_y, about_z = (
        _turn_about(axis, angle)
        for axis, angle in zip(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), angles)
    )
    return _product(about_z, _product(about_y, about_x))


def _moving(joint: JointFrame) -> MovingFrame:
    slides = joint.kind == "prismatic"
    axis = joint.axis
    if slides:
        x, y, z = origin_transform(joint.xyz, joint.rpy)[:3, :3] @ axis
        axis = float(x), float(y), float(z)
    return MovingFrame(_home(joint), axis, slides)


def _turn_about(axis: Vector, angle: float) -> Quaternion:
    """Return the turn about a unit vector."""
    sine = math.sin(0.5 * angle)
    return axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(0.5 * angle)


def _product(first: Quaternion, second: Quaternion) -> Quaternion:
    """Return the rotation ``first`` after ``second``; the product of unit quaternions is one."""
    ax, ay, az, aw = first
    bx, by, bz, bw = second
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )
