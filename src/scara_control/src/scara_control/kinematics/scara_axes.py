"""Which joint of a SCARA does what, read from the screw axes of robot.yaml.

All axes are parallel to z of the base, so a sliding joint moves the tool alike wherever it stands
in the chain: R R P R, R R R P and P R R R are one arm. The turning joints are shoulder, elbow and
wrist, base to tool; without a wrist the forearm turns the tool.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scara_config import Joint, Robot

from scara_control.errors import ScaraControlError

PARALLEL = 1e-9
"""How far an axis may lean, and how far a turning joint may slide for a turn (our choice: what
floating point leaves of a written 0)."""

Point = tuple[float, float]


class ScaraAxis(NamedTuple):
    """What one joint does.

    Attributes:
        column: Its place among the joints of the arm.
        sign: 1: anticlockwise about z of the base, or up; -1: against it.
        zero: Of a turning joint: where what it carries points with all joints at 0, from x of the
            base [rad].
    """

    column: int
    sign: float
    zero: float = 0.0


class Axes(NamedTuple):
    """The joints of a SCARA by what they do.

    Attributes:
        base: Where the shoulder stands, x and y in the base frame [m].
        shoulder: Turns the upper arm.
        elbow: Turns the forearm.
        slide: Lifts the tool.
        wrist: Turns the tool; None: the forearm does.
        offset: How far the tool's origin is off the wrist's axis [m].
    """

    base: Point
    shoulder: ScaraAxis
    elbow: ScaraAxis
    slide: ScaraAxis
    wrist: ScaraAxis | None
    offset: float


def read_axes(robot: Robot) -> Axes:
    """Find shoulder, elbow, slide and wrist among the joints that move the twin's tool.

    Raises:
        ScaraControlError: There are others than two or three turning joints and a sliding one, or
            an axis is not parallel to z of the base; the text names the joint.
    """
    joints = robot.arm_joints
    turning = [k for k, joint in enumerate(joints) if joint.si_unit == "rad"]
    sliding = [k for k, joint in enumerate(joints) if joint.si_unit == "m"]
    if len(sliding) != 1 or len(turning) not in (2, 3):
        raise ScaraControlError(
            f"{robot.name} is no SCARA: its arm joints are "
            f"{', '.join(joint.name for joint in joints)}, "
            "expected two or three revolute and one prismatic"
        )
    signs = [_sign(robot.name, joint) for joint in joints]
    places = [_place(joints[k]) for k in turning]
    tip = robot.home_pose[0][3], robot.home_pose[1][3]
    # Without a wrist the forearm carries the tool itself.
    ends = [*places[1:], tip]
    # Where each end is, seen from the place in front of it [rad]; 0 where both are one.
    ways = [(end[0] - place[0], end[1] - place[1]) for place, end in zip(places, ends)]
    seen = [math.atan2(y, x) if math.hypot(x, y) > PARALLEL else 0.0 for x, y in ways]
    first, second, *third = (ScaraAxis(k, signs[k], at) for k, at in zip(turning, seen))
    return Axes(
        places[0],
        first,
        second,
        ScaraAxis(sliding[0], signs[sliding[0]]),
        third[0] if third else None,
        math.dist(places[2], tip) if third else 0.0,
    )


def _sign(robot: str, joint: Joint) -> float:
    """Return whether a joint's axis points up or down, or raise ScaraControlError."""
    screw = np.array(joint.screw_axis)
    # A turn about z has omega alone along z, and no v along it; a stroke has v alone along z.
    along = 2 if joint.si_unit == "rad" else 5
    other = [0, 1, 5] if joint.si_unit == "rad" else [0, 1, 2, 3, 4]
    if np.abs(screw[other]).max() > PARALLEL:
        raise ScaraControlError(
            f"{robot} is no SCARA: {joint.name}.screw_axis = {screw.tolist()} is not parallel to z "
            "of base_frame"
        )
    return math.copysign(1.0, screw[along])


def _place(joint: Joint) -> Point:
    """Return where the axis of a turning joint stands: omega x v."""
    screw = np.array(joint.screw_axis)
    x, y, _ = np.cross(screw[:3], screw[3:]).tolist()
    return x, y
