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
MOST_POSES = 20_000
"""At which the inertia is sampled: of six joints all, of more a coarser grid. Our choice."""
_GRID = 49
_DECADES = 12.0
_PRECISION = 1e-9
"""Of the border; four digits of it are told."""


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
        # Coupled through others as well: the longest chain has as many links as there are joints.
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
        # Poses of equal inertia have equal poles.
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

    There are ``per_joint`` (odd: with the middle) for each joint; None: 7, with many joints 5, or
    3 where 5 are more than ``MOST_POSES``.
    """
    if per_joint is None:
        many = 5 if 5 ** len(limits) <= MOST_POSES else 3
        per_joint = 7 if len(limits) <= MOST_COUPLED else many
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
    return float(_spectral_radii(plant, [loops])[0])


def _spectral_radii(plant: Plant, many: Sequence[Sequence[tuple[Kind, PidGains]]]) -> Array:
    """Return :func:`spectral_radius` of each row of loops, shape (b,).

    All at once: a few small matrices cost less than the way to them.
    """
    h, w = plant.dt, plant.bandwidth
    position = np.array([[float(kind == "position") for kind, _ in loops] for loops in many])
    p, i, d = (
        np.array([[getattr(gains, name) for _, gains in loops] for loops in many])
        for name in ("p", "i", "d")
    )
    # States of a position loop: q, v, integral of -q; of a velocity loop: integral of -v, v, the
    # last v.
    to_first = np.where(position > 0.0, -(p + i * h), i)
    to_rate = np.where(position > 0.0, -d, -(p + i * h + d / h)) - plant.damping
    to_last = np.where(position > 0.0, i, d / h)
    mobility, eye = h * np.linalg.inv(plant.mass_matrices), np.eye(position.shape[1])

    def diagonal(values: Array) -> Array:
        return values[:, None, :, None] * eye  # the same for all poses

    def acts(factor: Array) -> Array:
        return np.asarray(mobility * factor[:, None, None, :])

    rate = np.concatenate(
        (
            acts(to_first) - h * w * w * diagonal(position),
            acts(to_rate) + (1.0 - 2.0 * h * w) * eye,
            acts(to_last),
        ),
        axis=3,
    )
    kept = np.where(position > 0.0, 1.0, i > 0.0)  # an integral that nobody uses is no state
    integrates = position * (i > 0.0)
    none = np.zeros_like(position)
    first = h * position[:, None, :, None] * rate + np.concatenate(
        [diagonal(each) for each in (kept, -h * (1.0 - position), none)], axis=3
    )
    last = np.concatenate(
        [diagonal(each) for each in (-h * integrates, 1.0 - position, integrates)], axis=3
    )
    system = np.concatenate((first, rate, np.broadcast_to(last, rate.shape)), axis=2)
    return np.asarray(np.abs(np.linalg.eigvals(system)).max(axis=(1, 2)))


def worst_radius(plant: Plant, gains: Sequence[LoopGains], joint: int, kind: Kind) -> float:
    """Return the largest pole with the loop ``kind`` of ``joint`` closed.

    The other joints may have closed either loop.

    With more than ``MOST_COUPLED`` joints the two bounds of its inertia stand for the others.
    """
    return float(_worst_radii(plant, gains, joint, kind)([gains[joint]])[0])


def _worst_radii(
    plant: Plant, gains: Sequence[LoopGains], joint: int, kind: Kind
) -> Callable[[Sequence[LoopGains]], Array]:
    """Return what gives :func:`worst_radius` for each candidate of one joint's gains."""
    if plant.extremes:
        alone = plant.alone(joint)
        return lambda candidates: _spectral_radii(
            alone, [[(kind, getattr(loops, kind))] for loops in candidates]
        )
    group = plant.group(joint)
    part = plant.part(group)
    mixes = list(itertools.product(*([kind] if k == joint else KINDS for k in group)))

    def radii(candidates: Sequence[LoopGains]) -> Array:
        rows = [
            [
                (each, getattr(loops if k == joint else gains[k], each))
                for k, each in zip(group, mix)
            ]
            for loops in candidates
            for mix in mixes
        ]
        of_all = _spectral_radii(part, rows).reshape(len(candidates), len(mixes))
        return np.asarray(of_all.max(axis=1))

    return radii


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

    radii = _worst_radii(plant, gains, joint, kind)

    def stable(*values: float) -> list[bool]:
        loop = getattr(gains[joint], kind)
        loops = [msgspec.structs.replace(loop, **{key: value}) for value in values]
        candidates = [msgspec.structs.replace(gains[joint], **{kind: each}) for each in loops]
        return [bool(radius <= 1.0 + TOLERANCE) for radius in radii(candidates)]

    present = min(getattr(getattr(gains[joint], kind), key), top)
    # By powers of ten, since nobody knows the size of a gain beforehand.
    grid = sorted(
        {0.0, present, *(top * 10.0 ** (_DECADES * (k / (_GRID - 1) - 1.0)) for k in range(_GRID))}
    )
    good = stable(*grid)
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


def _edge(stable: Callable[[float], list[bool]], inside: float, outside: float) -> float:
    """Return the stable value next to the border between a stable and an unstable one."""
    while abs(outside - inside) > _PRECISION * max(inside, outside):
        middle = 0.5 * (inside + outside)
        if stable(middle)[0]:
            inside = middle
        else:
            outside = middle
    return inside
