r"""What a motion asks of the joints, as a share of what they have.

.. math:: \tau = M(q) \ddot q + c(q, \dot q) + g(q) + d \dot q + f\,\mathrm{sign}(\dot q)

Source: Lynch & Park, Modern Robotics (2017), sec. 8.1 and 8.9 (friction).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from scara_config import Joint

from scara_control.joint_motion import JointMotion
from scara_control.motion.plan import Path

SAMPLES = 96
"""Points of a path at which its effort is looked at (our choice: the largest between two of them
is at most 3 % of an effort above it on the three robots)."""
_POSES, _POSES_OF_MANY, _MOST_POSES = 7, 5, 20_000
"""Positions of each joint at which unplanned motion is looked at: of four joints, and of more, but
fewer where all poses would be more than that, which take half a second (our choice)."""
LEAST = 0.05
"""Less than this share of its acceleration no joint gets: a load that needs less is a wrong one
(our choice)."""
_NOT_FELT = 1e-9


class DynamicModel(Protocol):
    """The arm with what hangs at its tool, in the twin's order of joints."""

    @property
    def damping(self) -> Sequence[float]:
        """Damping of each joint, shape (n,)."""

    @property
    def friction(self) -> Sequence[float]:
        """Dry friction of each joint, shape (n,)."""

    def inverse_dynamics(
        self, q: Sequence[float], qdot: Sequence[float], qddot: Sequence[float]
    ) -> Sequence[float]:
        """Return the efforts of inertia, velocity coupling and gravity."""

    def mass_matrix(self, q: Sequence[float]) -> list[list[float]]:
        """Return the joint-space inertia, shape (n, n)."""


@dataclass(frozen=True, slots=True)
class Load:
    """The arm with its payload, and what its joints may be asked for.

    Attributes:
        model: Its dynamics.
        permitted: Largest effort of each joint, shape ``(n,)``: [N m], prismatic [N].
    """

    model: DynamicModel
    permitted: tuple[float, ...]

    def shares(self, motion: JointMotion) -> tuple[float, ...]:
        """Return what a motion asks of each joint, as a share of what is permitted."""
        model = self.model
        efforts = model.inverse_dynamics(motion.q, motion.qdot, motion.qddot)
        return tuple(
            [
                # Dry friction has no direction at rest: a joint that stands has none.
                abs(tau + d * v + (math.copysign(f, v) if v else 0.0)) / most
                for tau, v, d, f, most in zip(
                    efforts, motion.qdot, model.damping, model.friction, self.permitted
                )
            ]
        )

    def demand(self, path: Path) -> float:
        """Return the largest share that a path asks of a joint; 1: just what is permitted."""
        step = path.duration / SAMPLES
        return max(max(self.shares(path.at(k * step))) for k in range(SAMPLES + 1))


def load_of(model: DynamicModel, joints: Sequence[Joint], effort_percent: float) -> Load:
    """Return an arm whose joints may be asked for ``effort_percent`` of their effort."""
    return Load(model, tuple(joint.effort * effort_percent / 100.0 for joint in joints))


def unplanned_shares(load: Load, joints: Sequence[Joint]) -> tuple[float, ...]:
    r"""Return the share of its acceleration that each joint has in any pose of the arm.

    For motion that nobody plans as a whole (jogs, commands to single joints): all joints may
    accelerate at once, in any direction. Velocity coupling is left out, since it is slow or of one
    joint alone.

    .. math:: s_i = \min_q \frac{\tau_i - |g_i(q)| - f_i - d_i v_i}{\sum_j |M_{ij}(q)|\,a_j}

    and a joint gets the least of those that its acceleration is felt by.

    Args:
        load: The arm.
        joints: Its joints, with their limits.

    Returns:
        Shares in (0, 1], shape ``(n,)``.
    """
    n = len(joints)
    own, felt = [1.0] * n, [[j == k for j in range(n)] for k in range(n)]
    still = [0.0] * n
    resistance = [
        # At the largest speed, where damping takes most.
        f + d * joint.velocity
        for f, d, joint in zip(load.model.friction, load.model.damping, joints)
    ]
    # A grid over the workspace, both ends of each joint among them.
    few = max(k for k in range(2, _POSES_OF_MANY + 1) if k == 2 or k**n <= _MOST_POSES)
    count = _POSES if n <= 4 else few
    axes = [
        [joint.lower + (joint.upper - joint.lower) * k / (count - 1) for k in range(count)]
        for joint in joints
    ]
    for q in itertools.product(*axes):
        gravity = load.model.inverse_dynamics(q, still, still)
        matrix = load.model.mass_matrix(q)
        for i, row in enumerate(matrix):
            asked = sum(abs(m) * joint.acceleration for m, joint in zip(row, joints))
            left = load.permitted[i] - abs(gravity[i]) - resistance[i]
            # What gravity and friction leave may be negative, and a share must not be.
            own[i] = min(own[i], max(left / asked, LEAST))
            for j, m in enumerate(row):
                felt[i][j] = felt[i][j] or abs(m) > _NOT_FELT * row[i]
    return tuple(min(own[i] for i in range(n) if felt[i][j]) for j in range(n))
