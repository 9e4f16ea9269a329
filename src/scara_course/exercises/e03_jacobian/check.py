"""Exercise 3: the Jacobian of the tool in the plane at P1 and at a bent pose, and what it means."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scara_config import Robot
from scara_control.kinematics.arm_kinematics import ArmKinematics
from scara_control.kinematics.jacobians import space_jacobian, tip_jacobian
from scara_course.marking import Table

Array = NDArray[np.float64]
ENTRIES = "x_by_joint_1_m", "x_by_joint_2_m", "y_by_joint_1_m", "y_by_joint_2_m"


def draw(generator: np.random.Generator) -> Table:
    """Draw the bent pose, and how fast both joints turn there."""
    return {
        "P1": {"joint_1_deg": 0, "joint_2_deg": 0},
        "bent": {
            "joint_1_deg": int(generator.integers(15, 80)) * (-1) ** int(generator.integers(2)),
            "joint_2_deg": int(generator.integers(25, 120)),
            "speed_1_deg_s": int(generator.integers(5, 25)),
            "speed_2_deg_s": -int(generator.integers(5, 25)),
        },
    }


def solve(given: Table, robot: Robot) -> Table:
    """Return both Jacobians, their determinants, and what they mean."""
    arm = ArmKinematics(robot).arm
    return _answers(given, {row: tip_jacobian(arm, q)[3:5, :2] for row, q in _poses(given)})


def mistakes(given: Table, robot: Robot) -> dict[str, Table]:
    """Return what usual mistakes give."""
    arm, degree = ArmKinematics(robot).arm, math.pi / 180.0
    right = {row: tip_jacobian(arm, q)[3:5, :2] for row, q in _poses(given)}
    space = {row: space_jacobian(arm, q)[3:5, :2] for row, q in _poses(given)}
    second = {row: np.column_stack((J[:, 1], J[:, 1])) for row, J in right.items()}
    first = {row: np.column_stack((J[:, 0] - J[:, 1], J[:, 1])) for row, J in right.items()}
    return {
        "the rows are x and y, the columns are the joints: yours is turned over": _answers(
            given, {row: J.T for row, J in right.items()}
        ),
        "this is the space Jacobian: asked for is the velocity of the tool": _answers(given, space),
        "joint_1 moves the second arm too: its term is missing": _answers(given, first),
        "joint_1 moves the first arm too: its term is missing": _answers(given, second),
        # Whoever has this Jacobian puts degrees a second into it, and finds the right velocity.
        "this is for one degree: asked for is one radian": _answers(
            given, {row: J * degree for row, J in right.items()}, speed=1.0
        ),
        # The velocity is asked for in mm/s: it comes out right without another factor of 1000.
        "this is in mm: asked for is m": _answers(
            given, {row: J * 1e3 for row, J in right.items()}, speed=degree * 1e-3
        ),
        "the x row has minus signs: the cosine's derivative is minus the sine": _answers(
            given, {row: J * [[-1.0], [1.0]] for row, J in right.items()}
        ),
        "speeds go into the Jacobian in radians a second": _answers(given, right, speed=1.0),
        "the determinant is x_by_1 y_by_2 less x_by_2 y_by_1: its sign": _answers(
            given, right, handed=-1.0
        ),
        "the straight arm cannot go along itself: at P1 it points along x": _answers(
            given, right, lost="y"
        ),
    }


def _poses(given: Table) -> list[tuple[str, tuple[float, float, float]]]:
    """Return each row's joint positions, with the stroke in the middle."""
    radians = {
        row: [math.radians(float(v)) for v in values.values()] for row, values in given.items()
    }
    return [(row, (q[0], q[1], -0.1)) for row, q in radians.items()]


def _answers(
    given: Table,
    jacobians: dict[str, Array],
    speed: float = math.pi / 180.0,
    lost: str = "x",
    handed: float = 1.0,
) -> Table:
    """Return the answers that follow from a Jacobian of each row."""
    found: Table = {}
    for row, J in jacobians.items():
        det = handed * float(np.linalg.det(J))
        found[row] = {**dict(zip(ENTRIES, map(float, J.ravel()))), "det_m2": det}
    found["P1"]["lost_direction"] = lost
    turning = [float(given["bent"][f"speed_{n}_deg_s"]) * speed for n in (1, 2)]
    velocity = jacobians["bent"] @ turning * 1e3
    found["bent"] |= {"vx_mm_s": float(velocity[0]), "vy_mm_s": float(velocity[1])}
    return found
