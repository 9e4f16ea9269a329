"""A trajectory that shall be followed: what is wrong with it, or a path over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from itertools import pairwise

from scara_config import Joint

from scara_control.config import TrajectoryConfig, in_si
from scara_control.dynamics.effort import Load
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion, Vector
from scara_control.joint_track import JointTrack
from scara_control.motion.plan import Path

_MARGIN = 1e-6
"""Part of a limit that floating point may put a value beyond it (our choice)."""


class Code(IntEnum):
    """The error codes of control_msgs/FollowJointTrajectoryResult."""

    SUCCESSFUL = 0
    INVALID_GOAL = -1
    INVALID_JOINTS = -2
    OLD_HEADER_TIMESTAMP = -3
    PATH_TOLERANCE_VIOLATED = -4
    GOAL_TOLERANCE_VIOLATED = -5


class GoalError(ScaraControlError):
    """A trajectory cannot be followed; the text says why, ``code`` in the words of the message."""

    def __init__(self, code: Code, text: str) -> None:
        super().__init__(text)
        self.code = code


@dataclass(frozen=True, slots=True)
class Goal:
    """What was asked for, not checked yet.

    Attributes:
        names: Joints, in the order of all vectors.
        points: The way; ``time`` counts from the start [s], velocities and accelerations may be
            empty.
        start: When it begins, on the axis of ``now`` [s]; None: at once.
        path_tolerance: Joint to largest deviation on the way; 0 or absent: the default; negative:
            unlimited.
        goal_tolerance: Joint to largest deviation at the end, likewise.
        goal_time_tolerance: How much longer than planned the end may take [s]; 0: the default.
    """

    names: tuple[str, ...]
    points: tuple[JointMotion, ...]
    start: float | None = None
    path_tolerance: tuple[tuple[str, float], ...] = ()
    goal_tolerance: tuple[tuple[str, float], ...] = ()
    goal_time_tolerance: float = 0.0


def plan_path(joints: Sequence[Joint], start: Vector, points: Sequence[JointMotion]) -> Path:
    """Return the path through the points, at rest at its end.

    Missing velocities are chosen so that no joint runs past its neighbouring points, missing
    accelerations so that the velocity is smooth.

    Args:
        joints: In the order of all vectors.
        start: Where the joints are; the path begins there, at rest, if the first point is due later
            than its start.
        points: At least one.

    Raises:
        GoalError: Counts, values or times are wrong, or the end is no rest.
    """
    zeros = (0.0,) * len(joints)
    if points[0].time > 0.0:
        points = [JointMotion(start, zeros, zeros), *points]
    _check_points(joints, points)
    times, rows = [point.time for point in points], [point.q for point in points]
    if any(after <= before for before, after in pairwise(times)) or times[0] < 0.0:
        raise GoalError(Code.INVALID_GOAL, f"time_from_start does not increase: {times[:20]}")
    slopes = _slopes(times, rows)
    velocities = [list(point.qdot) or slopes[k] for k, point in enumerate(points)]
    bends = _bends(times, velocities)
    accelerations = [list(point.qddot) or bends[k] for k, point in enumerate(points)]
    if any(velocities[-1]):
        raise GoalError(
            Code.INVALID_GOAL, f"the last point moves: velocities {velocities[-1]}, expected zeros"
        )
    if any(velocities[0]):
        raise GoalError(
            Code.INVALID_GOAL,
            f"the first point moves: velocities {velocities[0]}, expected zeros, or a later time",
        )
    stop = [joint.acceleration for joint in joints]
    track = JointTrack(
        times, rows, velocities, accelerations, extrapolation_limit=0.0, stop_accelerations=stop
    )
    return Path([track], rows[-1], 1.0)


def _check_points(joints: Sequence[Joint], points: Sequence[JointMotion]) -> None:
    """Refuse wrong counts and what is no number."""
    for k, point in enumerate(points):
        for what, values in (
            ("positions", point.q),
            ("velocities", point.qdot),
            ("accelerations", point.qddot),
        ):
            if len(values) != len(joints) and (values or what == "positions"):
                raise GoalError(
                    Code.INVALID_GOAL, f"point {k}: {len(values)} {what} for {len(joints)} joints"
                )
        if not all(map(math.isfinite, (point.time, *point.q, *point.qdot, *point.qddot))):
            raise GoalError(Code.INVALID_GOAL, f"point {k} is not finite: {point}")


def _slopes(times: Sequence[float], rows: Sequence[Vector]) -> list[list[float]]:
    """Choose velocities at the points.

    They are zero at the ends and where a joint turns, else the weighted harmonic mean.

    Source:
        Fritsch & Butland, A Method for Constructing Local Monotone Piecewise Cubic Interpolants,
        1984.
    """
    count = len(rows[0])
    found = [[0.0] * count for _ in rows]
    for k in range(1, len(rows) - 1):
        h0, h1 = times[k] - times[k - 1], times[k + 1] - times[k]
        for j in range(count):
            before, after = (rows[k][j] - rows[k - 1][j]) / h0, (rows[k + 1][j] - rows[k][j]) / h1
            if before * after > 0.0:
                w0, w1 = 2.0 * h1 + h0, h1 + 2.0 * h0
                found[k][j] = (w0 + w1) / (w0 / before + w1 / after)
    return found


def _bends(times: Sequence[float], velocities: Sequence[Sequence[float]]) -> list[list[float]]:
    """Choose accelerations at the points: central differences, zero at the ends."""
    count = len(velocities[0])
    found = [[0.0] * count for _ in velocities]
    for k in range(1, len(velocities) - 1):
        span = times[k + 1] - times[k - 1]
        found[k] = [(b - a) / span for a, b in zip(velocities[k - 1], velocities[k + 1])]
    return found


def named_joints(joints: Sequence[Joint], names: Sequence[str]) -> list[Joint]:
    """Return the joints called ``names``.

    Raises:
        GoalError: None is named, one is unknown or named twice.
    """
    known = {joint.name: joint for joint in joints}
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        what = f"unknown joint {', '.join(unknown)}" if unknown else "no joint is named"
        raise GoalError(Code.INVALID_JOINTS, f"{what}: the twin has {', '.join(known)}")
    if len(set(names)) != len(names):
        raise GoalError(Code.INVALID_JOINTS, f"a joint is named twice: {', '.join(names)}")
    return [known[name] for name in names]


def check_way(joints: Sequence[Joint], path: Path, step: float, there: Vector) -> float:
    """Refuse a path that leaves the joints' limits anywhere.

    Return its peak speed in percent of the joints' largest.

    Args:
        joints: Limits.
        path: The path.
        step: Its motion is looked at this often [s].
        there: Where the joints are: one a little beyond its limit, as a robot at its limit may
            read, may come back from there.

    Raises:
        GoalError: A position, velocity or acceleration is outside its limits; joint, value, range
            and time are named.
    """
    peak = 0.0
    for k in range(math.ceil(path.duration / step) + 1):
        tau = min(k * step, path.duration)
        motion = path.at(tau)
        for joint, q, v, a, now in zip(joints, motion.q, motion.qdot, motion.qddot, there):
            _check_range(joint, "", q, min(joint.lower, now), max(joint.upper, now), tau)
            _check_range(joint, "/s", v, -joint.velocity, joint.velocity, tau)
            _check_range(joint, "/s^2", a, -joint.acceleration, joint.acceleration, tau)
            peak = max(peak, 100.0 * abs(v) / joint.velocity)
    return peak


def check_efforts(
    joints: Sequence[Joint],
    load: Load,
    path: Path,
    columns: Sequence[int],
    rest: Vector,
    step: float,
) -> None:
    """Refuse a path that asks a joint for more than its effort, with what hangs at the tool.

    Args:
        joints: All joints of the twin.
        load: The arm with its payload.
        path: Of the joints ``columns``.
        columns: Their places among all joints.
        rest: Where all joints are; the others stay there [rad] or [m].
        step: Its motion is looked at this often [s].

    Raises:
        GoalError: Joint, effort, limit and time are named.
    """
    zeros = [0.0] * len(joints)
    for k in range(math.ceil(path.duration / step) + 1):
        tau = min(k * step, path.duration)
        motion, q, qdot, qddot = path.at(tau), list(rest), list(zeros), list(zeros)
        for place, column in enumerate(columns):
            q[column], qdot[column] = motion.q[place], motion.qdot[place]
            qddot[column] = motion.qddot[place]
        shares = load.shares(JointMotion(tuple(q), tuple(qdot), tuple(qddot)))
        for joint, share, most in zip(joints, shares, load.permitted):
            if share > 1.0 + _MARGIN:
                unit = "N m" if joint.si_unit == "rad" else "N"
                raise GoalError(
                    Code.INVALID_GOAL,
                    (
                        f"{joint.name} is asked for {share * most:.4g} {unit} {tau:.2f} s after "
                        f"the start, allowed with this payload are {most:.4g}: give it more time"
                    ),
                )


def _check_range(joint: Joint, per: str, value: float, low: float, high: float, tau: float) -> None:
    """Refuse a value outside its range."""
    margin = _MARGIN * (high - low)
    if not low - margin <= value <= high + margin:
        raise GoalError(
            Code.INVALID_GOAL,
            (
                f"{joint.name} = {value:.6g} {joint.si_unit}{per} is outside [{low:.4g}, "
                f"{high:.4g}] {tau:.2f} s after the start"
            ),
        )


def tolerances(
    joints: Sequence[Joint], given: Sequence[tuple[str, float]], deg: float, mm: float, what: str
) -> tuple[float, ...]:
    """Return the allowed deviation of each joint [rad or m]; infinite if unlimited.

    Args:
        joints: Of the trajectory.
        given: Joint to tolerance, SI; 0: the default, negative: unlimited.
        deg: Default of joints that turn.
        mm: Default of joints that slide.
        what: Named in the error.

    Raises:
        GoalError: A tolerance names a joint that is not in the trajectory, or is not finite.
    """
    asked = dict(given)
    names = [joint.name for joint in joints]
    strange = [name for name, value in given if name not in names or not math.isfinite(value)]
    if strange:
        raise GoalError(
            Code.INVALID_GOAL,
            f"{what} of {', '.join(strange)}: no joint of the trajectory, or not finite",
        )
    values = [asked.get(joint.name, 0.0) or in_si(joint, deg, mm) for joint in joints]
    return tuple(value if value > 0.0 else math.inf for value in values)


def check_goal_size(goal: Goal, config: TrajectoryConfig) -> None:
    """Refuse a goal without points or of unreasonable size.

    Raises:
        GoalError: It has none, or lasts too long.
    """
    if not goal.points:
        raise GoalError(Code.INVALID_GOAL, "the trajectory has no points")
    last = goal.points[-1].time
    if not last <= config.longest:
        raise GoalError(
            Code.INVALID_GOAL, f"the trajectory lasts {last:g} s, allowed {config.longest:g}"
        )
