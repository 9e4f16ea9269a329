"""Which joint bends the arm of a SCARA, and which way, wherever it stands in robot.yaml."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

from scara_config.lengths import place_of
from scara_config.robot import Joint, Robot


class ElbowJoint(NamedTuple):
    """How one joint bends the arm of a SCARA.

    Attributes:
        joint: That joint.
        sign: 1: to the left is positive, seen from above; -1: to the right.
        zero: How far the forearm is turned from the upper arm at 0 [rad].
    """

    joint: Joint
    sign: float
    zero: float

    def bend(self, q: float) -> float:
        """Return how far the forearm is turned to the left [rad], -pi to pi."""
        return math.remainder(self.sign * q + self.zero, 2.0 * math.pi)


def elbow_of(robot: Robot) -> ElbowJoint | None:
    """Return the joint that bends the arm; None: it is no SCARA by its lengths."""
    turning = [joint for joint in robot.arm_joints if joint.si_unit == "rad"]
    if robot.geometry is None or len(turning) < 2:
        return None
    places = [place_of(joint.screw_axis) for joint in turning]
    places.append((robot.home_pose[0][3], robot.home_pose[1][3]))
    # Two lengths: from the shoulder to the elbow, and on to the next axis or to the tool.
    ways = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(places[:3])]
    upper, fore = (math.atan2(y, x) for x, y in ways)
    # An axis that points down counts up to the right, seen from above.
    sign = math.copysign(1.0, (turning[1].screw_axis or (0.0, 0.0, 1.0))[2])
    return ElbowJoint(turning[1], sign, fore - upper)
