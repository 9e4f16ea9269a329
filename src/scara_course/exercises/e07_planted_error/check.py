"""Exercise 7: one value of a robot's profile is wrong; the data sheet and two readings tell which.

``draw`` chooses the key and how its value went wrong, as a hand does: digits changed places, one
got lost, a sign or a unit is wrong.
"""

from __future__ import annotations

import math

import numpy as np
from scara_config import Robot
from scara_control.kinematics.arm_kinematics import ArmKinematics
from scara_course.marking import Table

ERROR = "error"
# Keys that may be wrong, and what became of their values.
PLANTED = {
    "geometry.l1_mm": 305.0,
    "geometry.l2_mm": 330.0,
    "geometry.h_mm": -160.0,
    "positions_m.P2.y": -0.16,
    "positions_m.P3.z": 0.61,
    "joints.joint_1.velocity_deg_s": 4400.0,
    "joints.joint_1.upper_deg": 184.0,
    "joints.joint_2.lower_deg": -15.0,
    "joints.joint_2.effort": 210.0,
    "joints.joint_3.lower_mm": -0.21,
    "joints.joint_3.axis_number": 4.0,
    "joints.joint_3.velocity_mm_s": 200.0,
}
POSES = {"A": (25.0, 60.0, -40.0), "B": (-70.0, -95.0, -120.0)}
"""Joints of two readings of the robot's display [deg] and [mm]."""


def draw(generator: np.random.Generator) -> Table:
    """Choose what is wrong."""
    key = list(PLANTED)[int(generator.integers(len(PLANTED)))]
    return {ERROR: {"key": key, "wrong": PLANTED[key]}}


def values(robot: Robot) -> dict[str, float]:
    """Return the values of the profile, by their keys."""
    size = robot.geometry
    assert size is not None
    found = {"geometry.l1_mm": size.l1_mm, "geometry.l2_mm": size.l2_mm, "geometry.h_mm": size.h_mm}
    for name, place in robot.positions_m.items():
        found |= {f"positions_m.{name}.{axis}": value for axis, value in zip("xyz", place)}
    for joint in robot.arm_joints:
        unit, key = joint.unit, f"joints.{joint.name}"
        found |= {
            # Rounded: the way to rad and m and back leaves digits that nobody wrote.
            f"{key}.axis_number": float(joint.axis_number or 0),
            f"{key}.lower_{unit}": round(joint.lower / joint.scale, 6),
            f"{key}.upper_{unit}": round(joint.upper / joint.scale, 6),
            f"{key}.velocity_{unit}_s": round(joint.velocity / joint.scale, 6),
            f"{key}.effort": joint.effort,
        }
    return found


def material(given: Table, robot: Robot) -> dict[str, str]:
    """Return the profile with its error, and what the robot's display showed."""
    lines: list[str] = []
    open_keys: list[str] = []
    planted = {str(given[ERROR]["key"]): float(given[ERROR]["wrong"])}
    for key, value in (values(robot) | planted).items():
        *sections, name = key.split(".")
        for depth, section in enumerate(sections):
            if open_keys[: depth + 1] != sections[: depth + 1]:
                lines.append("  " * depth + f"{section}:")
        open_keys = sections
        lines.append("  " * len(sections) + f"{name}: {value:g}")
    arm, shown = ArmKinematics(robot), ["pose,joint_1_deg,joint_2_deg,joint_3_mm,x_mm,y_mm,z_mm"]
    for name, (q1, q2, q3) in POSES.items():
        x, y, z = arm.forward((math.radians(q1), math.radians(q2), q3 / 1e3)).position
        joints = f"{q1:.2f},{q2:.2f},{q3:.2f}"
        shown.append(f"{name},{joints},{x * 1e3:.2f},{y * 1e3:.2f},{z * 1e3:.2f}")
    return {"profile.yaml": "\n".join(lines) + "\n", "display.csv": "\n".join(shown) + "\n"}


def solve(given: Table, robot: Robot) -> Table:
    """Return key, wrong value and right value."""
    return {ERROR: {**given[ERROR], "right": values(robot)[str(given[ERROR]["key"])]}}


def mistakes(given: Table, robot: Robot) -> dict[str, Table]:
    """Return what usual mistakes give."""
    right = solve(given, robot)[ERROR]
    key, value, wrong = str(right["key"]), float(right["right"]), float(right["wrong"])

    def other(**changed: float | str) -> Table:
        return {ERROR: {**right, **changed}}

    found = {
        "wrong is what stands in the file, right what should": other(wrong=value, right=wrong),
        "write the whole way to the value, its sections with dots": other(key=key.split(".")[-1]),
        "right is the value, not how far the file is off": other(right=abs(value - wrong)),
        "in the unit that the key names": other(right=value / 1e3),
        "its sign": other(right=-value),
        "that is what the file says, and it is wrong": other(right=wrong),
    }
    for each, true in values(robot).items():
        if each != key:
            found[f"{each} agrees with data sheet and display"] = {
                ERROR: {"key": each, "wrong": true, "right": true}
            }
    return found
