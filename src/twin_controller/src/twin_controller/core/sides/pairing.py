"""Both sides at the same instant: they are sampled at different ones."""

from __future__ import annotations

from typing import TypeAlias

from scara_control.joint_motion import JointMotion

from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import Sides

SidesAtOnce: TypeAlias = tuple[JointMotion, JointMotion]
"""The real robot and the twin at one instant."""


def interpolate(history: tuple[JointMotion, ...], t: float) -> JointMotion | None:
    """Return the side at ``t`` by cubic interpolation inside the history, None outside."""
    for before, after in zip(reversed(history[:-1]), reversed(history[1:])):
        if before.time <= t <= after.time:
            return _hermite(before, after, t)
    return None


def paired(sides: Sides) -> SidesAtOnce | None:
    """Return the newest sample of the real robot that the twin's history covers, and the twin."""
    for real in reversed(sides.real.history[-4:]):
        twin = interpolate(sides.twin.history, real.time)
        if twin is not None:
            return real, twin
    return None


def deviation(setup: Setup, sides: Sides) -> float:
    """Return the largest joint deviation at one instant, border units; infinite while unknown."""
    if not sides.known:
        return float("inf")
    real, twin = paired(sides) or (sides.real.last, sides.twin.last)
    return max(abs(a - b) for a, b in zip(setup.to_border(real.q), setup.to_border(twin.q)))


def apart_text(setup: Setup, sides: Sides) -> str:
    """Say which joint of the twin is farthest from the real robot's, by how much, and what touches.

    Positions and deviation are in the joint's border unit.
    """
    if not sides.known:
        return ""
    real, twin = paired(sides) or (sides.real.last, sides.twin.last)
    rows = zip(setup.joints, setup.to_border(twin.q), setup.to_border(real.q))
    joint, here, there = max(rows, key=lambda row: abs(row[1] - row[2]))
    far = f"{abs(here - there):.2f} {joint.unit}"
    text = f"{joint.name} is {far} away, at {here:.2f} instead of {there:.2f} {joint.unit}"
    if sides.twin.touches:
        away = "lead the real robot away by its pendant, where a paused program is aborted first"
        return f"{text}; {sides.twin.touches}: {away}"
    motion = sides.twin.motion
    state = "" if motion is None else f", its motion is {motion.state} {motion.message}".rstrip()
    return f"{text}; the twin reports no contact{state}"


def _hermite(before: JointMotion, after: JointMotion, t: float) -> JointMotion:
    """Interpolate between two samples by position and velocity."""
    h = after.time - before.time
    u = (t - before.time) / h
    # Weights of the two positions and velocities, and the same for the derivative.
    a, b, c, d = (
        (1 + 2 * u) * (1 - u) ** 2,
        u * (1 - u) ** 2 * h,
        u * u * (3 - 2 * u),
        u * u * (u - 1) * h,
    )
    da, db, dc, dd = (
        6 * u * (u - 1) / h,
        (1 - u) * (1 - 3 * u),
        6 * u * (1 - u) / h,
        u * (3 * u - 2),
    )
    rows = list(zip(before.q, before.qdot, after.q, after.qdot))
    q = tuple(a * p + b * v + c * r + d * w for p, v, r, w in rows)
    qdot = tuple(da * p + db * v + dc * r + dd * w for p, v, r, w in rows)
    return JointMotion.measured(q, qdot, t)
