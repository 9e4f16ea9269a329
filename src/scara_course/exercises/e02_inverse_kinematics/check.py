"""Exercise 2: the joint positions that bring the tool to a point, with the elbow on either side."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scara_config import Robot
from scara_control.kinematics.arm_kinematics import ArmKinematics
from scara_control.kinematics.scara import Elbow
from scara_course.marking import Table

NAMES = "joint_1_deg", "joint_2_deg", "joint_3_mm"
# Of each point: radius [mm], and degrees from the x axis. Both elbows are within their limits
# there; the second point lies behind the y axis, where an arc tangent of y / x is half a turn off.
RINGS = {"a": ((300, 520), (10, 60)), "b": ((570, 630), (100, 115))}
Angles = Callable[[float, float, float, float], tuple[float, float]]


def draw(generator: np.random.Generator) -> Table:
    """Draw two points, in whole mm."""
    given: Table = {}
    for row, (radius, turn) in RINGS.items():
        r = int(generator.integers(radius[0], radius[1] + 1))
        angle = math.radians(int(generator.integers(turn[0], turn[1] + 1)))
        side = (-1) ** int(generator.integers(2))
        place = {"x_mm": round(r * math.cos(angle)), "y_mm": side * round(r * math.sin(angle))}
        given[row] = {**place, "z_mm": int(generator.integers(0, 150))}
    return given


def solve(given: Table, robot: Robot) -> Table:
    """Return the joint positions of each point with each elbow."""
    arm = ArmKinematics(robot)
    found: Table = {}
    for row, values in given.items():
        for elbow in Elbow:
            x, y, z = (float(value) / 1e3 for value in values.values())
            q1, q2, q3 = arm.inverse(x, y, z, elbow).chosen.q
            degrees = math.degrees(q1), math.degrees(q2)
            found[f"{row}_{elbow.value}"] = dict(zip(NAMES, (*degrees, 1e3 * q3)))
    return found


def mistakes(given: Table, robot: Robot) -> dict[str, Table]:
    """Return what usual mistakes give, with the article's angles alpha, beta and gamma [deg]."""
    size = robot.geometry
    assert size is not None
    a, b, h = size.l1_mm, size.l2_mm, size.h_mm

    def table(
        angles: Angles = lambda side, alpha, beta, gamma: (
            gamma - side * alpha,
            side * (180.0 - beta),
        ),
        stroke: Callable[[float], float] = lambda z: z - h,
        turn: Callable[[float, float], float] = lambda x, y: math.degrees(math.atan2(y, x)),
        swapped: bool = False,
        scale: float = 1.0,
    ) -> Table:
        found: Table = {}
        for row, values in given.items():
            x, y, z = map(float, values.values())
            r, near, far = math.hypot(x, y), *((b, a) if swapped else (a, b))
            beta = math.degrees(math.acos((a * a + b * b - r * r) / (2.0 * a * b)))
            alpha = math.degrees(math.acos((r * r + near**2 - far**2) / (2.0 * near * r)))
            for elbow, side in ((Elbow.RIGHTY, 1.0), (Elbow.LEFTY, -1.0)):
                q1, q2 = angles(side, alpha, beta, turn(x, y))
                found[f"{row}_{elbow.value}"] = dict(
                    zip(NAMES, (q1 * scale, q2 * scale, stroke(z)))
                )
        return found

    return {
        "righty and lefty are swapped: righty has a positive joint_2": table(
            lambda side, alpha, beta, gamma: (gamma + side * alpha, side * (beta - 180.0))
        ),
        "beta is the angle inside the triangle: joint_2 is what is left of 180 degrees": table(
            lambda side, alpha, beta, gamma: (gamma - side * alpha, side * beta)
        ),
        "alpha is missing: the first arm does not point at the tool": table(
            lambda side, alpha, beta, gamma: (gamma, side * (180.0 - beta))
        ),
        "alpha has the wrong sign for this elbow": table(
            lambda side, alpha, beta, gamma: (gamma + side * alpha, side * (180.0 - beta))
        ),
        "behind the y axis an arc tangent of y / x is half a turn off: use atan2": table(
            # x is never 0: the rings keep away from the y axis.
            turn=lambda x, y: math.degrees(math.atan(y / x))
        ),
        "gamma is atan2(y, x), in this order": table(
            turn=lambda x, y: math.degrees(math.atan2(x, y))
        ),
        "the angles are asked for in degrees, not in radians": table(scale=math.pi / 180.0),
        "alpha belongs to the first arm: its length is L1": table(swapped=True),
        "the height of the tool, h, is missing in joint_3": table(stroke=lambda z: z),
        "joint_3 is z less h: its sign": table(stroke=lambda z: h - z),
    }
