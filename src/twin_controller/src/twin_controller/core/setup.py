"""What never changes while the controller runs: profile, numbers and what follows from them."""

from __future__ import annotations

import math
from functools import cached_property

from scara_config import Robot
from scara_control.keep_out.points import speed_points, watched_points
from scara_control.keep_out.reach import largest_rates
from scara_control.kinematics.screws import ScrewModel
from scara_control.kinematics.tool import ToolKinematics, tool_kinematics

from twin_controller.config import TwinControllerConfig
from twin_controller.core.events import Joints
from twin_controller.core.safety.fastest import fastest_speed, speed_cap


class Setup:
    """The robot's tables in the order of the twin's joints, SI, and the controller's numbers."""

    def __init__(
        self, robot: Robot, config: TwinControllerConfig, switches_gripper: bool = True
    ) -> None:
        """Derive the joint tables.

        Args:
            robot: The profile.
            config: The numbers of twin_controller.yaml.
            switches_gripper: A client can switch the robot's gripper, if it has one.
        """
        self.switches_gripper = switches_gripper
        self.config = config
        self.robot = robot
        self.joints = robot.twin_joints
        self.names = tuple(joint.name for joint in self.joints)
        self.scale = tuple(joint.scale for joint in self.joints)
        self.lower = tuple(joint.lower for joint in self.joints)
        self.upper = tuple(joint.upper for joint in self.joints)
        self.velocity = tuple(joint.velocity for joint in self.joints)
        self.acceleration = tuple(joint.acceleration for joint in self.joints)
        self.jerk = tuple(joint.jerk for joint in self.joints)
        braking = config.cell.braking_acceleration_percent * 1e-2
        self.braking = tuple(joint.acceleration * braking for joint in self.joints)
        # What no zone and no person may be near, and those of it whose speed counts.
        self.points = watched_points(robot)
        self.speed_points = speed_points(self.points)
        self.arm = ScrewModel.from_robot(robot)
        self.arm_columns = tuple(
            k for k, joint in enumerate(self.joints) if joint.screw_axis is not None
        )
        self.home = tuple(robot.home_positions)
        self.keep_out = tuple(robot.keep_out)
        # Until the real robot brakes, or gets slower by its override [s].
        self.braking_delay = robot.stopping.braking_delay_ms * 1e-3
        self.slowing_delay = self.braking_delay + config.cell.slowing_margin_ms * 1e-3
        self.cuts_drives = robot.stopping.cuts_drives(config.real.host)
        # Why the real robot is followed and never led; empty: it may be led.
        self.only_followed = robot.only_followed(config.real.host)
        # False: nothing is ever written to the real robot, not even a stop.
        self.writes = robot.lead

    @cached_property
    def tool(self) -> ToolKinematics:
        """Where the joints lead the tool, as the twin's own nodes reckon it."""
        return tool_kinematics(self.robot)

    @cached_property
    def tool_per_noise(self) -> float:
        """How far the tool of an outstretched arm strays [mm] for a unit of all joints' noise.

        Border units; joints that turn the tool's place by their angle and those that shift it.
        """
        reach = self.robot.reach_mm
        joints = [self.joints[column] for column in self.arm_columns]
        return math.hypot(*(reach * j.scale if j.unit == "deg" else 1.0 for j in joints))

    @cached_property
    def reach_mm(self) -> float:
        """Of the outstretched arm."""
        return self.robot.reach_mm

    @cached_property
    def tool_speeds(self) -> tuple[float, ...]:
        """By how much each joint moves the tool at its largest speed, at most [m/s].

        One that carries no tool, as a table's, counts as if it reached as far.
        """
        levers = [self.reach_mm * 1e-3 if joint.unit == "deg" else 1.0 for joint in self.joints]
        for column, rates in zip(self.arm_columns, largest_rates(self.arm) or ()):
            levers[column] = max(rates)
        return tuple([lever * most for lever, most in zip(levers, self.velocity)])

    @cached_property
    def fastest(self) -> float:
        """Largest speed of a watched point [m/s]: in any pose, all joints at their largest."""
        return fastest_speed(self.speed_points, self.lower, self.upper, self.velocity)

    @property
    def safe_percent(self) -> float:
        """Program speed that keeps the Cartesian limit in any motion [percent]; 100 without one."""
        limit = self.config.cell.cartesian_speed_mm_s
        # Without a limit the search for the fastest pose is spared: it takes a while.
        return 100.0 if limit is None else speed_cap(self.fastest, limit)

    def to_border(self, q: Joints) -> Joints:
        """Convert SI joint positions to degrees and millimetres."""
        return tuple([value / scale for value, scale in zip(q, self.scale)])

    def align_speeds(self) -> Joints:
        """Return the speed of each joint while the twin aligns, SI."""
        part = self.config.align.speed_percent * 1e-2
        return tuple(velocity * part for velocity in self.velocity)
