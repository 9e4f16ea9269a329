"""Plan a line or an arc of the tool: L and C.

The path is found in joint positions before the motion begins, at points that are near each other;
between them the joints go by cubics with the path's own slopes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scara_config import Joint

from fanuc_emulator import alarms
from fanuc_emulator.alarms import RefusedError, check_ranges
from fanuc_emulator.drives.arm import Arm, Matrix, cross, rotation_vector, turned_by
from fanuc_emulator.drives.interpolator import Trapezoid, rate_for

STRIDE = 0.012
"""From one point of a path to the next [m], or [rad] by the half: between them a joint is off by
less than a micrometre. Our choice."""
FEWEST, MOST = 8, 64
"""Parts of a path."""
APART = 8
"""Of so many parts one is solved by itself, the others at once from what these tell. Our choice."""
FOLLOWS = 0.01
"""A place is so near to where the one before leads [rad or m], or each is solved by itself."""


class Speed(NamedTuple):
    """How fast the tool goes; None: by the others."""

    mm_s: float | None = None
    deg_s: float | None = None
    seconds: float | None = None


class ToolPath:
    """A way of the tool from one pose to another: its place by a curve, evenly turned.

    Attributes:
        length: Of its place's way [m].
        angle: By which it turns [rad].
    """

    def __init__(self, begin: Matrix, end: Matrix, via: Matrix | None = None) -> None:
        self._begin, self._end = begin, end
        self._turn = rotation_vector(begin[:3, :3].T @ end[:3, :3])
        self.angle = float(np.linalg.norm(self._turn))
        self._place: Places
        if via is None:
            here, way = begin[:3, 3], end[:3, 3] - begin[:3, 3]
            self._place, self.length = lambda part: here + part * way, float(np.linalg.norm(way))
        else:
            self._place, self.length = _arc(begin[:3, 3], via[:3, 3], end[:3, 3])

    def at(self, part: float) -> Matrix:
        """Return the pose where so much of the way is over, 0..1; shape (4, 4) [m]."""
        found = np.eye(4)
        found[:3, :3] = self._begin[:3, :3] @ turned_by(part * self._turn)
        found[:3, 3] = self._place(part)
        return found

    def slope(self, part: float) -> Matrix:
        """Return the twist by the part of the way, in the base, shape (6,)."""
        turn = self._begin[:3, :3] @ self._turn
        step = 1e-6
        along = (self._place(part + step) - self._place(part - step)) / (2.0 * step)
        return np.concatenate([turn, along - cross(turn, self._place(part))])


Places = Callable[[float], Matrix]


def _arc(begin: Matrix, via: Matrix, end: Matrix) -> tuple[Places, float]:
    """Return the arc through three points.

    Raises:
        RefusedError: They stand in a line, or two are the same.
    """
    a, b = via - begin, end - begin
    normal = np.cross(a, b)
    square = float(normal @ normal)
    if square < 1e-16:
        raise RefusedError(alarms.NOT_REACHABLE, "the three points of the arc are in a line")
    middle = begin + np.cross((a @ a) * b - (b @ b) * a, normal) / (2.0 * square)
    first = begin - middle
    radius = float(np.linalg.norm(first))
    axis = normal / math.sqrt(square)
    across = np.cross(axis, first)
    last = end - middle
    # Counted the way round on which `via` lies: it may be more than half a circle.
    whole = math.atan2(float(last @ across), float(last @ first)) % (2.0 * math.pi)

    def place(part: float) -> Matrix:
        found: Matrix = middle + first * math.cos(part * whole) + across * math.sin(part * whole)
        return found

    return place, radius * whole


class PathMove(Trapezoid):
    """Follow a path of the tool; see :class:`~fanuc_emulator.drives.interpolator.JointMove`.

    Args:
        arm: The robot's kinematics.
        joints: Of robot.yaml.
        start: Joint positions at the start [rad or m], shape (n,).
        end: ... of the joints that do not move the tool at the end; those of the arm are a guess.
        path: Of the tool's tip.
        flange: The flange, by the tip.
        speed: Of the tool.
        velocities: Greatest joint speeds [rad/s or m/s].
        accelerations: Of planned moves.

    Raises:
        RefusedError: The path leads out of reach, out of a joint's range or through a singularity.
    """

    def __init__(
        self,
        arm: Arm,
        joints: Sequence[Joint],
        start: Sequence[float],
        end: Sequence[float],
        path: ToolPath,
        flange: Matrix,
        speed: Speed,
        velocities: Sequence[float],
        accelerations: Sequence[float],
    ) -> None:
        self._nodes, self._slopes = _solved(arm, joints, start, end, path, flange)
        steepest = np.abs(self._slopes).max(axis=0)
        moving = [i for i, slope in enumerate(steepest) if slope > 0.0]
        # One law for the whole path, so the steepest place of each joint sets it.
        change = min((accelerations[i] / float(steepest[i]) for i in moving), default=0.0)
        rate = min((velocities[i] / float(steepest[i]) for i in moving), default=0.0)
        if speed.mm_s is not None and path.length > 0.0:
            rate = min(rate, 1e-3 * speed.mm_s / path.length)
        if speed.deg_s is not None and path.angle > 0.0:
            rate = min(rate, math.radians(speed.deg_s) / path.angle)
        if speed.seconds is not None and moving:
            rate = min(rate, rate_for(speed.seconds, change))
        super().__init__(tuple(map(float, self._nodes[-1])), rate, change, bool(moving))

    def positions(self) -> tuple[float, ...]:
        """Return the joint positions on the path now."""
        if self.done:
            return self.end
        return tuple(map(float, self.places(np.array([self.progress]))[0]))

    def places(self, progress: Matrix) -> Matrix:
        """Return the joint positions at values of the parameter, shape (m, n) [rad or m]."""
        parts = len(self._nodes) - 1
        k = np.minimum((progress * parts).astype(int), parts - 1)
        return _cubic(self._nodes, self._slopes / parts, k, (progress * parts - k)[:, None])


def _solved(
    arm: Arm,
    joints: Sequence[Joint],
    start: Sequence[float],
    end: Sequence[float],
    path: ToolPath,
    flange: Matrix,
) -> tuple[Matrix, Matrix]:
    """Return the joint positions at the points of a path, and how they change by its part.

    Both have the shape (points, n).
    """
    parts = math.ceil(max(path.length, 0.5 * path.angle) / STRIDE)
    parts = min(max(parts, FEWEST), MOST)
    first, last = np.array(start, dtype=float), np.array(end, dtype=float)
    columns = list(arm.columns)
    together = _together(arm, joints, first, last, path, flange, parts)
    if together is not None:
        return together
    guess = first[columns]
    nodes, slopes = [], []
    for k in range(parts + 1):
        part = k / parts
        solved = arm.solve(path.at(part) @ flange, guess)
        if solved is None:
            raise RefusedError(alarms.NOT_REACHABLE, f"after {part:.0%} of the way")
        jacobian = arm.jacobian(solved)
        if arm.singular(jacobian):
            raise RefusedError(alarms.SINGULARITY, f"after {part:.0%} of the way")
        node, slope = first + part * (last - first), last - first
        node[columns] = solved
        slope[columns] = np.linalg.lstsq(jacobian, path.slope(part), rcond=1e-9)[0]
        check_ranges(joints, node, f" after {part:.0%} of the way")
        nodes.append(node)
        slopes.append(slope)
        guess = np.array(solved) + slope[columns] / parts
    return np.array(nodes), np.array(slopes)


def _together(
    arm: Arm,
    joints: Sequence[Joint],
    first: Matrix,
    last: Matrix,
    path: ToolPath,
    flange: Matrix,
    parts: int,
) -> tuple[Matrix, Matrix] | None:
    """Return what :func:`_solved` does where nothing is near a singularity or the end of a range.

    It finds the same in a fifth of the time. None: somewhere it may not; who looks at one place
    after the other says where, and why.
    """
    shares, columns = np.arange(parts + 1) / parts, list(arm.columns)
    poses = np.stack([path.at(share) for share in shares]) @ flange
    ways = np.stack([path.slope(share) for share in shares])
    guesses = _guesses(arm, first[columns], poses, ways, shares)
    found = None if guesses is None else arm.solve_all(poses, guesses)
    if found is None or not arm.clear(found[1]):
        return None
    nodes, slopes = first + shares[:, None] * (last - first), np.tile(last - first, (parts + 1, 1))
    nodes[:, columns] = found[0]
    slopes[:, columns] = (np.linalg.pinv(found[1], rcond=1e-9) @ ways[:, :, None])[:, :, 0]
    low, high = np.array([(joint.lower, joint.upper) for joint in joints]).T
    led = nodes[:-1] + slopes[:-1] / parts
    inside = bool(((nodes >= low) & (nodes <= high)).all())
    follows = float(np.abs(nodes[1:] - led)[:, columns].max()) < FOLLOWS
    return (nodes, slopes) if inside and follows else None


def _guesses(arm: Arm, guess: Matrix, poses: Matrix, ways: Matrix, shares: Matrix) -> Matrix | None:
    """Return joint positions near those of all places: cubics through some that were solved.

    None: one of these could not be.
    """
    chosen = [*range(0, len(shares) - 1, APART), len(shares) - 1]
    known, slopes = [], []
    for k, after in zip(chosen, [*chosen[1:], chosen[-1]]):
        solved = arm.solve(poses[k], guess)
        if solved is None:
            return None
        known.append(np.array(solved))
        slopes.append(np.linalg.lstsq(arm.jacobian(solved), ways[k], rcond=1e-9)[0])
        guess = known[-1] + (shares[after] - shares[k]) * slopes[-1]
    ends = shares[chosen]
    k = np.minimum(np.searchsorted(ends, shares, side="right") - 1, len(ends) - 2)
    width = (ends[k + 1] - ends[k])[:, None]
    return _cubic(np.array(known), np.array(slopes), k, (shares - ends[k])[:, None] / width, width)


def _cubic(
    nodes: Matrix, slopes: Matrix, k: Matrix, u: Matrix, width: Matrix | float = 1.0
) -> Matrix:
    """Return places between node k and the next, by their slopes.

    Args:
        nodes: Shape (points, n).
        slopes: By what ``width`` counts in.
        k: Of the node before each place, shape (m,).
        u: Share of the way to the next, shape (m, 1).
        width: From node to node.
    """
    a, b, v = nodes[k], nodes[k + 1], 1.0 - u
    found: Matrix = v * v * ((1.0 + 2.0 * u) * a + u * (width * slopes[k]))
    found += u * u * ((1.0 + 2.0 * v) * b - v * (width * slopes[k + 1]))
    return found
