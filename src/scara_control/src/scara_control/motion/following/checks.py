"""What a message of streamed set points must fulfil."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

from scara_config import Joint

from scara_control.config import FollowConfig, in_si
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.commands import MotionRefusedError

SPAN_S = 2.0
"""From first to last point of a packet: more than the largest delay and announcement of half a
second each and the horizon of one, which motion.yaml allows (our choice)."""


def check_setpoints(
    joints: Sequence[Joint], setpoints: Setpoints, config: FollowConfig, now: float
) -> list[Joint]:
    """Refuse set points that are wrong in themselves; return their joints.

    Args:
        joints: The joints there are.
        setpoints: Not checked yet.
        config: Tolerances.
        now: On the axis of their times [s].

    Raises:
        MotionRefusedError: Names, counts, values, limits, speeds, times or jumps between its
            points.
    """
    known = {joint.name: joint for joint in joints}
    for name in setpoints.names:
        if name not in known:
            raise MotionRefusedError(f"unknown joint {name!r}: the twin has {', '.join(known)}")
    if len(set(setpoints.names)) != len(setpoints.names) or not setpoints.names:
        raise MotionRefusedError(
            f"joint names are missing or occur twice: {', '.join(setpoints.names)}"
        )
    named = [known[name] for name in setpoints.names]
    if not setpoints.points:
        raise MotionRefusedError("no points")
    for k, point in enumerate(setpoints.points):
        _check_point(named, point, config, k)
    _check_times(setpoints, config, now)
    for k, (before, after) in enumerate(pairwise(setpoints.points)):
        dt = after.time - before.time
        check_step(named, before.q, after.q, dt, config, f"between points {k} and {k + 1}")
    return named


def check_step(
    joints: Sequence[Joint],
    q: Sequence[float],
    then: Sequence[float],
    dt: float,
    config: FollowConfig,
    where: str,
) -> None:
    """Refuse a step that no joint makes in ``dt`` [s].

    Raises:
        MotionRefusedError: It is larger than the joint's speed (with a factor) allows, plus a
            tolerance.
    """
    for joint, before, after in zip(joints, q, then):
        allowed = config.velocity_factor * joint.velocity * dt
        allowed += in_si(joint, config.step_tolerance_deg, config.step_tolerance_mm)
        if abs(after - before) > allowed:
            raise MotionRefusedError(
                f"jump {where}: {joint.name} by {(after - before) / joint.scale:.2f} "
                f"{joint.unit} in {dt * 1e3:.0f} ms, "
                f"allowed {allowed / joint.scale:.2f}"
            )


def _check_point(joints: Sequence[Joint], point: JointMotion, config: FollowConfig, k: int) -> None:
    """Refuse wrong counts, what is no number, and what lies outside position or velocity limits."""
    for what, values in (
        ("positions", point.q),
        ("velocities", point.qdot),
        ("accelerations", point.qddot),
    ):
        if len(values) != len(joints):
            raise MotionRefusedError(f"point {k}: {len(values)} {what} for {len(joints)} joints")
        if not all(map(math.isfinite, values)):
            raise MotionRefusedError(f"point {k}: {what} are not all finite: {list(values)}")
    for joint, q, qdot in zip(joints, point.q, point.qdot):
        beyond = in_si(joint, config.limit_tolerance_deg, config.limit_tolerance_mm)
        if not joint.lower - beyond <= q <= joint.upper + beyond:
            raise MotionRefusedError(
                f"{joint.name} = {q:.6g} {joint.si_unit} is outside [{joint.lower:.4g}, "
                f"{joint.upper:.4g}]"
            )
        fastest = config.velocity_factor * joint.velocity
        if abs(qdot) > fastest:
            raise MotionRefusedError(
                f"{joint.name} = {qdot:.6g} {joint.si_unit}/s is outside [{-fastest:.4g}, "
                f"{fastest:.4g}]"
            )


def _check_times(setpoints: Setpoints, config: FollowConfig, now: float) -> None:
    """Refuse times that do not increase, are stale or lie in the far future."""
    times = setpoints.times
    if not all(map(math.isfinite, times)):
        raise MotionRefusedError("times are not all finite")
    if any(after <= before for before, after in pairwise(times)):
        raise MotionRefusedError("times do not increase")
    age = now - times[-1]
    if age > config.timeout:
        raise MotionRefusedError(
            f"stale: the last point is {age * 1e3:.0f} ms old, allowed {config.timeout * 1e3:.0f}"
        )
    # The first point tells of a clock; how far the last one is ahead is the robot's delay as well.
    early = times[0] - now
    if early > config.ahead:
        raise MotionRefusedError(
            f"stamp is {early * 1e3:.0f} ms in the future, allowed {config.ahead * 1e3:.0f}"
        )
    if times[-1] - times[0] > SPAN_S:
        raise MotionRefusedError(
            f"the points span {times[-1] - times[0]:.2f} s, allowed {SPAN_S:g}"
        )
