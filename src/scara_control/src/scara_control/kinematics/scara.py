"""Closed-form kinematics of a SCARA.

It has two parallel arms of the lengths in robot.yaml and a stroke along z.

Plain ``math``, one point at a time.

Righty means ``joint_2 >= 0``, lefty ``joint_2 < 0``. Let ``a^2 = (L1+L2)^2 - r^2`` and ``b^2 = r^2
- (L1-L2)^2`` with ``r = |(x, y)|``. The law of cosines for half the angle gives ``tan(q2/2) =
a/b``, and ``tan(alpha) = a b / (r^2 + L1^2 - L2^2)`` for the angle between the first arm and the
line to the tool. Both come from the same a and b, so at the edge of the reach, where an arc cosine
loses half of the digits, what is lost in joint_2 is made up for by joint_1 and the tool still
arrives to the last digit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import atan2, sqrt
from typing import NamedTuple

from scara_config import Joint, Robot

from scara_control.errors import JointLimitError, ScaraControlError, UnreachableError
from scara_control.limits import LIMIT_TOLERANCE, check_joint_vector, check_limits

REACH_TOLERANCE = 1e-9
"""[m] A target this far beyond the edge of the ring is put on the edge: rounding, as at P1 = (0.65,
0, 0), where the sum of the arms is 0.6499999999999999 (our choice: 10 000 times finer than the
robot's repeatability)."""

_UNDECIDED = 1e-9
_TURN = 2.0 * math.pi

Triple = tuple[float, float, float]
_Figures = tuple[float, float, float, float, bool, float, float, float, float, float, float]


class Elbow(Enum):
    """On which side of the line from base to tool the elbow stands."""

    RIGHTY = "righty"
    LEFTY = "lefty"

    @classmethod
    def of(cls, q2: float) -> Elbow:
        """Return the branch of a joint_2 position; the straight arm counts as righty."""
        return cls.LEFTY if q2 < 0.0 else cls.RIGHTY


class Solution(NamedTuple):
    """Joint positions of one target [rad], prismatic [m], and their branch.

    None: the arm has none by name.
    """

    q: tuple[float, ...]
    elbow: Elbow | None


@dataclass(frozen=True, slots=True)
class Scara:
    """Lengths and joints of a SCARA.

    Attributes:
        l1: joint_1 to joint_2 [m].
        l2: joint_2 to the tool axis [m].
        h: z of the tool at joint_3 = 0 [m].
        joints: joint_1, joint_2, joint_3.
        limits: Lower and upper limit of each of them in turn [rad], [rad], [m].
        figures: Worked out once: l1 + l2, |l1 - l2|, l1^2 - l2^2, h, whether joint_1 may turn more
            than once, limits.
    """

    l1: float
    l2: float
    h: float
    joints: tuple[Joint, ...]
    limits: tuple[float, float, float, float, float, float]
    figures: _Figures = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        (l1, l2), many_turns = (
            (self.l1, self.l2),
            not (-math.pi < self.limits[0] and self.limits[1] < math.pi),
        )
        object.__setattr__(
            self,
            "figures",
            (l1 + l2, abs(l1 - l2), l1 * l1 - l2 * l2, self.h, many_turns, *self.limits),
        )

    @classmethod
    def from_robot(cls, robot: Robot) -> Scara:
        """Take the lengths and the three joints that move the twin's tool from robot.yaml.

        Raises:
            ScaraControlError: The arm has not two turning joints and a sliding one.
        """
        joints = tuple(robot.arm_joints)
        if [joint.si_unit for joint in joints] != ["rad", "rad", "m"]:
            raise ScaraControlError(
                f"{robot.name} is no SCARA: its arm joints are "
                f"{', '.join(joint.name for joint in joints)}, "
                "expected two revolute and one prismatic"
            )
        size = robot.geometry
        if size is None:
            raise ScaraControlError(f"{robot.name} has no geometry in robot.yaml")
        first, second, third = ((joint.lower, joint.upper) for joint in joints)
        return cls(
            size.l1_mm / 1e3, size.l2_mm / 1e3, size.h_mm / 1e3, joints, (*first, *second, *third)
        )

    @property
    def outer_radius(self) -> float:
        """Radius of the straight arm [m]."""
        return self.l1 + self.l2

    @property
    def inner_radius(self) -> float:
        """Smallest radius [m]: joint_2 at its larger limit, not L1 - L2."""
        bend = min(max(-self.joints[1].lower, self.joints[1].upper), math.pi)
        return math.sqrt(
            max(self.l1**2 + self.l2**2 + 2.0 * self.l1 * self.l2 * math.cos(bend), 0.0)
        )


def tool_position(scara: Scara, q1: float, q2: float, q3: float) -> Triple:
    """Compute where the tool's origin is.

    Args:
        scara: Lengths.
        q1: joint_1 [rad].
        q2: joint_2, relative to the first arm [rad].
        q3: joint_3, up positive [m].

    Returns:
        x, y, z in the base frame [m].
    """
    q12 = q1 + q2
    return (
        scara.l1 * math.cos(q1) + scara.l2 * math.cos(q12),
        scara.l1 * math.sin(q1) + scara.l2 * math.sin(q12),
        scara.h + q3,
    )


def solve_elbow(
    scara: Scara, x: float, y: float, z: float, elbow: Elbow, near: float = 0.0
) -> Triple:
    """Compute the joint positions that bring the tool to a point with the elbow on the wanted side.

    Args:
        scara: Lengths and limits.
        x: Target in the base frame [m].
        y: Target in the base frame [m].
        z: Target in the base frame [m].
        elbow: Branch; on the edge of the reach both are the same.
        near: joint_1 to be near to [rad], of the turns that its limits allow.

    Returns:
        joint_1 [rad], joint_2 [rad], joint_3 [m], within their limits.

    Raises:
        UnreachableError: Not finite, or no joint_2 gives this radius; the text names radius and
            range.
        JointLimitError: The branch breaks a limit; the text names joint, value and range.
    """
    outer, inner, squares, h, many_turns, low1, high1, low2, high2, low3, high3 = scara.figures
    r = sqrt(x * x + y * y)
    if not inner - REACH_TOLERANCE <= r <= outer + REACH_TOLERANCE:
        raise _unreachable(scara, x, y, z)
    a = sqrt((outer - r) * (outer + r)) if r < outer else 0.0
    b = sqrt((r - inner) * (r + inner)) if r > inner else 0.0
    if elbow is Elbow.LEFTY:
        a = -a
    along, across = r * r + squares, a * b
    q1 = atan2(y * along - x * across, x * along + y * across)
    q2 = 2.0 * atan2(a, b) + 0.0  # no -0.0 on the edge
    q3 = z - h
    if many_turns:
        low, high = low1 - LIMIT_TOLERANCE, high1 + LIMIT_TOLERANCE
        turns = [turn for turn in (q1, q1 - _TURN, q1 + _TURN) if low <= turn <= high]
        q1 = min(turns, key=lambda turn: abs(turn - near), default=q1)
    if low1 <= q1 <= high1 and low2 <= q2 <= high2 and low3 <= q3 <= high3:
        return q1, q2, q3
    return _at_limit(scara, (x, y, z), (q1, q2, q3))


def solve(
    scara: Scara,
    x: float,
    y: float,
    z: float,
    elbow: Elbow | None = None,
    seed: Sequence[float] | None = None,
) -> Solution:
    """Compute the joint positions for a tool position.

    Args:
        scara: Lengths and limits.
        x: Target in the base frame [m].
        y: Target in the base frame [m].
        z: Target in the base frame [m].
        elbow: Branch; None: the allowed one nearer to ``seed``.
        seed: Joint positions to stay near to; None: righty first. Undecided is righty.

    Returns:
        The chosen branch.

    Raises:
        UnreachableError: See :func:`solve_elbow`.
        JointLimitError: The wanted branch breaks a limit, or with ``elbow`` None both do.
        JointVectorError: ``seed`` is no joint vector.
    """
    if seed is None and elbow is not None:
        return Solution(solve_elbow(scara, x, y, z, elbow), elbow)
    start = None if seed is None else check_joint_vector(scara.joints, seed)
    near = start[0] if start else 0.0
    if elbow is not None:
        return Solution(solve_elbow(scara, x, y, z, elbow, near), elbow)
    righty, lefty = branches(scara, x, y, z, near)
    if righty is None or lefty is None:
        if righty is not None:
            return Solution(righty, Elbow.RIGHTY)
        if lefty is not None:
            return Solution(lefty, Elbow.LEFTY)
        return Solution(solve_elbow(scara, x, y, z, Elbow.RIGHTY, near), Elbow.RIGHTY)
    if start and _distance(lefty, start) < _distance(righty, start) - _UNDECIDED:
        return Solution(lefty, Elbow.LEFTY)
    return Solution(righty, Elbow.RIGHTY)


def branches(
    scara: Scara, x: float, y: float, z: float, near: float = 0.0
) -> tuple[Triple | None, Triple | None]:
    """Compute both branches, righty and lefty; None for one that breaks a limit.

    Raises:
        UnreachableError: See :func:`solve_elbow`.
    """

    def attempt(elbow: Elbow) -> Triple | None:
        try:
            return solve_elbow(scara, x, y, z, elbow, near)
        except JointLimitError:
            return None

    return attempt(Elbow.RIGHTY), attempt(Elbow.LEFTY)


def _distance(q: Sequence[float], other: Sequence[float]) -> float:
    """Return how far the two turning joints are apart [rad]."""
    return math.hypot(q[0] - other[0], q[1] - other[1])


def _unreachable(scara: Scara, x: float, y: float, z: float) -> UnreachableError:
    """Say why no joint positions exist for a target."""
    for axis, value in (("x", x), ("y", y), ("z", z)):
        if not math.isfinite(value):
            return UnreachableError(f"target {axis} = {value} is not finite")
    return UnreachableError(
        f"target ({x:.6g}, {y:.6g}) m is at radius {math.hypot(x, y):.6g} m, outside the reach "
        f"[{scara.inner_radius:.4g}, {scara.outer_radius:.4g}] m"
    )


def _at_limit(scara: Scara, target: Triple, q: Triple) -> Triple:
    """Return ``q`` put on the limits that only rounding has broken, or raise why it is refused."""
    x, y, z = target
    if not math.isfinite(z) or math.hypot(x, y) < scara.inner_radius - REACH_TOLERANCE:
        raise _unreachable(scara, x, y, z)
    try:
        q1, q2, q3 = check_limits(scara.joints, q)
    except JointLimitError as error:
        raise JointLimitError(f"target ({x:.6g}, {y:.6g}, {z:.6g}) m: {error}") from None
    return q1, q2, q3
