r"""Where a side stands at the earliest if it is stopped now.

A stop has three parts, each counted once: the robot goes on as it does for ``delay`` (the sample's
age, the way of the command, the robot's own filters and servo lag), then it brakes. Where its
motion is known, from a plan that it follows, the plan says where it is after the delay; where it is
not, speed and gain are fitted over several samples, for the time of one may be wrong by
milliseconds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np
from scara_control.joint_motion import JointMotion
from scara_control.joint_track import JointTrack
from scara_control.keep_out.zones import WatchedMove

from twin_controller.core.events import Joints, TwinPlan

FITTED = 4
"""Over so many samples the gain in speed is fitted: their times are known to some milliseconds."""

OVERSHOOT = 0.9
"""A plan heads for its target if it can stop there with its largest accelerations; this part of
the braking way is asked for, since a plan may brake within a rounding of them."""


class Braking(msgspec.Struct, frozen=True):
    """How a side brakes.

    Attributes:
        acceleration: Of each joint, SI.
        delay: From a sample until it begins [s].
        together: All joints come to rest at once, along the path: so a program is stopped.
    """

    acceleration: Joints
    delay: float
    together: bool = False


def braking_way(
    q: Joints, qdot: Joints, acceleration: Joints, delay: float, reached: Joints | None = None
) -> Joints:
    r"""Return where each joint stands at the earliest if it is stopped now, SI.

    .. math:: q + \tfrac{1}{2} (\dot q + \dot q_d) t_d + \dot q_d |\dot q_d| / 2a

    Args:
        q: Joint positions.
        qdot: Joint velocities now.
        acceleration: With what each joint brakes.
        delay: Until it begins to brake, :math:`t_d` [s].
        reached: Joint velocities by then, :math:`\dot q_d`; as now if left out.
    """
    rows = zip(q, qdot, reached or qdot, acceleration)
    return tuple(p + 0.5 * (v + w) * delay + w * abs(w) / (2.0 * a) for p, v, w, a in rows)


def stop_from(q: Joints, qdot: Joints, reached: Joints, braking: Braking) -> Joints:
    r"""Return where a side stands if it is stopped now, whose further motion is not known, SI.

    Each joint by itself as :func:`braking_way`; together, the slowest to brake sets the time
    :math:`T` for all and the way is :math:`\dot q_d T / 2`.

    Args:
        q: Joint positions at the newest sample.
        qdot: Joint velocities.
        reached: Joint velocities when it begins to brake.
        braking: How it brakes.
    """
    if not braking.together:
        return braking_way(q, qdot, braking.acceleration, braking.delay, reached)
    duration = braking_time(reached, braking.acceleration)
    rows = zip(q, qdot, reached)
    return tuple(p + 0.5 * (v + w) * braking.delay + 0.5 * w * duration for p, v, w in rows)


def braking_time(qdot: Joints, acceleration: Joints) -> float:
    """Return how long the joint brakes that needs longest [s]."""
    return max((abs(v) / a for v, a in zip(qdot, acceleration)), default=0.0)


def stop_on_plan(plan: TwinPlan, at: float, braking: Braking) -> tuple[Joints, ...]:
    """Return the corners of the way of a side that follows a plan and is stopped now.

    Args:
        plan: What it follows.
        at: The time of its newest sample, on the plan's clock [s].
        braking: How it brakes.
    """
    until = at + braking.delay - plan.stamp
    rows = [q for offset, q in plan.rows if at - plan.stamp < offset < until]
    track = JointTrack.from_checked(
        plan.setpoints,
        extrapolation_limit=braking.delay,
        stop_accelerations=braking.acceleration,
    )
    there = track.at(until)
    return (*rows, there.q, braking_way(there.q, there.qdot, braking.acceleration, 0.0))


def rest_of_plan(
    plan: TwinPlan, at: float, way: WatchedMove, acceleration: Joints
) -> tuple[Joints, ...]:
    """Return the corners of the way that is still to come; empty if its end is not known.

    It is known if the plan ends at rest, heads for the announced target and can still stop there,
    or ends on the announced way between two places. A plan that leads elsewhere is not believed.

    Args:
        plan: What is followed.
        at: The time of the newest sample, on the plan's clock [s].
        way: The announced move; its target is empty if there is none.
        acceleration: The largest of each joint, SI.
    """
    rows = tuple(q for offset, q in plan.rows if offset > at - plan.stamp)
    last = plan.setpoints.points[-1]
    if not any(last.qdot):
        return rows or (last.q,)
    target = way.target
    if not target:
        return ()
    if way.between:
        places = np.array((*way.between, target))
        apart = np.abs(places - np.array(last.q))
        nearest = int(np.argmin(apart.max(axis=1)))
        if np.any(apart[nearest] > np.abs(np.diff(places, axis=0)).max(axis=0) + 1e-4):
            return ()
        return (*rows, *way.between[nearest + 1 :], target)
    stop = braking_way(last.q, tuple(OVERSHOOT * v for v in last.qdot), acceleration, 0.0)
    for place, from_, end in zip(stop, last.q, target):
        # Nobody steers a joint to the last digit.
        if abs(place - from_) > abs(end - from_) + 1e-4 or (place - from_) * (end - from_) < -1e-8:
            return ()
    return (*rows, target)


def gain(samples: Sequence[JointMotion]) -> Joints:
    """Fit how fast each joint's velocity changes, by least squares; 0 from a single sample.

    Args:
        samples: At least one, the newest last; the last few of them count.
    """
    last = samples[-FITTED:]
    times = np.array([sample.time for sample in last])
    times = times - times.mean()
    spread = float(times @ times)
    if spread <= 0.0:
        return (0.0,) * len(samples[-1].q)
    slopes = times @ np.array([sample.qdot for sample in last]) / spread
    return tuple(float(slope) for slope in slopes)


def speed_reached(qdot: Joints, slope: Joints, delay: float, limit: Joints) -> Joints:
    """Return the joint velocities after ``delay`` if each joint gains speed as it did just before.

    What a joint loses does not count: it may stop losing it at any time.

    Args:
        qdot: Joint velocities now, SI.
        slope: How fast they change, SI.
        delay: How long it may go on [s].
        limit: Largest joint speeds, SI; a joint that is faster already stays as fast.
    """

    def reached(v: float, a: float, most: float) -> float:
        change = a * delay
        if change * v <= 0.0:
            return v
        return math.copysign(max(abs(v), min(abs(v + change), most)), v)

    return tuple(map(reached, qdot, slope, limit))


def on_path(qdot: Joints, reached: Joints, limit: Joints) -> Joints:
    """Return the velocities reached with no joint above its limit, all slowed by the same part.

    So the direction of the path stays: to limit each joint by itself would lead beside it. No joint
    gets slower than it is now.

    Args:
        qdot: Joint velocities now, SI.
        reached: After the delay, without a limit; none is less than now.
        limit: Largest joint speeds, SI.
    """
    over = max(abs(w) / most for w, most in zip(reached, limit))
    if over <= 1.0:
        return reached
    least = max(abs(v) / abs(w) for v, w in zip(qdot, reached) if w)
    part = max(1.0 / over, least)
    return tuple(part * w for w in reached)


def fastest_share(way: float, delay: float, braking: float) -> float:
    r"""Return the part p of a speed whose stop needs just ``way``.

    .. math:: p\,t_d + p^2 T / 2 = s

    Args:
        way: What is free, :math:`s`: divided by the full speed, so in [s].
        delay: Before braking begins, :math:`t_d` [s].
        braking: How long braking from the full speed lasts, :math:`T` [s].
    """
    free = max(way, 0.0)
    return 2.0 * free / (delay + math.sqrt(delay * delay + 2.0 * braking * free))
