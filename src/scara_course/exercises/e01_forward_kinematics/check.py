"""Exercise 1: where the tool is, for three sets of joint positions."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scara_config import Robot
from scara_control.kinematics.arm_kinematics import ArmKinematics
from scara_course.marking import Table

ROWS = "a", "b", "c"


def draw(generator: np.random.Generator) -> Table:
    """Draw three poses: whole degrees and mm, the elbow well bent, once to each side."""
    bends = generator.permutation([-1, 1, -1 if generator.random() < 0.5 else 1])
    return {
        row: {
            # Plain int: the numbers go into a file as JSON, which knows none of numpy's.
            "joint_1_deg": int(generator.integers(15, 121)) * (-1) ** int(generator.integers(2)),
            "joint_2_deg": int(generator.integers(20, 141)) * int(bend),
            "joint_3_mm": -int(generator.integers(10, 201)),
        }
        for row, bend in zip(ROWS, bends)
    }


def solve(given: Table, robot: Robot) -> Table:
    """Return the tool's position of each pose."""
    arm = ArmKinematics(robot)

    def position(values: dict[str, float | str]) -> dict[str, float | str]:
        q1, q2, q3 = map(float, values.values())
        place = arm.forward((math.radians(q1), math.radians(q2), q3 / 1e3)).position
        return dict(zip(("x_mm", "y_mm", "z_mm"), (1e3 * each for each in place)))

    return {row: position(values) for row, values in given.items()}


def mistakes(given: Table, robot: Robot) -> dict[str, Table]:
    """Return what usual mistakes give; a and b are the lengths, q the joints, h the height [mm]."""
    size = robot.geometry
    assert size is not None
    a, b, h, d = size.l1_mm, size.l2_mm, size.h_mm, math.pi / 180.0

    def table(position: Callable[[float, float, float], tuple[float, float, float]]) -> Table:
        return {
            row: dict(zip(("x_mm", "y_mm", "z_mm"), position(*map(float, values.values()))))
            for row, values in given.items()
        }

    def plane(q1: float, both: float, a: float = a, b: float = b) -> tuple[float, float]:
        x = a * math.cos(q1 * d) + b * math.cos(both * d)
        y = a * math.sin(q1 * d) + b * math.sin(both * d)
        return x, y

    return {
        "joint_2 counts from the first arm: its direction is joint_1 + joint_2": table(
            lambda q1, q2, q3: (*plane(q1, q2), h + q3)
        ),
        "the angle of the second arm is the sum, not the difference": table(
            lambda q1, q2, q3: (*plane(q1, q1 - q2), h + q3)
        ),
        "the angles are in degrees, your calculator takes radians": table(
            lambda q1, q2, q3: (*plane(q1 / d, (q1 + q2) / d), h + q3)
        ),
        "the two arms are swapped: the first one is the longer": table(
            lambda q1, q2, q3: (*plane(q1, q1 + q2, b, a), h + q3)
        ),
        "x takes the cosine, y the sine": table(
            lambda q1, q2, q3: (*plane(q1, q1 + q2)[::-1], h + q3)
        ),
        "y turns anticlockwise from x: its sign": table(
            lambda q1, q2, q3: (plane(q1, q1 + q2)[0], -plane(q1, q1 + q2)[1], h + q3)
        ),
        "z begins at the height of the tool, h": table(
            lambda q1, q2, q3: (*plane(q1, q1 + q2), q3)
        ),
        "joint_3 is positive upwards: add it": table(
            lambda q1, q2, q3: (*plane(q1, q1 + q2), h - q3)
        ),
        "this is where the elbow is: the second arm is missing": table(
            lambda q1, q2, q3: (*plane(q1, q1 + q2, a, 0.0), h + q3)
        ),
        "the answer is asked for in mm, not in m": table(
            lambda q1, q2, q3: (
                plane(q1, q1 + q2)[0] / 1e3,
                plane(q1, q1 + q2)[1] / 1e3,
                (h + q3) / 1e3,
            )
        ),
    }
