r"""Says which gains can be stable at the physics step, before a joint has to find out.

All joints together, linear about standstill, as the simulator steps them (semi-implicit Euler):

.. math::
    v_{k+1} &= v_k + h\,\bigl(M^{-1}(u_k - D v_k) - \omega^2 q_k - 2 \omega v_k\bigr), \qquad
    q_{k+1} = q_k + h\,v_{k+1} \\ u_k &= -p\,q_k - i h \sum_{j \le k} q_j - d\,v_k
    \quad\text{(position)}, \qquad u_k = -p\,v_k - i h \sum_{j \le k} v_j - d\,(v_k - v_{k-1}) / h
    \quad\text{(velocity)}

It is stable if no pole lies outside the unit circle for any pose and any mix of position and
velocity loops. For one joint of inertia :math:`J` alone this is Jury's criterion with :math:`a = p
h^2 / J,\ b = d h / J,\ c = i h^3 / J`:

.. math:: 2 a + 4 b + c < 8, \qquad c\,(1 - b) < a\,b, \qquad 0 < b < 2

so the smallest inertia that a joint sees (the others free) bounds p and d from above, and the
largest (the others held) bounds i. Effort limits, dry friction and the clamp of the integral are
left out: they bound an oscillation, none ends it.

Source: Jury, Theory and Application of the z-Transform Method (1964); derivation ours, tested
against simulated joints.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray
from scara_control.pid import PidGains

from scara_simulation.config import LoopGains

Array = NDArray[np.float64]
Kind = Literal["position", "velocity"]

KINDS: tuple[Kind, Kind] = ("position", "velocity")
TOLERANCE = 1e-7
"""How far outside the unit circle a pole may seem to lie: what rounding makes of a pole at 1. Our
choice."""
MOST_COUPLED = 4
"""With so many joints at most all mixes of loops are tried; the effort doubles with each joint. Our
choice."""
_GRID = 49
_DECADES = 12.0
_HALVINGS = 40


class Plant(msgspec.Struct, frozen=True):
    """What the loops act on.

    Attributes:
        mass_matrices: Inertia over the workspace, shape (m, n, n): [kg m^2], prismatic [kg].
        damping: Of each joint, shape (n,): [N m s/rad], [N s/m].
        dt: Physics step [s].
        bandwidth: Of the error in the computed torque [rad/s]; 0: none.
        extremes: With many joints: smallest (the others free) and largest (the others held) inertia
            that each sees, shape (n, 2); else empty.
    """

    mass_matrices: Array
    damping: Array
    dt: float
    bandwidth: float = 0.0
    extremes: tuple[tuple[float, float], ...] = ()

    def group(self, joint: int) -> list[int]:
        """Return the joints whose motion is coupled with that of ``joint``, itself included."""
        coupled = np.any(np.abs(self.mass_matrices) > 1e-9, axis=0)
        reached = np.linalg.matrix_power(coupled.astype(float), len(coupled))[joint] > 0.0
        return [int(k) for k in np.flatnonzero(reached)]

    def alone(self, joint: int) -> Plant:
        """Return one joint's plant with its extremes of inertia in place of the coupling."""
        return Plant(
            np.array(self.extremes[joint]).reshape(2, 1, 1),
            self.damping[[joint]],
            self.dt,
            self.bandwidth,
        )

    def part(self, joints: Sequence[int]) -> Plant:
        """Return the plant of some joints alone, each different inertia once."""
        matrices = np.unique(self.mass_matrices[:, joints][:, :, joints].round(9), axis=0)
        return Plant(matrices, self.damping[list(joints)], self.dt, self.bandwidth)


def sample_plant(
    mass_matrix: Callable[[list[float]], Sequence[Sequence[float]]],
    limits: Sequence[tuple[float, float]],
    damping: Sequence[float],
    dt: float,
    bandwidth: float,
    per_joint: int | None = None,
) -> Plant:
    """Sample the inertia on a grid of poses from limit to limit.

    There are ``per_joint`` (odd: with the middle) for each joint.
    """
    per_joint = per_joint or (7 if len(limits) <= MOST_COUPLED else 5)
    axes = [np.linspace(lower, upper, per_joint) for lower, upper in limits]
    matrices = np.array(
        [mass_matrix([float(q) for q in pose]) for pose in itertools.product(*axes)]
    )
    extremes: tuple[tuple[float, float], ...] = ()
    if len(limits) > MOST_COUPLED:
        free = 1.0 / np.diagonal(np.linalg.inv(matrices), axis1=1, axis2=2).max(axis=0)
        held = np.diagonal(matrices, axis1=1, axis2=2).max(axis=0)
        extremes = tuple(zip(free.tolist(), held.tolist()))
    return Plant(np.unique(matrices.round(9), axis=0), np.array(damping), dt, bandwidth, extremes)


def spectral_radius(plant: Plant, loops: Sequence[tuple[Kind, PidGains]]) -> float:
    """Return the largest magnitude of the poles over all poses.

    Each joint has one closed loop.
    """
    n, h, w = len(loops), plant.dt, plant.bandwidth
    position = np.array([float(kind == "position") for kind, _ in loops])
    p, i, d = (np.array([getattr(gains, name) for _, gains in loops]) for name in ("p", "i", "d"))
    # States of a position loop: q, v, integral of -q; of a velocity loop: integral of -v, v, the
    # last v.
    to_first = np.where(position > 0.0, -(p + i * h), i)
    to_rate = np.where(position > 0.0, -d, -(p + i * h + d / h)) - plant.damping
    to_last = np.where(position > 0.0, i, d / h)
    mobility, eye, none = h * np.linalg.inv(plant.mass_matrices), np.eye(n), np.zeros((n, n))
    rate = np.concatenate(
        (
            mobility * to_first - h * w * w * np.diag(position),
            mobility * to_rate + (1.0 - 2.0 * h * w) * eye,
            mobility * to_last,
        ),
        axis=2,
    )
    kept = np.where(position > 0.0, 1.0, i > 0.0)  # an integral that nobody uses is no state
    first = h * position[:, None] * rate + np.hstack(
        (np.diag(kept), np.diag(-h * (1.0 - position)), none)
    )
    integrates = position * (i > 0.0)
    last = np.hstack((np.diag(-h * integrates), np.diag(1.0 - position), np.diag(integrates)))
    system = np.concatenate((first, rate, np.broadcast_to(last, (len(rate), n, 3 * n))), axis=1)
    return float(np.abs(np.linalg.eigvals(system)).max())


def worst_radius(plant: Plant, gains: Sequence[LoopGains], joint: int, kind: Kind) -> float:
    """Return the largest pole with the loop ``kind`` of ``joint`` closed.

    The other joints may have closed either loop.

    With more than ``MOST_COUPLED`` joints the two bounds of its inertia stand for the others.
    """
    if plant.extremes:
        return spectral_radius(plant.alone(joint), [(kind, getattr(gains[joint], kind))])
    group = plant.group(joint)
    part = plant.part(group)
    mixes = itertools.product(*([kind] if k == joint else KINDS for k in group))
    return max(
        spectral_radius(part, [(each, getattr(gains[k], each)) for k, each in zip(group, mix)])
        for mix in mixes
    )


def stable_range(
    plant: Plant, gains: Sequence[LoopGains], joint: int, kind: Kind, key: Literal["p", "i", "d"]
) -> tuple[float, float] | None:
    """Return the stable values of one gain that are nearest to the present one.

    All other gains stay as they are.

    Returns:
        Smallest and largest value, or None if no value of this gain alone is stable.
    """
    inertia, h = float(plant.mass_matrices[:, joint, joint].max()), plant.dt
    # Twice what Jury's criterion allows at most for any other gains.
    top = 16.0 * inertia / h ** ({"p": 2, "i": 3, "d": 1}[key] - (kind == "velocity"))

    def stable(value: float) -> bool:
        loops = msgspec.structs.replace(
            gains[joint], **{kind: _with(getattr(gains[joint], kind), key, value)}
        )
        return (
            worst_radius(plant, [*gains[:joint], loops, *gains[joint + 1 :]], joint, kind)
            <= 1.0 + TOLERANCE
        )

    present = min(getattr(getattr(gains[joint], kind), key), top)
    grid = sorted(
        {0.0, present, *(top * 10.0 ** (_DECADES * (k / (_GRID - 1) - 1.0)) for k in range(_GRID))}
    )
    good = [stable(value) for value in grid]
    if not any(good):
        return None
    nearest = min(
        (k for k, fine in enumerate(good) if fine), key=lambda k: abs(k - grid.index(present))
    )
    low = high = nearest
    while low > 0 and good[low - 1]:
        low -= 1
    while high < len(grid) - 1 and good[high + 1]:
        high += 1
    return (
        _edge(stable, grid[low], grid[low - 1]) if low > 0 else 0.0,
        _edge(stable, grid[high], grid[high + 1]) if high < len(grid) - 1 else grid[high],
    )


def _with(gains: PidGains, key: str, value: float) -> PidGains:
    return msgspec.structs.replace(gains, **{key: value})


def _edge(stable: Callable[[float], bool], inside: float, outside: float) -> float:
    """Return the stable value next to the border between a stable and an unstable one."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        if stable(middle):
            inside = middle
        else:
            outside = middle
    return inside
