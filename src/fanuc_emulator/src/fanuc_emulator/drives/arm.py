"""Where the tool is, and which joint positions bring it somewhere: the robot's own kinematics.

By the screw axes of robot.yaml (product of exponentials), and backwards by Newton's method; the
twin has kinematics of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scara_config import Robot
from scara_config.elbow import elbow_of

Matrix = NDArray[np.float64]
NEAR = 1e-10
"""A solution is so near [rad, m]."""
ROUNDS = 30
FEW, NEAR_BY, CLEAR = 6, 0.05, 4.0
"""Where many poses are solved at once: rounds, the longest step [rad, m], and so far from a
singularity, by ``SINGULAR``. Beyond them each is solved by itself [our]."""
_DAMPING = 1e-12
"""Keeps a step finite where the arm cannot go on."""
_EYE = np.eye(4)
SINGULAR = 0.005
"""Below this the Jacobian's smallest singular value, by reach, counts as a singularity [our]."""


class Arm:
    """The joints that move the tool.

    The flange of a SCARA is turned by R = J1 + J2 + J4, as its maker counts it [chk]; how tool0 of
    robot.yaml is turned about the same axis is no matter here.

    Args:
        robot: robot.yaml.

    Attributes:
        columns: Their places in robot.yaml's order.
        axes: How many directions the tool can go or turn in.
    """

    def __init__(self, robot: Robot) -> None:
        carried = [
            (k, joint.screw_axis) for k, joint in enumerate(robot.joints) if joint.screw_axis
        ]
        self.columns = tuple(k for k, _ in carried)
        self._screws = [_Screw(np.array(screw)) for _, screw in carried]
        self._home = np.array(robot.home_pose)
        if elbow_of(robot) is not None and self._home[2, 2] < 0.0:
            self._home[:3, :3] = np.diag((1.0, -1.0, -1.0))
        # Ways count by the reach, turns in rad: so both weigh alike in the singular values.
        self._scale = np.array([1.0, 1.0, 1.0, *[1e3 / robot.reach_mm] * 3])
        self._damping = _DAMPING * np.eye(len(carried))
        self._limits = [(robot.joints[k].lower, robot.joints[k].upper) for k in self.columns]

    def pose(self, q: Sequence[float] | Matrix) -> Matrix:
        """Return the tool's pose in the base, shape (4, 4) [m], at the arm's joint positions."""
        return self._chain(q)[0]

    def jacobian(self, q: Sequence[float]) -> Matrix:
        """Return the twist of the tool by each joint's speed, in the base, shape (6, n)."""
        return self._chain(q)[1]

    def singular(self, jacobian: Matrix) -> bool:
        """Tell whether the arm cannot go on in a direction that it has elsewhere."""
        values = np.linalg.svd(self._scale[:, None] * jacobian, compute_uv=False)
        return bool(values[-1] < SINGULAR)

    def solve(self, pose: Matrix, guess: Sequence[float] | Matrix) -> tuple[float, ...] | None:
        """Return joint positions near a guess at which the tool has a pose; None: there are none.

        Args:
            pose: In the base, shape (4, 4) [m].
            guess: Where the search begins [rad or m], shape (n,).
        """
        q = np.array(guess, dtype=float)
        for _ in range(ROUNDS):
            here, jacobian = self._chain(q)
            error = _twist(pose @ inverse(here))
            square = jacobian.T @ jacobian + self._damping
            step = np.linalg.solve(square, jacobian.T @ error)
            # Newton's step is good near by only: far from the solution it would leap past it.
            q = q + np.clip(step, -0.5, 0.5)
            if float(np.abs(step).max()) < NEAR:
                # Where the arm is as near as it can come, the step is none and the error stays.
                return tuple(map(float, q)) if float(np.abs(error).max()) < 1e-7 else None
        return None

    def solve_all(self, poses: Matrix, guesses: Matrix) -> tuple[Matrix, Matrix] | None:
        """Return what :meth:`solve` finds at many poses at once, and the Jacobians there.

        Args:
            poses: In the base, shape (m, 4, 4) [m].
            guesses: Near by, shape (m, n) [rad or m].

        Returns:
            Shapes (m, n) and (m, 6, n); None: it takes more than ``FEW`` rounds at one of them.
        """
        q = guesses
        for _ in range(FEW):
            here, jacobians = self._chains(q)
            error = _twists(poses, here)
            turned = jacobians.transpose(0, 2, 1)
            step = np.linalg.solve(turned @ jacobians + self._damping, turned @ error)[:, :, 0]
            # Not clipped as in solve: a step that is too long ends the search below.
            q = q + step
            largest = float(np.abs(step).max())
            if largest < NEAR:
                found = float(np.abs(error).max()) < 1e-7
                # The Jacobians above belong to the places before the last step.
                return (q, self._chains(q)[1]) if found else None
            if largest > NEAR_BY:
                return None
        return None

    def clear(self, jacobians: Matrix) -> bool:
        """Tell whether no place of many is near a singularity, by Jacobians of shape (m, 6, n)."""
        values = np.linalg.svd(self._scale[:, None] * jacobians, compute_uv=False)
        return bool(values[:, -1].min() > CLEAR * SINGULAR)

    def _chains(self, q: Matrix) -> tuple[Matrix, Matrix]:
        """Return poses and Jacobians at many joint positions, shape (m, n)."""
        here = np.tile(_EYE, (len(q), 1, 1))
        found = np.empty((len(q), 6, len(self._screws)))
        for k, screw in enumerate(self._screws):
            ways = here[:, :3, :3] @ screw.axis[:3]
            found[:, :3, k] = ways
            found[:, 3:, k] = np.cross(here[:, :3, 3], ways) + here[:, :3, :3] @ screw.axis[3:]
            here = here @ screw.all_moved(q[:, k, None, None])
        return here @ self._home, found

    def _chain(self, q: Sequence[float] | Matrix) -> tuple[Matrix, Matrix]:
        """Return pose and Jacobian."""
        here = _EYE
        columns = []
        for screw, position in zip(self._screws, q):
            columns.append(_carried(here, screw.axis))
            here = here @ screw.moved(float(position))
        return here @ self._home, np.array(columns).T


def _skew(w: Matrix) -> Matrix:
    x, y, z = w.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def cross(a: Matrix, b: Matrix) -> Matrix:
    """Return what numpy.cross does: a fifth of its time for two vectors."""
    (x, y, z), (u, v, w) = a.tolist(), b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


class _Screw:
    """A joint's axis at 0, and what its motion needs of it."""

    def __init__(self, axis: Matrix) -> None:
        self.axis = axis
        w, v = axis[:3], axis[3:]
        self._once, self._twice, self._along = (np.zeros((4, 4)) for _ in range(3))
        self._turns = bool(w.any())
        k = _skew(w)
        self._once[:3, :3], self._once[:3, 3] = k, -k @ k @ v
        self._twice[:3, :3], self._twice[:3, 3] = k @ k, k @ v
        self._along[:3, 3] = v + k @ k @ v

    def all_moved(self, theta: Matrix) -> Matrix:
        """Return many motions of the joint; shape (m, 1, 1) to (m, 4, 4)."""
        turned = np.sin(theta) * self._once + (1.0 - np.cos(theta)) * self._twice
        return np.asarray(_EYE + theta * self._along + turned)

    def moved(self, theta: float) -> Matrix:
        """Return the motion of the joint, shape (4, 4)."""
        found: Matrix = _EYE + theta * self._along
        if self._turns:
            found += math.sin(theta) * self._once + (1.0 - math.cos(theta)) * self._twice
        return found


def _carried(pose: Matrix, screw: Matrix) -> Matrix:
    """Return a joint's axis where the joints before it have carried it."""
    turn, place = pose[:3, :3], pose[:3, 3]
    w = turn @ screw[:3]
    return np.concatenate([w, cross(place, w) + turn @ screw[3:]])


def inverse(pose: Matrix) -> Matrix:
    """Return the inverse of a transform, shape (4, 4)."""
    found = _EYE.copy()
    found[:3, :3] = pose[:3, :3].T
    found[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return found


def rotation_vector(turn: Matrix) -> Matrix:
    """Return axis times angle of a rotation, shape (3,) [rad]."""
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine, cosine = 0.5 * float(np.linalg.norm(axis)), 0.5 * (float(np.trace(turn)) - 1.0)
    # Not by acos of the trace: near 0 it loses half its digits, and rounding takes it out of its
    # domain.
    angle = math.atan2(sine, cosine)
    if sine > 1e-9:
        return axis * (0.5 * angle / sine)
    if cosine > 0.0:
        return 0.5 * axis
    # Half a turn: its axis is the largest column of R + 1.
    both = turn + np.eye(3)
    column = both[:, int(np.argmax(np.linalg.norm(both, axis=0)))]
    return column * (math.pi / float(np.linalg.norm(column)))


def _twist(pose: Matrix) -> Matrix:
    """Return the twist that leads to a pose in one unit of time, to first order in its place."""
    turn = rotation_vector(pose[:3, :3])
    return np.concatenate([turn, pose[:3, 3] - 0.5 * cross(turn, pose[:3, 3])])


def _twists(poses: Matrix, here: Matrix) -> Matrix:
    """Return the twists that lead from poses to others near by, shape (m, 6, 1)."""
    turns = poses[:, :3, :3] @ here[:, :3, :3].transpose(0, 2, 1)
    axes = np.stack(
        [
            turns[:, 2, 1] - turns[:, 1, 2],
            turns[:, 0, 2] - turns[:, 2, 0],
            turns[:, 1, 0] - turns[:, 0, 1],
        ],
        axis=1,
    )
    sine = 0.5 * np.linalg.norm(axes, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(turns, axis1=1, axis2=2) - 1.0))
    # Where nothing turns both are 0; their quotient tends to what `out` holds there.
    share = np.divide(0.5 * angle, sine, out=np.full(len(sine), 0.5), where=sine > 1e-9)
    found = np.empty((len(poses), 6, 1))
    found[:, :3, 0] = share[:, None] * axes
    places = poses[:, :3, 3] - (turns @ here[:, :3, 3, None])[:, :, 0]
    found[:, 3:, 0] = places - 0.5 * np.cross(found[:, :3, 0], places)
    return found


def turned_by(vector: Matrix) -> Matrix:
    """Return the rotation of axis times angle, shape (3, 3)."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3) + _skew(vector)
    k = _skew(vector / angle)
    return np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * (k @ k)
