"""Make a motion of a program's line: where its targets are, and the way there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np
from scara_config import Joint, Robot
from scara_config.elbow import elbow_of
from scara_config.programs.tp.motion import Asked
from scara_config.programs.tp.values import POSE_NUMBERS, ExecutionError, Pose, Value

from fanuc_emulator import alarms
from fanuc_emulator.alarms import RefusedError, check_ranges
from fanuc_emulator.drives.arm import Arm, Matrix, inverse
from fanuc_emulator.drives.axis import AxisParameters
from fanuc_emulator.drives.interpolator import JointMove, Trapezoid
from fanuc_emulator.drives.path import PathMove, Speed, ToolPath

_MM = 1e-3
ELSEWHERE = 1e-4
"""A line ends so near the joint positions that were taught [rad, m], or it ends in others."""


class Target(msgspec.Struct, frozen=True):
    """Where a motion goes to.

    Attributes:
        place: Joint positions in the order of robot.yaml [rad or m], or what a register holds.
        frame: User frame of a Cartesian position.
        tool: Tool frame, by the flange.
        offset: Is added in the user frame.
        tool_offset: Is added in the tool's frame.
    """

    place: tuple[float, ...] | Pose
    frame: Pose
    tool: Pose
    offset: Pose | None = None
    tool_offset: Pose | None = None

    @property
    def shifted(self) -> bool:
        """Something is added to it."""
        return self.offset is not None or self.tool_offset is not None


class PathStep(msgspec.Struct, frozen=True):
    """A motion that is no joint motion to a position that is taught in joints.

    Attributes:
        line: Its number.
        motion: What the line asks for.
        targets: Two for an arc.
    """

    line: int
    motion: Asked
    targets: tuple[Target, ...]

    @property
    def fine(self) -> bool:
        """The next line waits until the motors are there."""
        return self.motion.cnt is None

    @property
    def cnt(self) -> float:
        """How far the corner to the next motion is rounded, 0..100."""
        return self.motion.cnt or 0.0

    @property
    def speed_percent(self) -> float:
        """Programmed speed; 0: it is told otherwise."""
        return self.motion.percent or 0.0


class Planner:
    """Plans what is more than a joint motion to known joint positions.

    Args:
        robot: robot.yaml.
        limits: Of its axes.

    Attributes:
        robot: As given.
    """

    def __init__(self, robot: Robot, limits: Sequence[AxisParameters]) -> None:
        self.robot, self._limits = robot, limits
        self._arm = Arm(robot)
        elbow = elbow_of(robot)
        # Where it stands among the arm's joints; None: no side is named.
        self._elbow = elbow and (
            self._arm.columns.index(robot.joints.index(elbow.joint)),
            elbow,
        )
        self._others = [k for k in range(len(robot.joints)) if k not in self._arm.columns]

    def plan(self, step: PathStep, begin: Sequence[float]) -> Trapezoid:
        """Return the motion from where the last one ends.

        Args:
            step: What is asked for.
            begin: Joint positions there [rad or m].

        Raises:
            RefusedError: The tool cannot go there, or not on this way.
        """
        motion, target = step.motion, step.targets[-1]
        quick = 0.01 * motion.acc
        velocities = [each.velocity for each in self._limits]
        accelerations = [each.program_acceleration * quick for each in self._limits]
        if motion.kind == "J":
            end = self._joints(target, begin)
            share = 0.01 * (motion.percent or 100.0)
            return JointMove(begin, end, share, velocities, accelerations, motion.seconds)
        tool = matrix(target.tool)
        via, last = (self._tip(step.targets[0], begin) if motion.kind == "C" else None), target
        path = ToolPath(self._arm.pose(self._of_arm(begin)) @ tool, self._tip(last, begin), via)
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
        taught = self._taught(last)
        if taught is None or last.shifted:
            return move
        if max(abs(a - b) for a, b in zip(taught, move.end)) > ELSEWHERE:
            why = "the same place in another configuration of the arm is taught"
            raise RefusedError(alarms.NOT_REACHABLE, why)
        return move

    def _joints(self, target: Target, begin: Sequence[float]) -> tuple[float, ...]:
        """Return joint positions of a target, near where the motion begins.

        Raises:
            RefusedError: There are none, or one is out of its range.
        """
        found = self._taught(target)
        if found is None or target.shifted:
            goal = self._tip(target, begin) @ inverse(matrix(target.tool))
            here = self._of_arm(begin if found is None else found)
            solved = [
                each
                for guess in self._guesses(here)
                if (each := self._arm.solve(goal, guess)) is not None
                and self._configured(target, each)
            ]
            if not solved:
                raise RefusedError(alarms.NOT_REACHABLE, "no joint positions bring the tool there")
            nearest = min(solved, key=lambda q: max(abs(a - b) for a, b in zip(q, here)))
            place = list(self._others_at(target, begin))
            for column, position in zip(self._arm.columns, nearest):
                place[column] = position
            found = tuple(place)
        check_ranges(self.robot.joints, found)
        return found

    def _guesses(self, here: tuple[float, ...]) -> list[tuple[float, ...]]:
        """Return where to look for joint positions: here, and with the elbow on either side."""
        if self._elbow is None:
            return [here]
        k, elbow = self._elbow
        bend = max(abs(elbow.bend(here[k])), 1.0)
        bent = [elbow.sign * (side * bend - elbow.zero) for side in (1.0, -1.0)]
        return [here, *((*here[:k], q, *here[k + 1 :]) for q in bent)]

    def _configured(self, target: Target, q: Sequence[float]) -> bool:
        """Tell whether the elbow is on the side that the target's configuration names, R or L."""
        place = target.place
        letters = place.config if isinstance(place, Pose) and place.config else ""
        side = {"R": 1.0, "L": -1.0}.get(letters.strip()[:1])
        return side is None or side * self._bend(q) >= 0.0

    def _bend(self, q: Sequence[float]) -> float:
        """Return how far the forearm is turned to the left [rad]; ``q`` of the arm's joints."""
        if self._elbow is None:
            return 0.0
        k, elbow = self._elbow
        return elbow.bend(q[k])

    def _tip(self, target: Target, begin: Sequence[float]) -> Matrix:
        """Return the pose of the tool's tip at a target, in the base, shape (4, 4) [m]."""
        frame, place = matrix(target.frame), target.place
        taught = self._taught(target)
        if taught is not None:
            tip = self._arm.pose(self._of_arm(taught)) @ matrix(target.tool)
        else:
            assert isinstance(place, Pose)
            tip = frame @ matrix(place)
        if target.offset is not None:
            tip = frame @ matrix(target.offset) @ inverse(frame) @ tip
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
        """Return where the joints go that do not move the tool; the others stay."""
        taught = self._taught(target)
        place = list(begin)
        for number, column in enumerate(self._others):
            if taught is not None:
                place[column] = taught[column]
            else:
                assert isinstance(target.place, Pose)
                joint = self.robot.joints[column]
                place[column] = target.place.values[6 + number] * joint.scale
        return tuple(place)

    def tip_pose(self, q: Sequence[float], frame: Pose, tool: Pose) -> Pose:
        """Return LPOS: where the tool's tip is in a user frame, with the external axes."""
        tip = inverse(matrix(frame)) @ self._arm.pose(self._of_arm(q)) @ matrix(tool)
        turn = tip[:3, :3]
        p = math.atan2(-turn[2, 0], math.hypot(turn[0, 0], turn[1, 0]))
        w, r = math.atan2(turn[2, 1], turn[2, 2]), math.atan2(turn[1, 0], turn[0, 0])
        places = [value / _MM for value in tip[:3, 3]] + list(map(math.degrees, (w, p, r)))
        places += [q[k] / self.robot.joints[k].scale for k in self._others]
        letter = "R" if self._bend(self._of_arm(q)) >= 0.0 else "L"
        side = letter if self._elbow is not None else ""
        return Pose(tuple((*map(float, places), *[0.0] * POSE_NUMBERS))[:POSE_NUMBERS], side)


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
