"""The joints of the robot that a storm plays with, by the numbers of its plant."""

from __future__ import annotations

from fanuc_emulator.plant.config import axis_parameters, load_plant
from scara_config import Robot

from harness.storm.rules.history import Joint, Servo


def joints_of(robot: Robot, plant: str) -> tuple[Joint, ...]:
    """Return what the joints may do, and how their drives follow in ``plant``, drawn or not."""
    loaded, found = load_plant(robot, None, plant), []
    for joint in robot.twin_joints:
        axis = axis_parameters(loaded, joint)
        servo = Servo(
            axis.natural_frequency,
            axis.damping,
            axis.velocity_feedforward,
            axis.command_acceleration,
            axis.servo_acceleration,
        )
        limits = (joint.lower, joint.upper, joint.velocity, joint.acceleration, joint.jerk)
        found.append(Joint(joint.name, *limits, joint.scale, servo))
    return tuple(found)
