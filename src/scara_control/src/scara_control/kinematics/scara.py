r"""Closed-form kinematics of a SCARA of three or four axes.

It has two arms that turn about parallel axes, of the lengths in robot.yaml, a stroke along them,
and perhaps a wrist that turns the tool. What each joint does:
:mod:`scara_control.kinematics.scara_axes`.

Plain ``math``, one point at a time.

Righty means that the forearm bends anticlockwise from the upper arm, lefty clockwise. Let ``a^2 =
(L1+L2)^2 - r^2`` and ``b^2 = r^2 - (L1-L2)^2`` with ``r = |(x, y)|`` from the shoulder to the
wrist. The law of cosines for half the angle gives ``tan(bend/2) = a/b``, and ``tan(alpha) = a b /
(r^2 + L1^2 - L2^2)`` for the angle between the upper arm and the line to the wrist. Both come from
the same a and b, so at the edge of the reach, where an arc cosine loses half of the digits, what is
lost in the elbow is made up for by the shoulder and the tool still arrives to the last digit.

The tool's yaw is the sum of the turning joints, ``sum s_i q_i``, with the signs ``s_i`` of their
axes: 0 with all joints at 0. The wrist gives what the arms leave of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import atan2, cos, sin, sqrt
from typing import NamedTuple

from scara_config import Joint, Robot

from scara_control.errors import JointLimitError, ScaraControlError, UnreachableError
from scara_control.kinematics.scara_axes import Axes, read_axes
from scara_control.limits import LIMIT_TOLERANCE, check_joint_vector, check_limits

REACH_TOLERANCE = 1e-9
"""[m] A target this far beyond the edge of the ring is put on the edge: rounding, as at P1 = (0.65,
0, 0), where the sum of the arms is 0.6499999999999999 (our choice: 10 000 times finer than the
robot's repeatability)."""

_UNDECIDED = 1e-9
_TURN = 2.0 * math.pi

Triple = tuple[float, float, float]
Joints = tuple[float, ...]


class Elbow(Enum):
    """On which side of the line from base to tool the elbow stands."""

    RIGHTY = "righty"
    LEFTY = "lefty"

    @classmethod
    def of(cls, bend: float) -> Elbow:
        """Return the branch by how far the forearm is turned from the upper arm [rad].

        The straight arm counts as righty.
        """
        return cls.LEFTY if bend < 0.0 else cls.RIGHTY


class Solution(NamedTuple):
    """Joint positions of one target [rad], prismatic [m], and their branch.

    None: the arm has none by name.
    """

    q: Joints
    elbow: Elbow | None


@dataclass(frozen=True, slots=True)
class Scara:
    """Lengths and joints of a SCARA.

    Attributes:
        l1: Shoulder to elbow [m].
        l2: Elbow to the wrist, or to the tool of an arm without one [m].
        h: z of the tool at a stroke of 0 [m].
        joints: Base to tool; joint vectors have this order.
        axes: Which of them does what.
        limits: Lower and upper limit of each [rad], prismatic [m].
        bent: How far the forearm is turned from the upper arm with all joints at 0 [rad].
        many_turns: Of each joint, whether one place of it can be more than one value.
    """

    l1: float
    l2: float
    h: float
    joints: tuple[Joint, ...]
    axes: Axes
    limits: tuple[tuple[float, float], ...] = field(init=False, repr=False)
    bent: float = field(init=False, repr=False)
    many_turns: tuple[bool, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        limits = tuple((joint.lower, joint.upper) for joint in self.joints)
        plain = self.axes.wrist is None and self.axes.shoulder.zero == self.axes.elbow.zero == 0.0
        inside = [plain and -math.pi < low and high < math.pi for low, high in limits]
        for name, value in (
            ("limits", limits),
            ("bent", self.axes.elbow.zero - self.axes.shoulder.zero),
            ("many_turns", tuple(not each for each in inside)),
        ):
            object.__setattr__(self, name, value)

    @classmethod
    def from_robot(cls, robot: Robot) -> Scara:
        """Take the lengths, and the joints that move the twin's tool, from robot.yaml.

        Raises:
            ScaraControlError: See :func:`scara_control.kinematics.scara_axes.read_axes`; or there
                is no ``geometry``.
        """
        axes = read_axes(robot)
        size = robot.geometry
        if size is None:
            raise ScaraControlError(f"{robot.name} has no geometry in robot.yaml")
        lengths = size.l1_mm / 1e3, size.l2_mm / 1e3, size.h_mm / 1e3
        return cls(*lengths, tuple(robot.arm_joints), axes)

    @property
    def outer_radius(self) -> float:
        """Radius of the straight arm [m]."""
        return self.l1 + self.l2

    @property
    def inner_radius(self) -> float:
        """Smallest radius [m]: the elbow at its larger limit, not L1 - L2."""
        elbow = self.axes.elbow
        bends = sorted(self.bent + elbow.sign * limit for limit in self.limits[elbow.column])
        # Folded lies between the limits if an odd multiple of half a turn does.
        folded = math.ceil((bends[0] / math.pi - 1.0) / 2.0) * 2.0 + 1.0 <= bends[1] / math.pi
        cosine = -1.0 if folded else min(map(cos, bends))
        return sqrt(max(self.l1**2 + self.l2**2 + 2.0 * self.l1 * self.l2 * cosine, 0.0))

    def bend(self, q: Sequence[float]) -> float:
        """Return how far the forearm is turned from the upper arm, in (-pi, pi] [rad]."""
        elbow = self.axes.elbow
        return math.remainder(self.bent + elbow.sign * q[elbow.column], _TURN)


def tool_position(scara: Scara, *q: float) -> Triple:
    """Compute where the tool's origin is.

    Args:
        scara: Lengths and axes.
        q: Joint positions, base to tool: [rad], prismatic [m].

    Returns:
        x, y, z in the base frame [m].
    """
    (x, y), shoulder, elbow, slide, wrist, offset = scara.axes
    upper = shoulder.sign * q[shoulder.column]
    fore = upper + elbow.sign * q[elbow.column]
    x += scara.l1 * cos(upper + shoulder.zero) + scara.l2 * cos(fore + elbow.zero)
    y += scara.l1 * sin(upper + shoulder.zero) + scara.l2 * sin(fore + elbow.zero)
    if wrist is not None and offset:
        yaw = fore + wrist.sign * q[wrist.column]
        x, y = x + offset * cos(yaw + wrist.zero), y + offset * sin(yaw + wrist.zero)
    return x, y, scara.h + slide.sign * q[slide.column]


def tool_yaw(scara: Scara, q: Sequence[float]) -> float:
    """Compute how far the tool is turned about z of the base from where it is at zero joints.

    Args:
        scara: Axes.
        q: Joint positions or velocities, base to tool.

    Returns:
        Sum of the turning joints, each by the sign of its axis, not wrapped [rad] or [rad/s].
    """
    _, shoulder, elbow, _, wrist, _ = scara.axes
    yaw = shoulder.sign * q[shoulder.column] + elbow.sign * q[elbow.column]
    return yaw if wrist is None else yaw + wrist.sign * q[wrist.column]


def solve_elbow(
    scara: Scara,
    x: float,
    y: float,
    z: float,
    elbow: Elbow,
    seed: Sequence[float] | None = None,
    yaw: float | None = None,
) -> Joints:
    """Compute the joint positions that bring the tool to a point with the elbow on the wanted side.

    Args:
        scara: Lengths and limits.
        x: Target in the base frame [m].
        y: Target in the base frame [m].
        z: Target in the base frame [m].
        elbow: Branch; on the edge of the reach both are the same.
        seed: Joint positions to be near to, of the turns that the limits allow; None: all 0.
        yaw: How the tool shall be turned [rad], see :func:`tool_yaw`; whole turns do not count.
            None: as with ``seed``, where the arm has a wrist.

    Returns:
        Joint positions, base to tool: [rad], prismatic [m], within their limits.

    Raises:
        UnreachableError: Not finite, or no bend gives this radius; the text names radius and range.
        JointLimitError: The branch breaks a limit; the text names joint, value and range.
        ScaraControlError: ``yaw`` for an arm without a wrist.
    """
    near = seed if seed is not None else (0.0,) * len(scara.joints)
    (base_x, base_y), shoulder, elbow_axis, slide, wrist, offset = scara.axes
    if wrist is None:
        if yaw is not None:
            raise ScaraControlError("yaw: this arm has no joint that turns its tool; leave it out")
        out, up = x - base_x, y - base_y
    else:
        wanted = tool_yaw(scara, near) if yaw is None else yaw
        if not math.isfinite(wanted):
            raise UnreachableError(f"target yaw = {wanted} is not finite")
        out = x - base_x - offset * cos(wanted + wrist.zero)
        up = y - base_y - offset * sin(wanted + wrist.zero)
    l1, l2 = scara.l1, scara.l2
    outer, inner, r = l1 + l2, abs(l1 - l2), sqrt(out * out + up * up)
    if not inner - REACH_TOLERANCE <= r <= outer + REACH_TOLERANCE:
        raise _unreachable(scara, (x, y, z), r)
    # As products: differences of squares would lose their digits at the edge of the reach.
    a = sqrt((outer - r) * (outer + r)) if r < outer else 0.0
    b = sqrt((r - inner) * (r + inner)) if r > inner else 0.0
    if elbow is Elbow.LEFTY:
        a = -a
    along, across = r * r + (l1 * l1 - l2 * l2), a * b
    upper = atan2(up * along - out * across, out * along + up * across)
    bend = 2.0 * atan2(a, b)
    # Adding 0.0 leaves no -0.0 on the edge.
    q = [0.0] * len(scara.joints)
    q[shoulder.column] = _turned(scara, shoulder.column, upper - shoulder.zero, shoulder.sign, near)
    q[elbow_axis.column] = _turned(
        scara, elbow_axis.column, bend - scara.bent, elbow_axis.sign, near
    )
    q[slide.column] = slide.sign * (z - scara.h) + 0.0
    if wrist is not None:
        left = wanted - shoulder.sign * q[shoulder.column]
        left -= elbow_axis.sign * q[elbow_axis.column]
        q[wrist.column] = _turned(scara, wrist.column, left, wrist.sign, near)
    # A z that is no number ends here, too: it compares as outside.
    for value, (low, high) in zip(q, scara.limits):
        if not low <= value <= high:
            return _at_limit(scara, (x, y, z), r, None if wrist is None else wanted, q)
    return tuple(q)


def solve(
    scara: Scara,
    x: float,
    y: float,
    z: float,
    elbow: Elbow | None = None,
    seed: Sequence[float] | None = None,
    yaw: float | None = None,
) -> Solution:
    """Compute the joint positions for a tool position.

    Args:
        scara: Lengths and limits.
        x: Target in the base frame [m].
        y: Target in the base frame [m].
        z: Target in the base frame [m].
        elbow: Branch; None: the allowed one nearer to ``seed``.
        seed: Joint positions to stay near to; None: righty first. Undecided is righty.
        yaw: See :func:`solve_elbow`.

    Returns:
        The chosen branch.

    Raises:
        UnreachableError: See :func:`solve_elbow`.
        JointLimitError: The wanted branch breaks a limit, or with ``elbow`` None both do.
        JointVectorError: ``seed`` is no joint vector.
        ScaraControlError: See :func:`solve_elbow`.
    """
    start = None if seed is None else check_joint_vector(scara.joints, seed)
    if elbow is not None:
        return Solution(solve_elbow(scara, x, y, z, elbow, start, yaw), elbow)
    righty, lefty = branches(scara, x, y, z, start, yaw)
    if righty is None and lefty is None:
        # Solved once more for its refusal, which names joint, value and range.
        return Solution(solve_elbow(scara, x, y, z, Elbow.RIGHTY, start, yaw), Elbow.RIGHTY)
    if righty is None or (
        lefty is not None
        and start is not None
        # At the edge of the reach both are one, and rounding must not choose lefty there.
        and _distance(scara, lefty, start) < _distance(scara, righty, start) - _UNDECIDED
    ):
        assert lefty is not None
        return Solution(lefty, Elbow.LEFTY)
    return Solution(righty, Elbow.RIGHTY)


def branches(
    scara: Scara,
    x: float,
    y: float,
    z: float,
    seed: Sequence[float] | None = None,
    yaw: float | None = None,
) -> tuple[Joints | None, Joints | None]:
    """Compute both branches, righty and lefty; None for one that breaks a limit.

    Raises:
        UnreachableError: See :func:`solve_elbow`.
        ScaraControlError: See :func:`solve_elbow`.
    """

    def attempt(elbow: Elbow) -> Joints | None:
        try:
            return solve_elbow(scara, x, y, z, elbow, seed, yaw)
        except JointLimitError:
            return None

    return attempt(Elbow.RIGHTY), attempt(Elbow.LEFTY)


def _turned(scara: Scara, column: int, angle: float, sign: float, near: Sequence[float]) -> float:
    """Return a joint's value for an angle: of the turns within its limits the one next to ``near``.

    Where none is within, the one in (-pi, pi].
    """
    value, (low, high) = sign * angle + 0.0, scara.limits[column]
    if not scara.many_turns[column]:
        return value
    least = math.ceil((low - LIMIT_TOLERANCE - value) / _TURN)
    most = math.floor((high + LIMIT_TOLERANCE - value) / _TURN)
    if least > most:
        return math.remainder(value, _TURN)
    return value + _TURN * min(max(round((near[column] - value) / _TURN), least), most)


def _distance(scara: Scara, q: Sequence[float], other: Sequence[float]) -> float:
    """Return how far shoulder and elbow are apart [rad]."""
    one, two = scara.axes.shoulder.column, scara.axes.elbow.column
    return math.hypot(q[one] - other[one], q[two] - other[two])


def _unreachable(scara: Scara, target: Triple, r: float) -> UnreachableError:
    """Say why no joint positions exist for a target."""
    for axis, value in zip("xyz", target):
        if not math.isfinite(value):
            return UnreachableError(f"target {axis} = {value} is not finite")
    what = "puts the wrist" if scara.axes.offset else "is"
    return UnreachableError(
        f"target ({target[0]:.6g}, {target[1]:.6g}) m {what} at radius {r:.6g} m, outside the "
        f"reach [{scara.inner_radius:.4g}, {scara.outer_radius:.4g}] m"
    )


def _at_limit(
    scara: Scara, target: Triple, r: float, yaw: float | None, q: Sequence[float]
) -> Joints:
    """Return ``q`` put on the limits that only rounding has broken, or raise why it is refused."""
    # Nearer than the elbow can fold: out of reach, whichever joint is at its limit.
    if not math.isfinite(target[2]) or r < scara.inner_radius - REACH_TOLERANCE:
        raise _unreachable(scara, target, r)
    try:
        return check_limits(scara.joints, q)
    except JointLimitError as error:
        place = ", ".join(f"{value:.6g}" for value in target)
        turned = "" if yaw is None else f", yaw {yaw:.6g} rad"
        raise JointLimitError(f"target ({place}) m{turned}: {error}") from None
