"""How the arm is bent at joint positions, and joint positions at which it is bent otherwise.

On which side a joint stands is told by places and axes alone, not by the sign of its own count.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scara_config import Robot
from scara_config.elbow import elbow_of
from scara_config.programs.configuration import (
    FIELDS,
    Configuration,
    letter_groups,
    turn_joints,
    turn_of,
)

from fanuc_emulator.drives.arm import Arm, Matrix, turned_by

BARELY = 1e-4
"""An arm that is bent less than this counts for both sides [rad, or m by 1 m]."""
_UP = np.array([0.0, 0.0, 1.0])


class Bend:
    """Tell how an arm is bent.

    Args:
        robot: robot.yaml.
        arm: Its kinematics; joint positions here are those of its columns.
    """

    def __init__(self, robot: Robot, arm: Arm) -> None:
        self._arm = arm
        self.groups = letter_groups(robot)
        joints = [robot.joints[k] for k in arm.columns]
        self._limits = [(joint.lower, joint.upper) for joint in joints]
        self._turning = [k for k, joint in enumerate(joints) if joint.si_unit == "rad"]
        self._counted = [joints.index(joint) for joint in turn_joints(robot)]
        elbow = elbow_of(robot)
        self._elbow = elbow and (joints.index(elbow.joint), elbow)
        # How six joints stand at 0: there they reach forward, and the elbow is above that.
        self._zero = _shape(arm, [0.0] * len(joints)) if len(self.groups) > 1 else None

    def at(self, q: Sequence[float]) -> Configuration:
        """Return how the arm is bent."""
        sides = self._sides(q)
        letters = "".join(group[0 if side >= 0.0 else 1] for group, side in zip(self.groups, sides))
        turns = [turn_of(q[k]) for k in self._counted]
        return Configuration(letters, tuple((*turns, *[0] * FIELDS))[:FIELDS])

    def is_bent(self, q: Sequence[float], letters: str) -> bool:
        """Tell whether the arm is bent as letters say."""
        sides = zip(self.groups, letters, self._sides(q))
        return all(
            side * (1.0 - 2.0 * group.index(letter)) >= -BARELY for group, letter, side in sides
        )

    def guesses(self, goal: Matrix, here: Sequence[float]) -> Iterator[tuple[float, ...]]:
        """Yield where to look for joint positions: here, then with the arm bent otherwise.

        Args:
            goal: Where the flange is to be, shape (4, 4) [m].
            here: Joint positions [rad or m].
        """
        yield tuple(here)
        if self._elbow is not None:
            k, elbow = self._elbow
            # Newton's method finds what is near: these begin all round the first axis, with either
            # elbow.
            for turn, side in itertools.product((0.0, 1.0, -1.0, 2.0, -2.0, 3.0), (1.0, -1.0)):
                guess = list(here)
                guess[self._turning[0]] += turn
                guess[k] = elbow.sign * (side * math.pi / 2.0 - elbow.zero)
                yield tuple(guess)
        elif self._zero is not None:
            for three in _arms(self._arm, self._zero, goal):
                yield (*three, *_wrist(self._arm, self._zero, goal, three))

    def alike(self, q: Sequence[float]) -> Iterator[tuple[float, ...]]:
        """Yield joint positions, then those with the wrist turned over and the tool as it is."""
        yield tuple(q)
        if len(self.groups) > 1:
            over = q[4] - 2.0 * _shape(self._arm, q).bent
            turned = (*q[:3], q[3] + math.pi, over, q[5] + math.pi)
            # Where the wrist's axes do not meet in a point the other joints move with it.
            found = self._arm.solve(self._arm.pose(q), turned)
            if found is not None:
                yield found

    def turned(
        self, q: Sequence[float], told: Configuration | None, here: Sequence[float]
    ) -> tuple[float, ...] | None:
        """Return joint positions of the same place with the turns that are told.

        A joint whose turn is not told stays as near to where it is as its range allows.

        Args:
            q: Joint positions; whole turns of theirs do not count.
            told: The configuration; None: nothing is told.
            here: Where the motion begins.

        Returns:
            None: a joint cannot turn so far, or not there.
        """
        found = list(q)
        turns = dict(zip(self._counted, told.turns)) if told is not None else {}
        for k in self._turning:
            rest = math.remainder(q[k], math.tau)
            low, high = self._limits[k]
            # A SCARA's J4 goes round twice either way.
            ways = [rest + n * math.tau for n in range(-3, 4)]
            ways = [way for way in ways if low - 1e-6 <= way <= high + 1e-6]
            if k in turns:
                ways = [way for way in ways if turn_of(way) == turns[k]]
            if not ways and k in turns:
                return None
            # Without a way the joint keeps its count, and who checks the ranges says which joint it
            # is.
            if ways:
                found[k] = min(ways, key=lambda way: abs(way - here[k]))
        return tuple(found)

    def _sides(self, q: Sequence[float]) -> list[float]:
        """Return how far the arm is on the side of each group's first letter."""
        if self._elbow is not None:
            k, elbow = self._elbow
            return [elbow.bend(q[k])]
        if not self.groups:
            return []
        assert self._zero is not None
        shape = _shape(self._arm, q)
        sides = (shape.bent, shape.raised, shape.ahead)
        return [sign * side for sign, side in zip(_signs(self._zero), sides)]


class _Shape(NamedTuple):
    """How six joints stand.

    Attributes:
        bent: Angle from the forearm to the tool, about the fifth axis [rad].
        raised: Area that the elbow spans with shoulder and wrist, about the second axis [m^2].
        ahead: How far the wrist is from the first axis, along ``across`` [m].
        across: Level, square to the second axis.
        points: Of shoulder, elbow and wrist, shape (3, 3) [m].
        forearm: From the elbow to the wrist.
        tool: Where the last axis leads, away from the wrist.
        second: Axis.
        fifth: Axis.
    """

    bent: float
    raised: float
    ahead: float
    across: Matrix
    points: Matrix
    forearm: Matrix
    tool: Matrix
    second: Matrix
    fifth: Matrix


def _shape(arm: Arm, q: Sequence[float]) -> _Shape:
    """Look at an arm of six turning joints whose last three axes meet in the wrist."""
    axes = arm.jacobian(q).T
    ways = axes[:, :3]
    points = np.cross(ways, axes[:, 3:])
    # The point nearest to the wrist's three axes.
    flat = [np.eye(3) - np.outer(way, way) for way in ways[3:]]
    aims = sum(each @ point for each, point in zip(flat, points[3:]))
    wrist = np.linalg.solve(sum(flat), aims)
    shoulder, elbow = (points[k] + ways[k] * (ways[k] @ (wrist - points[k])) for k in (1, 2))
    forearm = ways[3] * math.copysign(1.0, float(ways[3] @ (wrist - elbow)))
    tool = ways[5] * math.copysign(1.0, float(ways[5] @ arm.pose(q)[:3, 2]))
    across = np.cross(ways[1], ways[0])
    return _Shape(
        math.atan2(float(np.cross(forearm, tool) @ ways[4]), float(forearm @ tool)),
        float(np.cross(wrist - shoulder, elbow - shoulder) @ ways[1]),
        float((wrist - points[0]) @ across),
        across,
        np.array([shoulder, elbow, wrist]),
        forearm,
        tool,
        ways[1],
        ways[4],
    )


def _signs(zero: _Shape) -> list[float]:
    """Return the signs by which the arm at 0 reaches forward, elbow up and wrist down."""
    forward = math.copysign(1.0, zero.ahead) * zero.across
    down = -float(np.cross(zero.fifth, zero.forearm) @ _UP)
    up = float(np.cross(forward, _UP) @ zero.second)
    return [math.copysign(1.0, each) for each in (down, up, zero.ahead)]


def _arms(arm: Arm, zero: _Shape, goal: Matrix) -> Iterator[tuple[float, float, float]]:
    """Yield the first three of six joints that bring the wrist where a pose of the flange has it.

    Shoulder, elbow and wrist are a triangle in a plane through the first axis; where two of them
    are one point there is nothing to yield.
    """
    six = arm.jacobian([0.0] * 6).T
    shoulder, elbow, wrist = zero.points
    held = np.linalg.inv(arm.pose([0.0] * 6)) @ (*wrist, 1.0)
    place = (goal @ held)[:3]
    first, base = six[0, :3], np.cross(six[0, :3], six[0, 3:])
    upper, fore = elbow - shoulder, wrist - elbow
    product = float(np.linalg.norm(upper) * np.linalg.norm(fore))
    if product == 0.0:
        return
    for back in (0.0, math.pi):
        q1 = _angle(wrist - base, place - base, first) + back
        reached = base + turned_by(-q1 * first) @ (place - base) - shoulder
        reached -= zero.second * (zero.second @ reached)
        square = float(reached @ reached - upper @ upper - fore @ fore)
        cosine = 0.5 * square / product
        if abs(cosine) > 1.0:
            continue
        for side in (1.0, -1.0):
            about = _angle(upper, fore, zero.second)
            bend = side * math.acos(cosine) - about
            tip = upper + turned_by(bend * zero.second) @ fore
            q3 = math.copysign(1.0, float(six[2, :3] @ zero.second)) * bend
            yield q1, _angle(tip, reached, zero.second), q3


def _wrist(
    arm: Arm, zero: _Shape, goal: Matrix, three: Sequence[float]
) -> tuple[float, float, float]:
    """Return the last three of six joints that turn the flange as a pose has it.

    The fifth axis is square to the forearm and to the tool.
    """
    shape = _shape(arm, [*three, 0.0, 0.0, 0.0])
    tool = goal[:3, :3] @ arm.pose([0.0] * 6)[:3, :3].T @ zero.tool
    fifth = np.cross(shape.forearm, tool)
    # Forearm and tool are in one line, so any fifth axis will do.
    fifth = fifth if float(fifth @ fifth) > 1e-12 else shape.fifth
    fourth = arm.jacobian([*three, 0.0, 0.0, 0.0])[:3, 3]
    q4 = _angle(shape.fifth, fifth, fourth)
    q5 = _angle(shape.forearm, tool, fifth / np.linalg.norm(fifth)) - shape.bent
    here, last = [*three, q4, q5, 0.0], arm.jacobian([*three, q4, q5, 0.0])[:3, 5]
    # The column that is most square to the last axis tells its turn best; one along it tells
    # nothing.
    level = int(np.argmin(np.abs(last @ goal[:3, :3])))
    return q4, q5, _angle(arm.pose(here)[:3, level], goal[:3, level], last)


def _angle(begin: Matrix, end: Matrix, axis: Matrix) -> float:
    """Return by how much a vector is turned about an axis into the direction of another [rad]."""
    a, b = (each - axis * (axis @ each) for each in (begin, end))
    return math.atan2(float(np.cross(a, b) @ axis), float(a @ b))
