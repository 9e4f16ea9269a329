r"""Inverse kinematics of any open chain by least squares over its screw axes.

It is for arms without a closed form here.

The tool keeps the orientation that it has at home, turned about z of the base by a yaw if one is
given, so a tool position asks for all six degrees of freedom of a six-joint arm. An arm of fewer
joints cannot have both: its tool comes to the place turned as it may be. Several starts are tried
in a fixed order: the same question has the same answer on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scara_config import Joint, Robot

from scara_control.errors import ScaraControlError, UnreachableError
from scara_control.kinematics.jacobians import pose_and_jacobian, tip_jacobian
from scara_control.kinematics.scara import Triple
from scara_control.kinematics.scara_velocity import JointVelocities
from scara_control.kinematics.screws import ScrewModel, forward_kinematics, nearest_on_axis
from scara_control.kinematics.twists import FloatArray, exp6, quaternion, skew
from scara_control.limits import LIMIT_TOLERANCE, check_joint_vector

POSITION_TOLERANCE = 1e-7
"""[m] A found solution is at most so far from the target (our choice: 100 times finer than a
robot's repeatability)."""

ROTATION_TOLERANCE = 1e-6
"""Largest entry of the difference of two rotations, about an angle [rad] (our choice: 0.1 um at 0.1
m)."""

ARM_LENGTH = 0.3
"""[m] What an error of orientation weighs beside one of position (our choice: the length of a
link)."""

STARTS = 16
"""Starts beside the given one and home (our choice: 299 of 300 random targets needed 8 at most)."""

SINGULAR_BELOW = 0.02
"""Smallest singular value of the Jacobian (m and rad alike) below which damping sets in (our
choice)."""

DAMPING = 0.02
"""Damping at the singularity itself (our choice)."""

_NEWTON_STEPS, _NEWTON_CLOSE = 12, 1e-11
"""Most steps of Newton's method, and how far the tool may be off at its end [m, rad]."""


@dataclass(frozen=True, eq=False)
class NumericArm:
    """An arm by its screws, with limits and the orientation that the tool keeps.

    Attributes:
        joints: Base to tool.
        chain: Screw axes and home pose.
        home: Joint positions at home, shape ``(n,)``: [rad], prismatic [m].
        rotation: Orientation of the tool at home, shape ``(3, 3)``.
        starts: So many are tried beside the given one and home.
    """

    joints: tuple[Joint, ...]
    chain: ScrewModel
    home: FloatArray
    rotation: FloatArray
    starts: int = STARTS

    @classmethod
    def from_robot(cls, robot: Robot, starts: int = STARTS) -> NumericArm:
        """Take the joints that move the twin's tool from robot.yaml.

        Raises:
            ScrewModelError: The screw axes are no mechanism.
        """
        joints, chain = tuple(robot.arm_joints), ScrewModel.from_robot(robot)
        home = np.array([robot.home[joint.name] * joint.scale for joint in joints])
        return cls(joints, chain, home, forward_kinematics(chain, home)[:3, :3], starts)

    @property
    def keeps_turn(self) -> bool:
        """Whether it has joints enough for a place and an orientation."""
        return len(self.joints) >= 6

    @property
    def lower(self) -> FloatArray:
        """Lower limits, shape ``(n,)``."""
        return np.array([joint.lower for joint in self.joints])

    @property
    def upper(self) -> FloatArray:
        """Upper limits, shape ``(n,)``."""
        return np.array([joint.upper for joint in self.joints])

    @property
    def reach(self) -> tuple[FloatArray, float]:
        """Return a place that no joint moves, and how far from it the tool can be at most [m].

        From axis to axis it is always as far as at home; a slide is out as far as it goes.
        """
        place, radius = np.array(self.chain.home_origin), 0.0
        for (turns, omega, v), joint in zip(self.chain.plain_screws[::-1], self.joints[::-1]):
            if turns:
                before, place = place, nearest_on_axis(omega, v, place)
                radius += float(np.linalg.norm(before - place))
            else:
                radius += max(abs(joint.lower), abs(joint.upper)) + LIMIT_TOLERANCE
        return place, radius

    def tool_position(self, q: Sequence[float]) -> Triple:
        """Return where the tool's origin is [m]."""
        x, y, z = forward_kinematics(self.chain, q)[:3, 3].tolist()
        return x, y, z

    def tool_yaw(self, q: Sequence[float]) -> float:
        """Return the turn about z of the base in the tool's turn from home, its twist [rad]."""
        turn = forward_kinematics(self.chain, q)[:3, :3] @ self.rotation.T
        return math.atan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])


def inverse(
    arm: NumericArm,
    target: Sequence[float],
    elbow_wanted: bool = False,
    seed: Sequence[float] | None = None,
    yaw: float | None = None,
) -> tuple[float, ...]:
    """Compute joint positions that bring the tool to ``target``, oriented as at home.

    Args:
        arm: The arm.
        target: x, y, z in the base frame [m].
        elbow_wanted: Whether righty or lefty was asked for, which this arm does not know.
        seed: Joint positions to stay near to; None: home.
        yaw: How far the tool is turned from there about z of the base [rad]; None: not.

    Returns:
        Within the limits: the solution that ``seed`` leads to, else of those found the nearest to
        it.

    Raises:
        UnreachableError: Not finite, or no start leads there; the text says how near the best came,
            or where the stretched arm ends.
        ScaraControlError: ``elbow_wanted``, or a ``yaw`` of an arm that cannot choose it.
        JointVectorError: ``seed`` is no joint vector.
    """
    if elbow_wanted:
        raise ScaraControlError("elbow: this arm has no righty and lefty; leave it empty")
    place = np.array([float(value) for value in target])
    if not np.isfinite(place).all():
        raise UnreachableError(f"target {tuple(place.tolist())} is not finite")
    if yaw is not None:
        if not arm.keeps_turn:
            raise ScaraControlError(f"yaw: an arm of {len(arm.joints)} joints cannot choose it")
        if not math.isfinite(yaw):
            raise UnreachableError(f"target yaw = {yaw} is not finite")
        turn = exp6(np.array([0.0, 0.0, yaw, 0.0, 0.0, 0.0]))[:3, :3]
        arm = replace(arm, rotation=turn @ arm.rotation)
    start = arm.home if seed is None else np.array(check_joint_vector(arm.joints, seed))
    shown = ", ".join(f"{value:.6g}" for value in place)
    how = "as at home" if yaw is None else f"turned by {yaw:.6g} rad"
    how = how if arm.keeps_turn else "turned as it may be"
    refused = f"target ({shown}) m, the tool {how}: not reached within the joints' limits; "
    centre, reach = arm.reach
    beyond = float(np.linalg.norm(place - centre)) - reach
    # All starts would take tenths of a second to find the same.
    if beyond > POSITION_TOLERANCE:
        raise UnreachableError(f"{refused}the stretched arm ends {beyond * 1e3:.3g} mm away")
    best: tuple[float, float] = (math.inf, math.inf)
    found: list[FloatArray] = []
    for number, begin in enumerate(_starts(arm, start)):
        q = _descend(arm, place, begin)
        pose = forward_kinematics(arm.chain, q)
        distance = float(np.linalg.norm(pose[:3, 3] - place))
        turned = float(np.abs(pose[:3, :3] - arm.rotation).max()) if arm.keeps_turn else 0.0
        if distance <= POSITION_TOLERANCE and turned <= ROTATION_TOLERANCE:
            found.append(q)
            # What the seed or home leads to is taken at once; of the others the nearest of three.
            if number < 2 or len(found) == 3:
                break
        best = min(best, (distance + ARM_LENGTH * turned, distance))
    if not found:
        raise UnreachableError(
            refused + f"the best of {arm.starts + 2} starts ends {best[1] * 1e3:.3g} mm away"
        )
    nearest = min(found, key=lambda q: float(np.linalg.norm(q - start)))
    return tuple(np.clip(nearest, arm.lower, arm.upper).tolist())


def velocities_for(
    arm: NumericArm,
    q: Sequence[float],
    velocity: Sequence[float],
    turn_rate: Sequence[float] = (0.0, 0.0, 0.0),
) -> JointVelocities:
    r"""Compute joint velocities that move the tool's origin and turn the tool.

    .. math:: \dot q = J^T (J J^T + \lambda^2 I)^{-1} (\omega, v)

    Args:
        arm: The arm.
        q: Joint positions, shape ``(n,)``.
        velocity: Wanted velocity in the base frame, shape ``(3,)`` [m/s].
        turn_rate: How fast the tool turns, in the base frame, shape ``(3,)`` [rad/s].

    Returns:
        Joint velocities, and as manipulability the smallest singular value of the Jacobian. An arm
        of fewer than six joints turns its tool as it may.

    Raises:
        JointVectorError: A wrong count or a value that is not finite.
        ScaraControlError: A ``turn_rate`` of an arm that cannot choose it.

    Source:
        Nakamura & Hanafusa, Inverse kinematic solutions with singularity robustness (1986).
    """
    jacobian = tip_jacobian(arm.chain, check_joint_vector(arm.joints, q))
    twist = np.array([*turn_rate, *velocity])
    if not arm.keeps_turn:
        if any(turn_rate):
            raise ScaraControlError(f"yaw: an arm of {len(arm.joints)} joints cannot choose it")
        jacobian, twist = jacobian[3:], twist[3:]
    smallest = float(np.linalg.svd(jacobian, compute_uv=False)[-1])
    share = max(0.0, 1.0 - smallest / SINGULAR_BELOW)
    damped = jacobian @ jacobian.T + (DAMPING * share) ** 2 * np.eye(len(twist))
    qdot = jacobian.T @ np.linalg.solve(damped, twist)
    return JointVelocities(tuple(qdot.tolist()), smallest, share > 0.0)


def turn_between(arm: NumericArm, begin: Sequence[float], end: Sequence[float]) -> Triple:
    """Return the tool's turn from one joint vector to another as a rotation vector [rad].

    In the base frame, by the shorter way; zeros for an arm that cannot choose it.
    """
    if not arm.keeps_turn:
        return 0.0, 0.0, 0.0
    rotations = [forward_kinematics(arm.chain, q)[:3, :3] for q in (begin, end)]
    return _rotation_vector(rotations[1] @ rotations[0].T)


def near(
    arm: NumericArm,
    begin: Sequence[float],
    guess: Sequence[float],
    point: Sequence[float],
    turn: Sequence[float],
) -> tuple[float, ...]:
    """Return the joint positions next to ``guess`` for a place and turn of the tool, by Newton.

    Args:
        arm: The arm.
        begin: Joint positions where the tool's turn is counted from.
        guess: Near to what is wanted, shape ``(n,)``.
        point: x, y, z in the base frame [m].
        turn: From how the tool is turned at ``begin``, a rotation vector [rad].

    Raises:
        UnreachableError: It does not lead there.
    """
    wanted = exp6(np.array([*turn, 0.0, 0.0, 0.0]))[:3, :3]
    wanted = wanted @ forward_kinematics(arm.chain, begin)[:3, :3]
    q = np.array(guess, dtype=float)
    for _ in range(_NEWTON_STEPS):
        pose, jacobian = pose_and_jacobian(arm.chain, q)
        apart = np.array(point) - pose[:3, 3]
        if arm.keeps_turn:
            apart = np.concatenate([_rotation_vector(wanted @ pose[:3, :3].T), apart])
        else:
            jacobian = jacobian[3:]
        if float(np.abs(apart).max()) < _NEWTON_CLOSE:
            return tuple(q.tolist())
        # Not an inverse: an arm may have more or fewer joints than the task has numbers.
        q = q + np.linalg.lstsq(jacobian, apart, rcond=1e-9)[0]
    raise UnreachableError("no joint positions near those before it bring the tool there")


def _rotation_vector(rotation: FloatArray) -> Triple:
    x, y, z, w = quaternion(rotation)
    sine = math.hypot(x, y, z)
    # The quaternion's w is not negative, so the turn is the shorter one.
    by = 2.0 * math.atan2(sine, w) / sine if sine > 0.0 else 0.0
    return by * x, by * y, by * z


def tool_velocity_of(arm: NumericArm, q: Sequence[float], qdot: Sequence[float]) -> Triple:
    """Compute the velocity of the tool's origin in the base frame [m/s]."""
    x, y, z = (tip_jacobian(arm.chain, q) @ np.asarray(qdot, dtype=float))[3:].tolist()
    return x, y, z


def _starts(arm: NumericArm, seed: FloatArray) -> Iterator[FloatArray]:
    """Yield the given start, home, then points that fill the joint space evenly."""
    from scipy.stats import qmc  # half a second, which the nodes of a SCARA need not wait for

    yield seed
    yield arm.home
    # Scrambled, the same question would have another answer each time.
    for share in qmc.Halton(len(arm.joints), scramble=False).random(arm.starts):
        yield arm.lower + share * (arm.upper - arm.lower)


def _descend(arm: NumericArm, target: FloatArray, start: FloatArray) -> FloatArray:
    """Return the joint positions within the limits where the errors are least, near ``start``."""
    from scipy.optimize import (
        least_squares,
    )  # half a second, which the nodes of a SCARA need not wait for

    margin = 1e-6 * (arm.upper - arm.lower)
    # least_squares refuses a start outside its bounds, and a seed may be there.
    begin = np.clip(start, arm.lower + margin, arm.upper - margin)

    def residual(q: FloatArray) -> FloatArray:
        pose = forward_kinematics(arm.chain, q)
        if not arm.keeps_turn:
            apart: FloatArray = pose[:3, 3] - target
            return apart
        return np.concatenate(
            [pose[:3, 3] - target, ARM_LENGTH * (pose[:3, :3] - arm.rotation).ravel()]
        )

    def slope(q: FloatArray) -> FloatArray:
        pose, jacobian = pose_and_jacobian(arm.chain, q)
        rows = [jacobian[3:]]
        if arm.keeps_turn:
            turns = (skew(omega) @ pose[:3, :3] for omega in jacobian[:3].T)
            rows.append(ARM_LENGTH * np.array([turn.ravel() for turn in turns]).T)
        return np.vstack(rows)

    solved = least_squares(
        residual,
        begin,
        slope,
        # A little wider, for a target that is just at a limit: what is found is clipped in the end.
        (arm.lower - LIMIT_TOLERANCE, arm.upper + LIMIT_TOLERANCE),
        # As far as it goes: whether the tool is there is judged afterwards, in metres and radians.
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
        max_nfev=60,
    )
    return np.asarray(solved.x)
