"""What a joint's loop knows of its joint, and how it gets from one position to another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import msgspec
from scara_config import Robot
from scara_control.joint_motion import AxisMotion, JointMotion
from scara_control.motion.plan import Path, plan_move

from scara_simulation.config import SimulationConfig


class JointModel(msgspec.Struct, frozen=True):
    """What the loop knows of its joint, in SI.

    It knows the limits of robot.yaml, and damping and friction of the URDF.

    ``standstill`` is the speed that counts as none, ``tolerance`` how far a set point may pass a
    limit unnoticed, ``stick_band`` the position error at rest for which the whole dry friction is
    pushed against; 0: never.
    """

    name: str
    lower: float
    upper: float
    velocity: float
    acceleration: float
    effort: float
    standstill: float
    tolerance: float = 0.0
    damping: float = 0.0
    friction: float = 0.0
    jerk: float = math.inf
    stick_band: float = 0.0

    def friction_effort(self, velocity: float, error: float = 0.0) -> float:
        r"""Return the effort that overcomes damping and dry friction.

        .. math:: d\,v + f\,\mathrm{sat}\bigl(s + (1 - |s|)\, e / e_0\bigr),
            \qquad s = \mathrm{sat}(v / v_0)

        While the set point moves, friction acts against its direction. At rest its direction is
        unknown, and the joint would stick anywhere within ``friction / stiffness``: there the
        position error says which way to push.

        Args:
            velocity: Wanted velocity [rad/s] or [m/s].
            error: Position error (set point minus measured) [rad] or [m]; 0 while no position is
                wanted.
        """
        moving = velocity / self.standstill
        if -1.0 < moving < 1.0:
            if error and self.stick_band:
                moving += (1.0 - abs(moving)) * error / self.stick_band
                moving = -1.0 if moving < -1.0 else 1.0 if moving > 1.0 else moving
            return self.damping * velocity + self.friction * moving
        return self.damping * velocity + (self.friction if velocity > 0.0 else -self.friction)

    def plan(self, start: AxisMotion, target: float, speed_percent: float = 100.0) -> Path:
        """Plan the way to ``target`` [rad] or [m] from a motion.

        It keeps the joint's acceleration and jerk, and a share of its velocity.
        """
        joints: Any = (self,)  # has the limits by the names that plan_move reads
        position, velocity, acceleration = start
        return plan_move(
            joints, JointMotion((position,), (velocity,), (acceleration,)), (target,), speed_percent
        )


def joint_models(
    robot: Robot, config: SimulationConfig, damping: Sequence[float], friction: Sequence[float]
) -> list[JointModel]:
    """Return what the loops need to know.

    It comes from the robot's limits and the URDF's damping and friction.
    """
    return [
        JointModel(
            name=joint.name,
            lower=joint.lower,
            upper=joint.upper,
            velocity=joint.velocity,
            acceleration=joint.acceleration,
            jerk=joint.jerk,
            effort=joint.effort,
            standstill=joint.velocity * config.standstill_percent / 100.0,
            tolerance=config.position_tolerance(joint),
            stick_band=config.stick_band(joint),
            damping=d,
            friction=f,
        )
        for joint, d, f in zip(robot.twin_joints, damping, friction, strict=True)
    ]
