"""Make a motion of a program's line: where its targets are, and the way there."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scara_config import Joint, Robot
from scara_config.programs.configuration import Configuration, read_configuration
from scara_config.programs.steps import MoveStep, PathStep, Target
from scara_config.programs.tp.values import POSE_NUMBERS, ExecutionError, Pose, Value

from fanuc_emulator import alarms
from fanuc_emulator.alarms import RefusedError, check_ranges
from fanuc_emulator.drives.arm import Arm, Matrix, inverse
from fanuc_emulator.drives.bend import Bend
from fanuc_emulator.drives.interpolator import JointMove, Trapezoid
from fanuc_emulator.drives.path import PathMove, Speed, ToolPath

_MM = 1e-3
T1_SPEED = 0.235
"""In T1 tool and flange are told to be no faster [m/s].

Source:
    0.25 by B-83284EN/09, section 5.2.2, less the 5 % by which a servo overshoots [chk].
"""
_PLACES = 33
"""So many places of a way tell how fast it is: one of 90 degrees to 1e-4."""
ELSEWHERE = 1e-4
"""A path ends so near the joint positions that were taught [rad, m], or it ends in others."""


class Limits(NamedTuple):
    """How fast an axis goes [rad/s or m/s], and by which acceleration a program changes that."""

    velocity: float
    program_acceleration: float


class Planner:
    """Plans the motions of programs.

    Args:
        robot: robot.yaml.
        limits: Of its axes.

    Attributes:
        robot: As given.
        tool: Tells the tool frame that is selected: T1 keeps its tip to a speed too.
    """

    def __init__(self, robot: Robot, limits: Sequence[Limits]) -> None:
        self.robot, self._limits = robot, limits
        self.tool: Callable[[], Pose] = lambda: Pose((0.0,) * POSE_NUMBERS, "")
        self._arm = Arm(robot)
        self._bend = Bend(robot, self._arm)
        self._others = [k for k in range(len(robot.joints)) if k not in self._arm.columns]

    def plan(self, step: MoveStep | PathStep, begin: Sequence[float]) -> Trapezoid:
        """Return the motion from where the last one ends.

        Args:
            step: What is asked for.
            begin: Joint positions there [rad or m].

        Raises:
            RefusedError: The tool cannot go there, or not on this way.
        """
        velocities = [each.velocity for each in self._limits]
        if isinstance(step, MoveStep):
            accelerations = self._accelerations(step.acc_percent)
            share = 0.01 * step.speed_percent
            return JointMove(begin, step.target, share, velocities, accelerations, step.seconds)
        motion, target = step.motion, step.targets[-1]
        accelerations = self._accelerations(motion.acc)
        if motion.kind == "J":
            end = self.joints_at(target, begin)
            # A motion that is told its time names no speed: the greatest one bounds it.
            share = 0.01 * (motion.percent or 100.0)
            return JointMove(begin, end, share, velocities, accelerations, motion.seconds)
        tool = matrix(target.tool)
        via, last = (self._tip(step.targets[0]) if motion.kind == "C" else None), target
        path = ToolPath(self._arm.pose(self._of_arm(begin)) @ tool, self._tip(last), via)
        move = PathMove(
            self._arm,
            self.robot.joints,
            begin,
            self._others_at(last, begin),
            path,
            inverse(tool),
            Speed(motion.mm_s, motion.deg_s, motion.seconds),
            velocities,
            accelerations,
        )
        self._check_bend(last, move.end)
        return move

    def slow_down(self, move: Trapezoid, step: MoveStep | PathStep) -> None:
        """Slow a move down evenly, so that tool and flange keep to T1 at an override of 1."""
        parts = np.linspace(0.0, 1.0, _PLACES)
        poses = [self._arm.pose(self._of_arm(tuple(row))) for row in move.places(parts)]
        tool = matrix(step.targets[-1].tool if isinstance(step, PathStep) else self.tool())
        ways = [[(pose @ tip)[:3, 3] for pose in poses] for tip in (np.eye(4), tool)]
        slopes = np.linalg.norm(np.diff(np.array(ways), axis=1), axis=2) * (_PLACES - 1)
        fastest = float(slopes.max()) * move.law[0]
        if fastest > T1_SPEED:
            move.slow_down(T1_SPEED / fastest)

    def toward(
        self, begin: Sequence[float], end: Sequence[float], override: float, dt: float
    ) -> tuple[float, ...]:
        """Return how far a stream comes in T1: straight in the joints, the tool at its speed.

        Args:
            begin: Where it is [rad or m].
            end: Where it would be next.
            override: Fraction 0..1 of that speed.
            dt: The time to the next [s].
        """
        way = [b - a for a, b in zip(begin, end)]
        # No axis is faster than it can be: what is left is so short that the way is straight.
        limits = (each.velocity * dt / abs(d) for each, d in zip(self._limits, way) if d)
        part = min([1.0, *limits])
        there = [a + part * d for a, d in zip(begin, way)]
        moved = self._arm.pose(self._of_arm(there)) - self._arm.pose(self._of_arm(begin))
        tips = moved[:3, 3], (moved @ matrix(self.tool()))[:3, 3]
        gone = float(max(map(np.linalg.norm, tips)))
        part *= min(1.0, T1_SPEED * override * dt / gone) if gone > 0.0 else 1.0
        return tuple([a + part * d for a, d in zip(begin, way)])

    def _accelerations(self, percent: float) -> list[float]:
        return [0.01 * percent * each.program_acceleration for each in self._limits]

    def _check_bend(self, target: Target, end: Sequence[float]) -> None:
        """Refuse a path that ends with the arm bent otherwise than its target says.

        How often a joint has gone round there is no matter: the path itself leads to that.

        Raises:
            RefusedError: It does.
        """
        told, taught = _told(target), self._taught(target)
        arm = self._of_arm(end)
        same = True
        if told is not None:
            same = self._bend.is_bent(arm, told.letters)
        elif taught is not None and not target.shifted:
            apart = (a - b for a, b in zip(self._of_arm(taught), arm))
            same = all(abs(math.remainder(each, math.tau)) <= ELSEWHERE for each in apart)
        if not same:
            why = "the path ends with the arm bent otherwise than its target says"
            raise RefusedError(alarms.CONFIG_CHANGE, why)

    def joints_at(self, target: Target, begin: Sequence[float]) -> tuple[float, ...]:
        """Return joint positions of a target, near where the motion begins [rad or m].

        Raises:
            RefusedError: There are none, or one is out of its range.
        """
        found = self._taught(target)
        if found is None or target.shifted:
            goal = self._tip(target) @ inverse(matrix(target.tool))
            here = self._of_arm(begin if found is None else found)
            place = list(self._others_at(target, begin))
            for column, position in zip(self._arm.columns, self._solve(goal, _told(target), here)):
                place[column] = position
            found = tuple(place)
        check_ranges(self.robot.joints, found)
        return found

    def _solve(
        self, goal: Matrix, told: Configuration | None, here: tuple[float, ...]
    ) -> tuple[float, ...]:
        """Return the arm's joint positions that bring the flange somewhere, bent as it is told.

        Args:
            goal: Pose of the flange in the base, shape (4, 4) [m].
            told: The configuration; None: the arm stays bent as it is.
            here: Where the motion begins [rad or m].

        Raises:
            RefusedError: There are none.
        """
        letters = (told or self._bend.at(here)).letters
        for guess in self._bend.guesses(goal, here):
            solved = self._arm.solve(goal, guess)
            for each in () if solved is None else self._bend.alike(solved):
                turned = self._bend.turned(each, told, here)
                if turned is not None and self._bend.is_bent(each, letters):
                    return turned
        shown = f" with the arm bent {told.text}" if told else ""
        raise RefusedError(alarms.NOT_REACHABLE, f"no joint positions bring the tool there{shown}")

    def _tip(self, target: Target) -> Matrix:
        """Return the pose of the tool's tip at a target, in the base, shape (4, 4) [m]."""
        frame, place = matrix(target.frame), target.place
        taught = self._taught(target)
        if taught is not None:
            tip = self._arm.pose(self._of_arm(taught)) @ matrix(target.tool)
        else:
            assert isinstance(place, Pose)
            tip = frame @ matrix(place)
        if target.offset is not None:
            # Number by number, W, P and R too: no turn about the frame's origin.
            parts = zip(numbers_of(inverse(frame) @ tip), target.offset.values)
            tip = frame @ matrix(Pose(tuple(a + b for a, b in parts)))
        if target.tool_offset is not None:
            tip = tip @ matrix(target.tool_offset)
        return tip

    def _taught(self, target: Target) -> tuple[float, ...] | None:
        """Return a target in joints [rad or m]; None: it is Cartesian."""
        if not isinstance(target.place, Pose):
            return target.place
        if target.place.config is not None:
            return None
        return joints_of(self.robot.joints, target.place)

    def _of_arm(self, q: Sequence[float]) -> tuple[float, ...]:
        return tuple(q[column] for column in self._arm.columns)

    def _others_at(self, target: Target, begin: Sequence[float]) -> tuple[float, ...]:
        """Return where the joints go that do not move the tool, with their part of an Offset.

        The others stay.
        """
        taught = self._taught(target)
        place = list(begin)
        for number, column in enumerate(self._others):
            at, scale = 6 + number, self.robot.joints[column].scale
            if taught is not None:
                place[column] = taught[column]
            elif at < POSE_NUMBERS:
                assert isinstance(target.place, Pose)
                place[column] = target.place.values[at] * scale
            if target.offset is not None and at < POSE_NUMBERS:
                place[column] += target.offset.values[at] * scale
        return tuple(place)

    def is_singular(self, q: Sequence[float]) -> bool:
        """Tell whether the tool cannot go every way there; joint positions as in robot.yaml."""
        return self._arm.singular(self._arm.jacobian(self._of_arm(q)))

    def tip_pose(self, q: Sequence[float], frame: Pose, tool: Pose) -> Pose:
        """Return LPOS: where the tool's tip is in a user frame, with the external axes."""
        tip = inverse(matrix(frame)) @ self._arm.pose(self._of_arm(q)) @ matrix(tool)
        places = numbers_of(tip)
        places += [q[k] / self.robot.joints[k].scale for k in self._others]
        values = tuple((*map(float, places), *[0.0] * POSE_NUMBERS))[:POSE_NUMBERS]
        return Pose(values, self._bend.at(self._of_arm(q)).text)


def numbers_of(pose: Matrix) -> list[float]:
    """Return X Y Z W P R of a transform [mm, deg]."""
    turn = pose[:3, :3]
    p = math.atan2(-turn[2, 0], math.hypot(turn[0, 0], turn[1, 0]))
    w, r = math.atan2(turn[2, 1], turn[2, 2]), math.atan2(turn[1, 0], turn[0, 0])
    return [float(value) / _MM for value in pose[:3, 3]] + list(map(math.degrees, (w, p, r)))


def _told(target: Target) -> Configuration | None:
    """Return how the arm is to be bent at a Cartesian target; None: nothing is told."""
    place = target.place
    return read_configuration(place.config or "") if isinstance(place, Pose) else None


def matrix(pose: Pose) -> Matrix:
    """Return X Y Z W P R as a transform, shape (4, 4) [m]: turned by W, then P, then R."""
    x, y, z, *degrees = pose.values[:6]
    w, p, r = map(math.radians, degrees)
    cw, sw, cp, sp, cr, sr = (f(a) for a in (w, p, r) for f in (math.cos, math.sin))
    return np.array(
        [
            [cr * cp, cr * sp * sw - sr * cw, cr * sp * cw + sr * sw, x * _MM],
            [sr * cp, sr * sp * sw + cr * cw, sr * sp * cw - cr * sw, y * _MM],
            [-sp, cp * sw, cp * cw, z * _MM],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def joint_pose(joints: Sequence[Joint], positions: Sequence[float]) -> Pose:
    """Return joint positions [rad or m] as a register holds them: J1, J2 .. by axis number."""
    values = [0.0] * POSE_NUMBERS
    for joint, position in zip(joints, positions):
        values[joint.axis_number - 1] = position / joint.scale
    return Pose(tuple(values))


def joints_of(joints: Sequence[Joint], pose: Value) -> tuple[float, ...]:
    """Return what a register holds as joint positions [rad or m].

    Raises:
        ExecutionError: It is no position in joints.
    """
    if not isinstance(pose, Pose) or pose.config is not None:
        raise ExecutionError("is no position in joints")
    return tuple(pose.values[joint.axis_number - 1] * joint.scale for joint in joints)
