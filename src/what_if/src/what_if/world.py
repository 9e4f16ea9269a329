"""The world in which a motion is tried: a frozen snapshot of the cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scara_config import KeepOut, Robot
from scara_config.palletise import Palletise
from scara_config.payload import Payload
from scara_control.config import MotionConfig
from scara_control.dynamics.effort import DynamicModel
from scara_control.keep_out.points import WatchedPoint, watched_points
from scara_control.kinematics.arm_kinematics import ArmKinematics
from scara_description.vehicle import VEHICLE

from scara_description.urdf import Model as Description
from what_if.config import WhatIfConfig
from what_if.geometry.bodies import Body, FloatArray, bodies_of
from what_if.geometry.tree import Tree, stroke


@dataclass(frozen=True)
class Cell:
    """What of a cell does not change while it runs.

    Attributes:
        robot: robot.yaml.
        description: The URDF with its collision shapes.
        config: what_if.yaml.
        motion: motion.yaml.
        clearance_mm: Of keep-out zones; like the next one of twin_controller.yaml.
        cap_percent: Of every joint's speed.
        work: palletise.yaml; None without parts and gripper.
        rated_kg: The most that the robot may carry.
    """

    robot: Robot
    description: Description
    config: WhatIfConfig
    motion: MotionConfig
    clearance_mm: float
    cap_percent: float
    work: Palletise | None
    rated_kg: float

    @cached_property
    def tree(self) -> Tree:
        """The links."""
        joints = self.robot.twin_joints
        strokes = [stroke(joint.lower, joint.upper) for joint in joints]
        return Tree(self.description, [joint.name for joint in joints], strokes)

    @cached_property
    def kinematics(self) -> ArmKinematics:
        """Inverse kinematics with its checks."""
        return ArmKinematics(self.robot)

    @cached_property
    def points(self) -> tuple[WatchedPoint, ...]:
        """The points that may enter no zone."""
        return watched_points(self.robot)

    @cached_property
    def bodies(self) -> tuple[Body, ...]:
        """The description's bodies."""
        rests = [*self.work.table.stands_mm, "pallet", VEHICLE] if self.work else []
        return bodies_of(self.description, self.robot.tool_frame, rests)

    @cached_property
    def floor(self) -> float:
        """Height of the floor that people stand on, in the base frame [m]."""
        if self.work is not None:
            return self.work.floor_mm * 1e-3
        # No file tells it: it is not above the lowest of what stands there.
        poses = self.tree.poses(np.zeros((1, len(self.tree.joints))))[0]
        still = [body for body in self.bodies if not self.tree.movers[body.link]]
        at = [(poses[self.tree.index[body.link]], body.corners) for body in still]
        return min([0.0, *(float((c @ pose[2, :3]).min() + pose[2, 3]) for pose, c in at)])


@dataclass(frozen=True)
class Part:
    """A part and the link that it lies on or hangs at.

    Attributes:
        name: Of the part.
        link: What carries it.
        pose: Of its middle in the link's frame, shape (4, 4), translation in [m].
    """

    name: str
    link: str
    pose: FloatArray


@dataclass(frozen=True)
class Obstacle:
    """Something that stands in the cell and is in no file: a post, a box.

    Attributes:
        name: For people.
        shape: box, cylinder (upright) or sphere.
        size: box: lengths in x, y, z; cylinder: radius, length; sphere: radius [m].
        middle: Its middle in the base frame [m].
    """

    name: str
    shape: str
    size: tuple[float, ...]
    middle: tuple[float, float, float]


@dataclass(frozen=True)
class Lag:
    """How late the robot does what it is told.

    Attributes:
        mean: [s].
        spread: Standard deviation [s].
        measured: Whether somebody measured it; else it is assumed.
    """

    mean: float
    spread: float
    measured: bool = False


@dataclass(frozen=True)
class World:
    """The cell at one instant.

    Attributes:
        cell: What does not change.
        q: Positions of the twin's joints, shape (n,): [rad], prismatic [m].
        lag: Of the robot.
        models: Dynamics of the arm with its payload: without and with a part in hand.
        parts: All parts; the one in hand hangs at the tool's link.
        payload: What the controller was told; None: nothing.
        people: Where people are, in the base frame [m].
        obstacles: What else stands there.
        zones: Keep-out zones.
        override_percent: Of every programmed speed, as set at the robot.
        cap_percent: Of the speed of moves, as in force.
    """

    cell: Cell
    q: tuple[float, ...]
    lag: Lag
    models: Mapping[bool, DynamicModel]
    parts: tuple[Part, ...] = ()
    payload: Payload | None = None
    people: tuple[tuple[float, float, float], ...] = ()
    obstacles: tuple[Obstacle, ...] = ()
    zones: tuple[KeepOut, ...] = ()
    override_percent: float = 100.0
    cap_percent: float = 100.0

    @property
    def held(self) -> str:
        """The part in hand; empty if none is."""
        tool = self.cell.robot.tool_frame
        return next((part.name for part in self.parts if part.link == tool), "")
